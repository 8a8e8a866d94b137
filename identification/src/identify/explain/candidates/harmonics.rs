//! Search for the harmonic orders of the angle, and the frequencies, that are worth an exact screening.
//!
//! A torque a e^{inθ} changes the rate along the model's first-order decay. Its contribution s to each channel is computed along the logs
//! and correlated with the residual r: score = |Σ w s̄ r|² / Σ w |s|². The recursion neglects dry friction and what the model's own
//! parameters could imitate, so that it only ranks; [`super::score`] computes the exact score of the best few. The correlation with all
//! orders is one Fourier transform, by the adjoint of the recursion; with the power of a constant rate in each row it gives a rough score,
//! and the recursion is computed for the best few of these.

mod local_torque;
pub mod periods;
pub mod phase_lines;

use std::f64::consts::TAU;
use std::ops::Range;

use drive_model::effects::viscous;
use drive_model::{HarmonicSource, Screening};
use rayon::prelude::*;

use crate::identify::explain::criteria::HarmonicCriteria;
use crate::identify::explain::fitted::FittedModel;
use crate::identify::explain::fitted::motion::{angle, measured_current};
use crate::model::{BaseParameter, Channel, Input, Model};
use crate::recording::PreparedLog;
use crate::statistics::fourier::transform;

/// Orders, in periods per turn, that are worth an exact screening, the best first.
#[derive(Debug, Clone, Default)]
pub struct HarmonicOrders {
    torque: Vec<u32>,
    motor_constant: Vec<u32>,
    encoder: Vec<u32>,
    inertia: Vec<u32>,
}

impl HarmonicOrders {
    /// These orders.
    pub fn new(torque: Vec<u32>, motor_constant: Vec<u32>, encoder: Vec<u32>, inertia: Vec<u32>) -> Self {
        HarmonicOrders { torque, motor_constant, encoder, inertia }
    }

    /// The orders of one source.
    pub fn of(&self, source: HarmonicSource) -> &[u32] {
        match source {
            HarmonicSource::Torque => &self.torque,
            HarmonicSource::MotorConstant => &self.motor_constant,
            HarmonicSource::Encoder => &self.encoder,
            HarmonicSource::Inertia => &self.inertia,
        }
    }
}

/// Frequencies, Hz, of the best oscillation of each kind.
#[derive(Debug, Clone, Copy, Default)]
pub struct Frequencies {
    /// Of a torque.
    pub torque_Hz: Option<f64>,
    /// Of the voltage, relative to the commanded one.
    pub voltage_Hz: Option<f64>,
}

/// Orders scanned together: as many as a few vector registers hold.
const ORDERS_TOGETHER: usize = 8;
/// Orders with the best rough score that are scanned, for each that is wanted.
const SCANNED_PER_ORDER: usize = 4;
/// Bins per period of the highest order: the sums over them take 3 % of its amplitude.
const BINS_PER_PERIOD: usize = 8;

/// The best orders that the model does not have yet.
pub fn search_orders(base: &FittedModel) -> HarmonicOrders {
    let (model, data, criteria) = (&base.model, &base.data, &base.context.criteria.harmonics);
    let Some(theta) = angle(data) else { return HarmonicOrders::default() };
    let known = |source: HarmonicSource| -> Vec<u32> {
        let uses = model.effects().iter().filter(|e| e.card.screening == Screening::Harmonics(source));
        let orders = uses.filter_map(|e| e.parameters.get(e.card.harmonic_order_index()?));
        orders.map(|&k| model.parameters()[k].value as u32).collect()
    };
    let scan = Scan::new(base, theta);
    let highest = scan.highest_order(criteria);
    // A torque of order one is an unbalance.
    let mut taken = known(HarmonicSource::Torque);
    taken.push(1);
    let mut torque = scan.best(highest, ScannedQuantity::Torque, &taken, criteria.torque_orders);
    // Where the model is far off, its simulated angle is wrong; the torque computed from the rows does not depend on the model.
    let power = local_torque::power_by_order(model, data, theta, highest, criteria);
    let local = best(&power, &taken, criteria.local_orders);
    torque.extend(local.into_iter().filter(|order| !torque.contains(order)).collect::<Vec<_>>());
    let motor_constant = if scan.motor_constant.is_some() && scan.current_is_measured {
        scan.best(highest, ScannedQuantity::MotorConstant, &known(HarmonicSource::MotorConstant), criteria.motor_constant_orders)
    } else {
        Vec::new()
    };
    let encoder = if reads_encoder(data) {
        let orders: Vec<u32> = (1..=criteria.max_encoder_order as u32).collect();
        scan.best_of(&orders, ScannedQuantity::EncoderAngle, &known(HarmonicSource::Encoder), criteria.encoder_orders)
    } else {
        Vec::new()
    };
    let inertia = if scan.has_inertia {
        let orders: Vec<u32> = (1..=highest.min(criteria.max_inertia_order) as u32).collect();
        scan.best_of(&orders, ScannedQuantity::Inertia, &known(HarmonicSource::Inertia), criteria.inertia_orders)
    } else {
        Vec::new()
    };
    HarmonicOrders { torque, motor_constant, encoder, inertia }
}

/// An error of the encoder is visible: its angle is compared, or a rate is compared with the angle's slope.
fn reads_encoder(data: &PreparedLog) -> bool {
    let compared = |channel: Channel| data.channels.iter().any(|c| c.channel == channel);
    compared(Channel::Angle) || (data.driven == Input::Motion && compared(Channel::Rate))
}

/// The highest order of each source that the logs can show; nothing where they show none.
pub fn visible_orders(base: &FittedModel) -> HarmonicOrders {
    let (data, criteria) = (&base.data, &base.context.criteria.harmonics);
    let Some(theta) = angle(data) else { return HarmonicOrders::default() };
    let scan = Scan::new(base, theta);
    let highest = scan.highest_order(criteria);
    let where_visible = |visible: bool, order: usize| if visible { vec![order as u32] } else { Vec::new() };
    HarmonicOrders {
        torque: where_visible(true, highest),
        motor_constant: where_visible(scan.motor_constant.is_some() && scan.current_is_measured, highest),
        encoder: where_visible(reads_encoder(data), criteria.max_encoder_order),
        inertia: where_visible(scan.has_inertia, highest.min(criteria.max_inertia_order)),
    }
}

/// The best frequency of a torque and of the voltage that oscillate in time.
pub fn search_frequencies(base: &FittedModel) -> Frequencies {
    let (data, criteria) = (&base.data, &base.context.criteria.harmonics);
    let (from, to) = data.time_range_s();
    if data.driven == Input::Motion || to <= from {
        return Frequencies::default();
    }
    // Half periods of the log: no frequency is far from one that is tried.
    let step_Hz = 0.5 / (to - from);
    let phase: Vec<f64> = data.t_s.iter().map(|t| TAU * step_Hz * (t - from)).collect();
    let scan = Scan::new(base, &phase);
    let max_Hz = criteria.max_frequency_Hz.min(criteria.max_frequency_per_row / data.dt_s);
    let highest = criteria.max_half_periods.min((max_Hz / step_Hz) as usize);
    let drifts: Vec<u32> = (1..criteria.min_half_periods).collect();
    let frequency = |quantity: ScannedQuantity| scan.best(highest, quantity, &drifts, 1).first().map(|n| f64::from(*n) * step_Hz);
    Frequencies {
        torque_Hz: frequency(ScannedQuantity::Torque),
        voltage_Hz: data.driven.is_voltage().then(|| frequency(ScannedQuantity::Voltage)).flatten(),
    }
}

/// The quantity that is periodic in the angle, or in time.
#[derive(Clone, Copy, PartialEq, Eq)]
enum ScannedQuantity {
    /// The voltage, relative to the commanded one.
    Voltage,
    /// A torque.
    Torque,
    /// The motor constant, relative to its mean.
    MotorConstant,
    /// The angle that the encoder measures.
    EncoderAngle,
    /// The inertia, relative to its mean.
    Inertia,
}

/// One row, as the scan of every order needs it.
struct ScanRow {
    theta: f64,
    /// Torque and current by a relative change of the motor constant.
    by_motor_constant: (f64, f64),
    /// Torque and current by a relative change of the voltage.
    by_voltage: (f64, f64),
    /// Rate of the phase θ, rad/s, and its derivative; of the platform where θ is its angle.
    motion: (f64, f64),
    /// Weighted residuals of rate, current or torque, angle; 0 where held out or not compared.
    residuals: (f64, f64, f64),
    /// The row is fitted.
    fitted: bool,
}

/// The model along the logs, as far as the ranking needs it.
struct Scan<'s> {
    rows: Vec<ScanRow>,
    segments: &'s [Range<usize>],
    lag: usize,
    dt_s: f64,
    /// Decay of the rate over a row.
    decay: f64,
    /// Rate by a torque over a row.
    rate_per_torque: f64,
    /// Current by the rate.
    current_per_rate: f64,
    /// Current or torque that a prescribed motion demands by a torque.
    demand_per_torque: f64,
    /// Weights of rate, current or torque, angle; 0 where not compared.
    weights: (f64, f64, f64),
    /// Motor constant, N m/A; `None`: not in the model.
    motor_constant: Option<f64>,
    current_is_measured: bool,
    /// The model has an inertia.
    has_inertia: bool,
    /// Inertia, kg m².
    inertia: f64,
    /// Largest rate, rad/s.
    largest_rate: f64,
    /// A rate is compared with the slope of the angle.
    angle_is_reference: bool,
}

impl<'s> Scan<'s> {
    fn new(base: &'s FittedModel, theta: &[f64]) -> Self {
        let (model, data, weights): (&Model, &PreparedLog, &[f64]) = (&base.model, &base.data, &base.weights);
        let residuals = base.residuals();
        let inertia = model.base(BaseParameter::Inertia).unwrap_or(0.0);
        let motor_constant = model.base(BaseParameter::MotorConstant);
        let resistance = model.base(BaseParameter::Resistance).unwrap_or(0.0).max(1e-9);
        let viscous_N_m_s = model.value(viscous::CARD.parameters[0].name).unwrap_or(0.0);
        let k = motor_constant.unwrap_or(0.0);
        let by_voltage = data.driven.is_voltage();
        let damping = viscous_N_m_s.max(0.0) + if by_voltage { k * k / resistance } else { 0.0 };
        let x = if inertia > 0.0 { damping / inertia * data.dt_s } else { 0.0 };
        let decay = (-x).exp();
        let rate_per_torque = match (inertia > 0.0 && data.driven != Input::Motion, x > 1e-9) {
            (false, _) => 0.0,
            (true, true) => (1.0 - decay) / damping,
            (true, false) => data.dt_s / inertia,
        };
        let demand_per_torque = if data.driven != Input::Motion {
            0.0
        } else if k > 0.0 {
            -1.0 / k
        } else {
            -1.0
        };
        let channel = |wanted: &[Channel]| data.channels.iter().position(|c| wanted.contains(&c.channel));
        let (rate, drive, angle) = (channel(&[Channel::Rate]), channel(&[Channel::Current, Channel::Torque]), channel(&[Channel::Angle]));
        let current = measured_current(data);
        let lag = data.angle_lag();
        let last = data.len() - 1;
        let braking = if by_voltage { k / resistance } else { 0.0 };
        let mut largest_rate = 0.0_f64;
        let slope = |values: &dyn Fn(usize) -> f64, row: usize| {
            let (a, b) = (row.saturating_sub(lag / 2), (row + lag.div_ceil(2)).min(last));
            let span_s = data.t_s[b] - data.t_s[a];
            if span_s > 0.0 { (values(b) - values(a)) / span_s } else { 0.0 }
        };
        let rates: Vec<f64> = (0..=last).map(|row| slope(&|k| theta[k], row)).collect();
        let rows = (0..=last)
            .map(|row| {
                let omega = rates[row];
                largest_rate = largest_rate.max(omega.abs());
                let weighted = |c: Option<usize>| {
                    c.map_or(0.0, |c| residuals[c].get(row).copied().filter(|r| r.is_finite()).unwrap_or(0.0) * weights[c])
                };
                let fitted = !data.held_out(row);
                let residuals = if fitted { (weighted(rate), weighted(drive), weighted(angle)) } else { (0.0, 0.0, 0.0) };
                let i = current.map_or(0.0, |i| i[row]);
                let driven_A = if by_voltage { data.input[row] / resistance } else { 0.0 };
                ScanRow {
                    theta: theta[row],
                    by_motor_constant: (k * (i - braking * omega), -braking * omega),
                    by_voltage: (k * driven_A, driven_A),
                    motion: (omega, slope(&|k| rates[k], row)),
                    residuals,
                    fitted,
                }
            })
            .collect();
        let weight = |c: Option<usize>| c.map_or(0.0, |c| weights[c]);
        Scan {
            rows,
            segments: &data.segments,
            lag,
            dt_s: data.dt_s,
            decay,
            rate_per_torque,
            current_per_rate: if by_voltage { -k / resistance } else { 0.0 },
            demand_per_torque,
            weights: (weight(rate), weight(drive), weight(angle)),
            motor_constant,
            current_is_measured: current.is_some(),
            has_inertia: inertia > 0.0,
            inertia,
            largest_rate,
            angle_is_reference: data.driven == Input::Motion,
        }
    }

    /// Highest order that the sampling resolves.
    fn highest_order(&self, criteria: &HarmonicCriteria) -> usize {
        let resolved = criteria.max_phase_per_row_rad / (self.largest_rate * self.dt_s).max(4e-9);
        (resolved as usize).clamp(1, criteria.max_order)
    }

    /// The `count` best orders up to `highest`, without those `taken`.
    fn best(&self, highest: usize, quantity: ScannedQuantity, taken: &[u32], count: usize) -> Vec<u32> {
        let rough = best(&self.rough_scores(highest, quantity), taken, SCANNED_PER_ORDER * count);
        self.best_of(&rough, quantity, taken, count)
    }

    /// The `count` best of these orders, without those `taken`.
    fn best_of(&self, orders: &[u32], quantity: ScannedQuantity, taken: &[u32], count: usize) -> Vec<u32> {
        let chunks: Vec<&[u32]> = orders.chunks(ORDERS_TOGETHER).collect();
        let scored = chunks.par_iter().flat_map_iter(|chunk| chunk.iter().copied().zip(self.scores(chunk, quantity)));
        let mut scored: Vec<(u32, f64)> = scored.filter(|(order, _)| !taken.contains(order)).collect();
        scored.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        scored.into_iter().take(count).map(|(order, _)| order).collect()
    }

    /// Rough score of each order from 0 to `highest`.
    fn rough_scores(&self, highest: usize, quantity: ScannedQuantity) -> Vec<f64> {
        let mut sums = vec![0.0; (BINS_PER_PERIOD * highest.max(1)).next_power_of_two()];
        let per_turn = sums.len() as f64 / TAU;
        for (row, sensitivity) in self.rows.iter().zip(self.sensitivities(quantity)) {
            let bin = (row.theta * per_turn).rem_euclid(sums.len() as f64) as usize;
            if let Some(sum) = sums.get_mut(bin) {
                *sum += sensitivity;
            }
        }
        let power = self.response_power(quantity, 1.0, highest.max(2) as f64);
        let lines = transform(sums);
        (0..=highest).map(|order| if order == 0 { 0.0 } else { lines[order].norm_sqr() / power.at(order as f64) }).collect()
    }

    /// Torque of a row by the quantity, and the current or torque that goes with it at once.
    fn acts(&self, row: &ScanRow, quantity: ScannedQuantity) -> (f64, f64) {
        match quantity {
            ScannedQuantity::Torque | ScannedQuantity::Inertia => (1.0, self.demand_per_torque),
            ScannedQuantity::MotorConstant => {
                (row.by_motor_constant.0, row.by_motor_constant.1 + self.demand_per_torque * row.by_motor_constant.0)
            }
            ScannedQuantity::Voltage => row.by_voltage,
            ScannedQuantity::EncoderAngle => (0.0, 0.0),
        }
    }

    /// Scores of at most [`ORDERS_TOGETHER`] orders.
    fn scores(&self, orders: &[u32], quantity: ScannedQuantity) -> [f64; ORDERS_TOGETHER] {
        let orders: [f64; ORDERS_TOGETHER] = std::array::from_fn(|n| orders.get(n).map_or(0.0, |order| f64::from(*order)));
        let zero = [0.0; ORDERS_TOGETHER];
        let (mut dot_re, mut dot_im, mut power) = (zero, zero, zero);
        // Sums of the rate up to each of the last rows, for the increments of the angle.
        let mut past = vec![(zero, zero); self.lag];
        for rows in self.segments {
            let (mut re, mut im) = (zero, zero);
            let (mut sum_re, mut sum_im) = (zero, zero);
            past.fill((zero, zero));
            for (at, row) in self.rows[rows.clone()].iter().enumerate() {
                let (mut wave_re, mut wave_im) = (zero, zero);
                for n in 0..ORDERS_TOGETHER {
                    (wave_im[n], wave_re[n]) = (orders[n] * row.theta).sin_cos();
                }
                if quantity == ScannedQuantity::Inertia {
                    // J(θ) = J (1 + e^{inθ}): the torque −J (ω' + ½ i n ω²) e^{inθ}.
                    let (by_acceleration, by_rate) = (-self.inertia * row.motion.1, -0.5 * self.inertia * row.motion.0 * row.motion.0);
                    for n in 0..ORDERS_TOGETHER {
                        let turned = by_rate * orders[n];
                        (wave_re[n], wave_im[n]) =
                            (by_acceleration * wave_re[n] - turned * wave_im[n], by_acceleration * wave_im[n] + turned * wave_re[n]);
                    }
                }
                let (torque, at_once) = self.acts(row, quantity);
                let slot = &mut past[at % self.lag.max(1)];
                let full = at >= self.lag;
                let weigh = f64::from(u8::from(row.fitted));
                for n in 0..ORDERS_TOGETHER {
                    let angle_now =
                        if quantity == ScannedQuantity::EncoderAngle { (wave_re[n], wave_im[n]) } else { (sum_re[n], sum_im[n]) };
                    let (angle_re, angle_im) = (angle_now.0 - slot.0[n], angle_now.1 - slot.1[n]);
                    (slot.0[n], slot.1[n]) = angle_now;
                    let on = f64::from(u8::from(full)) * weigh;
                    if quantity == ScannedQuantity::EncoderAngle && self.angle_is_reference {
                        // The error of the reference in its slope: n ω i e^{inθ}.
                        let slope_1_s = orders[n] * row.motion.0;
                        (re[n], im[n]) = (-slope_1_s * wave_im[n], slope_1_s * wave_re[n]);
                    }
                    let drive_re = self.current_per_rate * re[n] + at_once * wave_re[n];
                    let drive_im = self.current_per_rate * im[n] + at_once * wave_im[n];
                    dot_re[n] += row.residuals.0 * re[n] + row.residuals.1 * drive_re + row.residuals.2 * angle_re;
                    dot_im[n] += row.residuals.0 * im[n] + row.residuals.1 * drive_im + row.residuals.2 * angle_im;
                    power[n] += weigh
                        * (self.weights.0 * (re[n] * re[n] + im[n] * im[n]) + self.weights.1 * (drive_re * drive_re + drive_im * drive_im))
                        + on * self.weights.2 * (angle_re * angle_re + angle_im * angle_im);
                    sum_re[n] += self.dt_s * re[n];
                    sum_im[n] += self.dt_s * im[n];
                    re[n] = self.decay * re[n] + self.rate_per_torque * torque * wave_re[n];
                    im[n] = self.decay * im[n] + self.rate_per_torque * torque * wave_im[n];
                }
            }
        }
        std::array::from_fn(|n| if power[n] > 0.0 { (dot_re[n] * dot_re[n] + dot_im[n] * dot_im[n]) / power[n] } else { 0.0 })
    }
}

/// The `count` orders with the largest score, without those `taken`.
fn best(score: &[f64], taken: &[u32], count: usize) -> Vec<u32> {
    let mut orders: Vec<usize> = (1..score.len()).filter(|n| !taken.contains(&(*n as u32))).collect();
    orders.sort_by(|a, b| score[*b].total_cmp(&score[*a]));
    orders.into_iter().take(count).map(|n| n as u32).collect()
}
