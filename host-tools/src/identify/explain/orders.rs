//! Which orders per turn are worth an exact look.
//!
//! A torque a e^{inθ} moves the rate along the model's first-order decay; what it would show in each channel is run along the log for every
//! order n at once, and held against the residual: score = |Σ w s̄ r|² / Σ w |s|². The recursion knows neither dry friction nor what the
//! model's own parameters could imitate, so that it only ranks; [`super::screen`] takes the exact score of the best few.

mod local;

use rayon::prelude::*;

use super::trial::Orders;
use crate::identify::fit::PreparedLog;
use crate::model::{Channel, Input, Model};

/// Highest order of torques, of the encoder.
pub const HIGHEST: usize = 400;
const HIGHEST_OF_ENCODER: usize = 8;
/// How many orders of each kind are looked at exactly.
const COGGING: usize = 5;
/// And how many by the rows' own torque, if they are not among those.
const LOCAL: usize = 1;
const RIPPLE: usize = 4;
const ECCENTRICITY: usize = 2;
/// Orders that go through the log together: as many as a few vector registers hold.
const TOGETHER: usize = 8;

/// The most promising orders that the model does not have yet.
pub fn promising(model: &Model, record: &PreparedLog, residuals: &[&[f64]], weights: &[f64]) -> Orders {
    let Some(theta) = record.theta.or((record.driven == Input::Motion).then_some(record.input)) else { return Orders::default() };
    let has = |id: &str, stem: &str| -> Vec<u32> {
        let uses = model.effects().iter().filter(|e| e.card.id == id);
        let orders = uses.flat_map(|e| &e.parameters).map(|&k| &model.parameters()[k]).filter(|p| p.name.starts_with(stem));
        orders.map(|p| p.value as u32).collect()
    };
    let scan = Scan::new(model, record, theta, residuals, weights);
    // Order one of a torque is a mass off the axis.
    let mut taken = has("cogging", "cogging_order");
    taken.push(1);
    let mut cogging = best(&scan.scores(scan.highest(), Kind::Torque), &taken, COGGING);
    // Where the model is far off, its residual says little of the angle that was really passed: the torque that the rows themselves lack does.
    let local = best(&local::torque_by_order(model, record, theta, scan.highest()), &taken, LOCAL);
    cogging.extend(local.into_iter().filter(|order| !cogging.contains(order)).collect::<Vec<_>>());
    let ripple = match scan.constant {
        Some(_) if scan.current.is_some() => {
            best(&scan.scores(scan.highest(), Kind::Ripple), &has("torque-ripple", "ripple_order"), RIPPLE)
        }
        _ => Vec::new(),
    };
    let seen = record.channels.iter().any(|c| c.channel == Channel::Angle);
    let eccentricity = if seen {
        let scores = scan.scores(HIGHEST_OF_ENCODER, Kind::Encoder);
        best(&scores, &has("encoder-eccentricity", "eccentricity_order"), ECCENTRICITY)
    } else {
        Vec::new()
    };
    Orders { cogging, ripple, eccentricity }
}

/// Highest multiple of half a period over the record that is looked at, and the shortest and longest record.
const MOST_PERIODS: usize = 3000;
const HIGHEST_HZ: f64 = 50.0;

/// Frequencies, Hz, at which a torque or the supply may swing: the most promising of each.
pub fn swings(model: &Model, record: &PreparedLog, residuals: &[&[f64]], weights: &[f64]) -> (Option<f64>, Option<f64>) {
    let (from, to) = (record.t_s[0], record.t_s[record.len() - 1]);
    if record.driven == Input::Motion || to <= from {
        return (None, None);
    }
    // Half periods of the record, so that no frequency lies far from one that is tried.
    let step_hz = 0.5 / (to - from);
    let phase: Vec<f64> = record.t_s.iter().map(|t| std::f64::consts::TAU * step_hz * (t - from)).collect();
    let scan = Scan::new(model, record, &phase, residuals, weights);
    let highest = MOST_PERIODS.min((HIGHEST_HZ.min(0.2 / record.dt_s) / step_hz) as usize);
    // Less than two periods are a drift.
    let slow: Vec<u32> = (1..4).collect();
    let frequency = |kind: Kind| best(&scan.scores(highest, kind), &slow, 1).first().map(|n| f64::from(*n) * step_hz);
    (frequency(Kind::Torque), (record.driven == Input::Voltage).then(|| frequency(Kind::Supply)).flatten())
}

/// What goes round with the angle, or with the time.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// The supply: a part of the voltage asked for.
    Supply,
    /// A torque.
    Torque,
    /// The motor constant.
    Ripple,
    /// What the encoder shows.
    Encoder,
}

/// One row, as every order needs it.
struct Row {
    /// cos θ, sin θ.
    turn: (f64, f64),
    theta: f64,
    /// Torque, and current at once, of a relative ripple of the motor constant.
    ripple: (f64, f64),
    /// Torque, and current at once, of a relative change of the voltage.
    supply: (f64, f64),
    /// Weighted residuals of rate, current or torque, angle; 0 where held out or not compared.
    pull: (f64, f64, f64),
    /// The row counts in the squares.
    counts: bool,
}

/// The model along the log, as far as the ranking needs it.
struct Scan<'s> {
    rows: Vec<Row>,
    segments: &'s [std::ops::Range<usize>],
    lag: usize,
    dt_s: f64,
    /// Decay over a row, and rate gained per torque.
    decay: f64,
    gain: f64,
    /// Current shown per rate, and current (or torque) shown at once per torque under a prescribed motion.
    current_per_rate: f64,
    demanded: f64,
    /// Weights of rate, current or torque, angle; 0 where not compared.
    weights: (f64, f64, f64),
    constant: Option<f64>,
    current: Option<&'s [f64]>,
    largest_rate: f64,
}

impl<'s> Scan<'s> {
    fn new(model: &Model, record: &'s PreparedLog, theta: &[f64], residuals: &[&[f64]], weights: &[f64]) -> Self {
        let value = |name: &str| model.value(name).unwrap_or(0.0);
        let inertia = value("inertia_kg_m2");
        let (constant, resistance) = (model.value("motor_constant_N_m_A"), value("resistance_ohm").max(1e-9));
        let k = constant.unwrap_or(0.0);
        let voltage = record.driven == Input::Voltage;
        let damping = value("viscous_N_m_s").max(0.0) + if voltage { k * k / resistance } else { 0.0 };
        let x = if inertia > 0.0 { damping / inertia * record.dt_s } else { 0.0 };
        let decay = (-x).exp();
        let gain = match (inertia > 0.0 && record.driven != Input::Motion, x > 1e-9) {
            (false, _) => 0.0,
            (true, true) => (1.0 - decay) / damping,
            (true, false) => record.dt_s / inertia,
        };
        let demanded = if record.driven != Input::Motion {
            0.0
        } else if k > 0.0 {
            -1.0 / k
        } else {
            -1.0
        };
        let channel = |wanted: &[Channel]| record.channels.iter().position(|c| wanted.contains(&c.channel));
        let (rate, drive, angle) = (channel(&[Channel::Rate]), channel(&[Channel::Current, Channel::Torque]), channel(&[Channel::Angle]));
        let current = record.channels.iter().find(|c| c.channel == Channel::Current).map(|c| c.measured).or(record.current);
        let lag = record.angle_lag();
        let last = record.len() - 1;
        let braking = if voltage { k / resistance } else { 0.0 };
        let mut largest_rate = 0.0_f64;
        let rows = (0..=last)
            .map(|row| {
                let (a, b) = (row.saturating_sub(lag / 2), (row + lag.div_ceil(2)).min(last));
                let span_s = record.t_s[b] - record.t_s[a];
                let omega = if span_s > 0.0 { (theta[b] - theta[a]) / span_s } else { 0.0 };
                largest_rate = largest_rate.max(omega.abs());
                let pull = |c: Option<usize>| {
                    c.map_or(0.0, |c| residuals[c].get(row).copied().filter(|r| r.is_finite()).unwrap_or(0.0) * weights[c])
                };
                let counts = !record.held_out(row);
                let pulls = if counts { (pull(rate), pull(drive), pull(angle)) } else { (0.0, 0.0, 0.0) };
                let (s, c) = theta[row].sin_cos();
                let i = current.map_or(0.0, |i| i[row]);
                let amps = if voltage { record.input[row] / resistance } else { 0.0 };
                let ripple = (k * (i - braking * omega), -braking * omega);
                Row { turn: (c, s), theta: theta[row], ripple, supply: (k * amps, amps), pull: pulls, counts }
            })
            .collect();
        let weight = |c: Option<usize>| c.map_or(0.0, |c| weights[c]);
        Scan {
            rows,
            segments: &record.segments,
            lag,
            dt_s: record.dt_s,
            decay,
            gain,
            current_per_rate: if voltage { -k / resistance } else { 0.0 },
            demanded,
            weights: (weight(rate), weight(drive), weight(angle)),
            constant,
            current,
            largest_rate,
        }
    }

    /// Beyond it no row resolves the order at half of the largest rate.
    fn highest(&self) -> usize {
        let resolved = std::f64::consts::PI / (0.25 * self.largest_rate * self.dt_s).max(1e-9);
        (resolved as usize).clamp(1, HIGHEST)
    }

    /// Score of each order from 0 to `highest`.
    fn scores(&self, highest: usize, kind: Kind) -> Vec<f64> {
        let firsts: Vec<usize> = (1..=highest).step_by(TOGETHER).collect();
        let chunks: Vec<[f64; TOGETHER]> = firsts.par_iter().map(|&first| self.chunk(first, kind)).collect();
        let mut scores = vec![0.0];
        scores.extend(chunks.into_iter().flatten().take(highest));
        scores
    }

    /// Scores of the orders from `first` on.
    fn chunk(&self, first: usize, kind: Kind) -> [f64; TOGETHER] {
        let zero = [0.0; TOGETHER];
        let (mut dot_re, mut dot_im, mut power) = (zero, zero, zero);
        // Sums of the rate of the last rows, for the increments of the angle.
        let mut past = vec![(zero, zero); self.lag];
        for rows in self.segments {
            let (mut re, mut im) = (zero, zero);
            let (mut sum_re, mut sum_im) = (zero, zero);
            past.fill((zero, zero));
            for (at, row) in self.rows[rows.clone()].iter().enumerate() {
                let (sin, cos) = (first as f64 * row.theta).sin_cos();
                let (mut wave_re, mut wave_im) = (zero, zero);
                let (mut c, mut s) = (cos, sin);
                for n in 0..TOGETHER {
                    (wave_re[n], wave_im[n]) = (c, s);
                    (c, s) = (c * row.turn.0 - s * row.turn.1, c * row.turn.1 + s * row.turn.0);
                }
                let (torque, at_once) = match kind {
                    Kind::Torque => (1.0, self.demanded),
                    Kind::Ripple => (row.ripple.0, row.ripple.1 + self.demanded * row.ripple.0),
                    Kind::Supply => row.supply,
                    Kind::Encoder => (0.0, 0.0),
                };
                let slot = &mut past[at % self.lag.max(1)];
                let full = at >= self.lag;
                let weigh = f64::from(u8::from(row.counts));
                for n in 0..TOGETHER {
                    let (angle_re, angle_im) = if kind == Kind::Encoder {
                        let difference = (wave_re[n] - slot.0[n], wave_im[n] - slot.1[n]);
                        (slot.0[n], slot.1[n]) = (wave_re[n], wave_im[n]);
                        difference
                    } else {
                        let difference = (sum_re[n] - slot.0[n], sum_im[n] - slot.1[n]);
                        (slot.0[n], slot.1[n]) = (sum_re[n], sum_im[n]);
                        difference
                    };
                    let on = f64::from(u8::from(full)) * weigh;
                    let drive_re = self.current_per_rate * re[n] + at_once * wave_re[n];
                    let drive_im = self.current_per_rate * im[n] + at_once * wave_im[n];
                    dot_re[n] += row.pull.0 * re[n] + row.pull.1 * drive_re + row.pull.2 * angle_re;
                    dot_im[n] += row.pull.0 * im[n] + row.pull.1 * drive_im + row.pull.2 * angle_im;
                    power[n] += weigh
                        * (self.weights.0 * (re[n] * re[n] + im[n] * im[n]) + self.weights.1 * (drive_re * drive_re + drive_im * drive_im))
                        + on * self.weights.2 * (angle_re * angle_re + angle_im * angle_im);
                    sum_re[n] += self.dt_s * re[n];
                    sum_im[n] += self.dt_s * im[n];
                    re[n] = self.decay * re[n] + self.gain * torque * wave_re[n];
                    im[n] = self.decay * im[n] + self.gain * torque * wave_im[n];
                }
            }
        }
        std::array::from_fn(|n| if power[n] > 0.0 { (dot_re[n] * dot_re[n] + dot_im[n] * dot_im[n]) / power[n] } else { 0.0 })
    }
}

/// The `count` orders with the largest score, but for those `taken`.
fn best(score: &[f64], taken: &[u32], count: usize) -> Vec<u32> {
    let mut orders: Vec<usize> = (1..score.len()).filter(|n| !taken.contains(&(*n as u32))).collect();
    orders.sort_by(|a, b| score[*b].total_cmp(&score[*a]));
    orders.into_iter().take(count).map(|n| n as u32).collect()
}
