//! Orders, periods and times that are worth an exact screening, by the gradient of the likelihood.
//!
//! A torque a e^{inθ} has the score |Σ gₖ e^{inθₖ}|², with the gradient g of ln L by a torque in each row. Sums in bins of the phase (angle, or time) and one
//! Fourier transform give all orders at once. The variance of the score under noise is taken from the neighbouring orders. A jump of the reading from a
//! row on has the score (Σ g)², summed over the rows from there.

use drive_model::{HarmonicSource, PeriodOf, Screening};

use super::model::PredictedModel;
use crate::identify::explain::harmonics::periods::{Periods, known};
use crate::identify::explain::harmonics::phase_lines::{Phase, PhaseLines};
use crate::identify::explain::harmonics::{Frequencies, HarmonicOrders};
use crate::identify::explain::motion::{angle, measured_current};
use crate::identify::explain::screen::MAX_JUMPS;
use crate::identify::explain::trials::Starts;
use crate::identify::predict::adjoint::Gradient;
use crate::identify::residual::harmonics::transform;
use crate::model::{BaseParameter, Channel, Input};
use crate::statistics::robust::median;

/// Bins per turn: order 400 loses 6 % of its amplitude.
const BINS: usize = 2048;
/// Highest order, the limit of the cards.
const MAX_ORDER: usize = 400;
/// Highest order of an encoder's error.
const MAX_ENCODER_ORDER: usize = 8;
/// Phase of the highest order that one row covers at the largest rate, rad: a period per row at half of that rate.
const MAX_PHASE_PER_ROW_RAD: f64 = 4.0 * std::f64::consts::PI;
/// Orders of a source that are screened exactly.
const ORDERS: usize = 4;
/// Orders of the encoder that are screened exactly.
const ENCODER_ORDERS: usize = 2;
/// Orders of an encoder that is mounted off its centre or tilted: always screened.
const MOUNTING_ORDERS: [u32; 2] = [1, 2];
/// Orders on either side that give the level of noise.
const NEIGHBOURS: usize = 12;

/// All that a search finds beside a model.
pub fn search(base: &PredictedModel, gradient: &Gradient) -> Starts {
    Starts {
        orders: search_orders(base, gradient),
        periods: search_periods(base, gradient),
        jumps_s: search_jumps(base, gradient, MAX_JUMPS),
    }
}

/// The best periods over the angle and over time that the model does not have yet.
fn search_periods(base: &PredictedModel, gradient: &Gradient) -> Periods {
    let fitted = &base.fitted;
    let (data, criteria) = (&fitted.data, &fitted.context.criteria.harmonics);
    let mut tested = 0;
    let mut of = |phase: &Phase, highest: f64, period: PeriodOf| {
        let (found, of) =
            best_periods(phase, &gradient.torque, (criteria.min_periods_in_log, highest), &known(fitted, period), criteria.periods);
        tested += of;
        found
    };
    let per_turn = angle(data).map_or_else(Vec::new, |theta| {
        of(&Phase::of_angle(theta), highest_order(theta, data.angle_lag(), data.dt_s) as f64, PeriodOf::Angle)
    });
    let highest_Hz = criteria.max_frequency_Hz.min(criteria.max_frequency_per_row / data.dt_s);
    let frequencies = of(&Phase::of_time(data), highest_Hz, PeriodOf::Time);
    Periods::new(per_turn, frequencies, tested)
}

/// Gradient of ln L by a voltage in each row, which acts as the torque K v/R and as the current v/R; `None` where the voltage is not the input.
fn by_voltage(base: &PredictedModel, gradient: &Gradient) -> Option<Vec<f64>> {
    let fitted = &base.fitted;
    let constant = |which: BaseParameter| fitted.model.base(which);
    let (k, resistance) = (constant(BaseParameter::MotorConstant)?, constant(BaseParameter::Resistance).filter(|r| *r > 0.0)?);
    let current = fitted.data.channels.iter().position(|c| c.channel == Channel::Current);
    let of_row = |row: usize| (k * gradient.torque[row] + current.map_or(0.0, |c| gradient.readings[c][row])) / resistance;
    (fitted.data.driven == Input::Voltage).then(|| (0..fitted.data.len()).map(of_row).collect())
}

/// The best frequencies, Hz, of a torque and of a relative change of the voltage that oscillate in time.
pub fn search_frequencies(base: &PredictedModel) -> Frequencies {
    let Some(gradient) = base.gradient() else { return Frequencies::default() };
    let data = &base.fitted.data;
    let criteria = &base.fitted.context.criteria.harmonics;
    let phase = Phase::of_time(data);
    let limits = (criteria.min_periods_in_log, criteria.max_frequency_Hz.min(criteria.max_frequency_per_row / data.dt_s));
    let best = |series: &[f64]| best_periods(&phase, series, limits, &[], 1).0.first().copied();
    let voltage = by_voltage(base, &gradient).map(|by| by.iter().zip(data.input.iter()).map(|(g, u)| g * u).collect::<Vec<f64>>());
    Frequencies { torque_Hz: best(&gradient.torque), voltage_Hz: voltage.and_then(|v| best(&v)) }
}

/// The orders from `min_periods` periods in all up to `highest`, in periods per turn of the phase, whose power is highest above that of their neighbours, without those
/// `known`; and the number of distinguishable orders.
fn best_periods(phase: &Phase, gradient: &[f64], (min_periods, highest): (f64, f64), known: &[f64], count: usize) -> (Vec<f64>, usize) {
    let Some(lines) = PhaseLines::of(phase, gradient, min_periods, highest) else { return (Vec::new(), 0) };
    let power: Vec<f64> = lines.transform.iter().map(|z| z.norm_sqr()).collect();
    let above_neighbours = |line: usize| power[line] / level(&power, line, lines.resolution() * NEIGHBOURS);
    (lines.best(&power, above_neighbours, known, count), lines.distinguishable())
}

/// Times at which the reading of the angle may have jumped, s, the best first: each lies between two rows.
fn search_jumps(base: &PredictedModel, gradient: &Gradient, count: usize) -> Vec<f64> {
    let data = &base.fitted.data;
    let Some(angle) = data.channels.iter().position(|c| c.channel == Channel::Angle) else { return Vec::new() };
    let mut scores: Vec<(usize, f64)> = Vec::new();
    for rows in &data.segments {
        let mut sum = 0.0;
        for row in (rows.start + 1..rows.end).rev() {
            sum += gradient.readings[angle][row];
            // The longer the rows after the jump, the larger is the variance of the sum.
            scores.push((row, sum * sum));
        }
    }
    scores.sort_by(|a, b| b.1.total_cmp(&a.1));
    let apart = data.angle_lag();
    let mut found: Vec<usize> = Vec::new();
    for (row, _) in scores {
        if found.len() == count {
            break;
        }
        if found.iter().all(|other| other.abs_diff(row) >= apart) {
            found.push(row);
        }
    }
    found.into_iter().map(|row| 0.5 * (data.t_s[row - 1] + data.t_s[row])).collect()
}

/// The best orders of each source that the model does not have yet.
fn search_orders(base: &PredictedModel, gradient: &Gradient) -> HarmonicOrders {
    let fitted = &base.fitted;
    let (model, data) = (&fitted.model, &fitted.data);
    let Some(theta) = angle(data) else { return HarmonicOrders::default() };
    let known = |source: HarmonicSource| -> Vec<u32> {
        let uses = model.effects().iter().filter(|e| e.card.screening == Screening::Harmonics(source));
        let orders = uses.filter_map(|e| e.parameters.get(e.card.harmonic_order_index()?));
        orders.map(|&k| model.parameters()[k].value as u32).collect()
    };
    let highest = highest_order(theta, data.angle_lag(), data.dt_s);
    let channel = |channel: Channel| data.channels.iter().position(|c| c.channel == channel);
    let torque = |row: usize| gradient.torque[row];
    // A torque of order one is an unbalance.
    let mut taken = known(HarmonicSource::Torque);
    taken.push(1);
    let torque_orders = best(&powers(theta, torque, highest), &taken, ORDERS);
    let lag = data.angle_lag();
    let rate = |row: usize| {
        let (a, b) = (row.saturating_sub(lag / 2), (row + lag.div_ceil(2)).min(theta.len() - 1));
        (theta[b] - theta[a]) / (data.t_s[b] - data.t_s[a]).max(1e-12)
    };
    let k = model.base(BaseParameter::MotorConstant);
    let motor_constant = match (k, measured_current(data)) {
        (Some(k), Some(current)) => {
            // The back-EMF acts as a voltage.
            let voltage = by_voltage(base, gradient).unwrap_or_else(|| vec![0.0; theta.len()]);
            let value = |row: usize| k * (current[row] * gradient.torque[row] - rate(row) * voltage[row]);
            best(&powers(theta, value, highest), &known(HarmonicSource::MotorConstant), ORDERS)
        }
        _ => Vec::new(),
    };
    let encoder = match channel(Channel::Angle) {
        Some(c) => {
            let known = known(HarmonicSource::Encoder);
            let mut orders = best(&powers(theta, |row| gradient.readings[c][row], MAX_ENCODER_ORDER), &known, ENCODER_ORDERS);
            let mounting = MOUNTING_ORDERS.into_iter().filter(|n| !known.contains(n) && !orders.contains(n));
            orders.extend(mounting.collect::<Vec<_>>());
            orders
        }
        None => Vec::new(),
    };
    let inertia = if model.base(BaseParameter::Inertia).is_some() {
        let criteria = &fitted.context.criteria.harmonics;
        // −½ J′(θ) ω² of the Lagrange equation.
        let value = |row: usize| gradient.torque[row] * rate(row).powi(2);
        best(&powers(theta, value, highest.min(criteria.max_inertia_order)), &known(HarmonicSource::Inertia), criteria.inertia_orders)
    } else {
        Vec::new()
    };
    HarmonicOrders::new(torque_orders, motor_constant, encoder, inertia)
}

/// Highest order that the sampling resolves.
fn highest_order(theta: &[f64], lag: usize, dt_s: f64) -> usize {
    let most = theta.windows(lag + 1).map(|w| (w[lag] - w[0]).abs()).fold(0.0, f64::max) / (lag as f64 * dt_s);
    ((MAX_PHASE_PER_ROW_RAD / (most * dt_s).max(1e-9)) as usize).clamp(1, MAX_ORDER)
}

/// Squared sums of `value` e^{inθ} by order from 0 on.
fn powers(theta: &[f64], value: impl Fn(usize) -> f64, highest: usize) -> Vec<f64> {
    let mut sums = vec![0.0; BINS];
    let per_turn = BINS as f64 / std::f64::consts::TAU;
    for (row, angle) in theta.iter().enumerate() {
        let v = value(row);
        if v.is_finite() && angle.is_finite() {
            let bin = (angle * per_turn).rem_euclid(BINS as f64) as usize;
            sums[bin.min(BINS - 1)] += v;
        }
    }
    transform(sums).iter().take(highest + 1).map(|z| z.norm_sqr()).collect()
}

/// The orders whose power is highest above that of their neighbours, without those `taken`.
fn best(power: &[f64], taken: &[u32], count: usize) -> Vec<u32> {
    let free = (1..power.len()).filter(|n| !taken.contains(&(*n as u32)));
    let mut orders: Vec<(usize, f64)> = free.map(|n| (n, power[n] / level(power, n, NEIGHBOURS))).collect();
    orders.sort_by(|a, b| b.1.total_cmp(&a.1));
    orders.into_iter().take(count).map(|(n, _)| n as u32).collect()
}

/// Median power of the neighbours of a line.
fn level(power: &[f64], line: usize, neighbours: usize) -> f64 {
    let (from, to) = (line.saturating_sub(neighbours).max(1), (line + neighbours + 1).min(power.len()));
    median((from..to).filter(|j| *j != line).map(|j| power[j])).unwrap_or(0.0).max(f64::MIN_POSITIVE)
}
