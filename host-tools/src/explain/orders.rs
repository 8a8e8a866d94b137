//! Which orders per turn are worth an exact look.
//!
//! A torque τ at row k moves every later output along the model's first-order decay. Run backwards, that recursion turns the residuals into
//! the gradient of the misfit by the torque at each row, g_k = ∂/∂τ_k Σ w r s. The score of *any* torque is then Σ g τ, and of all
//! harmonics of the angle at once it is the Fourier transform of g binned over the turn. Divided by what such a torque would show, this ranks
//! the orders; the exact score of the best ones is taken by [`super::screen`].

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

use super::trial::Orders;
use crate::fit::Record;
use crate::model::{Channel, Input, Model};

/// Bins of one turn: 20 per period of the highest order.
const BINS: usize = 8192;
/// Highest order of torques, of the encoder.
pub const HIGHEST: usize = 400;
const HIGHEST_OF_ENCODER: usize = 8;
/// How many orders of each kind are looked at exactly.
const COGGING: usize = 5;
const RIPPLE: usize = 4;
const ECCENTRICITY: usize = 2;
/// Classes of the rate's size over which the response is averaged.
const CLASSES: usize = 64;

/// The most promising orders that the model does not have yet.
pub fn promising(model: &Model, record: &Record, residuals: &[&[f64]], weights: &[f64]) -> Orders {
    let Some(theta) = record.theta.or((record.driven == Input::Motion).then_some(record.input)) else { return Orders::default() };
    let has = |id: &str, stem: &str| -> Vec<u32> {
        let uses = model.effects().iter().filter(|e| e.card.id == id);
        let orders = uses.flat_map(|e| &e.parameters).map(|&k| &model.parameters()[k]).filter(|p| p.name.starts_with(stem));
        orders.map(|p| p.value as u32).collect()
    };
    let response = Response::of(model, record);
    let (torque, direct) = gradients(record, residuals, weights, &response);
    let current = record.channels.iter().find(|c| c.shows == Channel::Current).map(|c| c.measured).or(record.current);
    let rate = rates(record, theta);
    // Order one of a torque is a mass off the axis.
    let mut taken = has("cogging", "cogging_order");
    taken.push(1);
    let power = response.powers(&rate, record, weights, |_| 1.0);
    let cogging = best(&spectrum(theta, |k| torque[k]), &power, &taken, HIGHEST, COGGING);
    let ripple = match (current, model.value("motor_constant_N_m_A")) {
        (Some(i), Some(constant)) => {
            let braking = if record.driven == Input::Voltage { constant / response.resistance } else { 0.0 };
            let amplitude = |k: usize| constant * (i[k] - braking * rate[k]);
            let power = response.powers(&rate, record, weights, |k| amplitude(k).powi(2));
            let score = spectrum(theta, |k| torque[k] * amplitude(k) - direct[k] * braking * rate[k]);
            best(&score, &power, &has("torque-ripple", "ripple_order"), HIGHEST, RIPPLE)
        }
        _ => Vec::new(),
    };
    let eccentricity = match record.channels.iter().position(|c| c.shows == Channel::Angle) {
        Some(c) => {
            // An increment sees the difference of the encoder's error at its two ends.
            let lag = record.angle_lag();
            let mut gradient = vec![0.0; record.len()];
            for (k, r) in residuals[c].iter().enumerate().filter(|(k, r)| r.is_finite() && !record.held_out(*k)) {
                gradient[k] += weights[c] * r;
                gradient[k - lag.min(k)] -= weights[c] * r;
            }
            best(
                &spectrum(theta, |k| gradient[k]),
                &vec![1.0; HIGHEST + 1],
                &has("encoder-eccentricity", "eccentricity_order"),
                HIGHEST_OF_ENCODER,
                ECCENTRICITY,
            )
        }
        None => Vec::new(),
    };
    Orders { cogging, ripple, eccentricity }
}

/// The model's answer to a torque, as a first-order decay.
struct Response {
    /// Decay over a row, and rate gained per torque.
    decay: f64,
    gain: f64,
    /// Current shown per rate.
    current_per_rate: f64,
    /// What a prescribed motion shows of a torque.
    demanded: f64,
    resistance: f64,
}

impl Response {
    fn of(model: &Model, record: &Record) -> Self {
        let value = |name: &str| model.value(name).unwrap_or(0.0);
        let inertia = value("inertia_kg_m2");
        let (constant, resistance) = (value("motor_constant_N_m_A"), value("resistance_ohm").max(1e-9));
        let braking = if record.driven == Input::Voltage { constant * constant / resistance } else { 0.0 };
        let damping = braking + value("viscous_N_m_s").max(0.0);
        let h = record.dt_s;
        let x = if inertia > 0.0 { damping / inertia * h } else { 0.0 };
        let decay = (-x).exp();
        let gain = if inertia <= 0.0 { 0.0 } else if x > 1e-9 { (1.0 - decay) / damping } else { h / inertia };
        let current_per_rate = if record.driven == Input::Voltage { -constant / resistance } else { 0.0 };
        let demanded = if record.driven == Input::Motion { if constant > 0.0 { -1.0 / constant } else { -1.0 } } else { 0.0 };
        Response { decay, gain, current_per_rate, demanded, resistance }
    }

    /// Mean square of what a unit torque at each order shows, weighted; the square of its amplitude at row k is `size(k)`.
    fn powers(&self, rate: &[f64], record: &Record, weights: &[f64], size: impl Fn(usize) -> f64) -> Vec<f64> {
        let largest = rate.iter().fold(0.0_f64, |m, w| m.max(w.abs())).max(1e-9);
        let mut classes = [0.0; CLASSES];
        for (k, w) in rate.iter().enumerate() {
            classes[((w.abs() / largest * CLASSES as f64) as usize).min(CLASSES - 1)] += size(k);
        }
        let lag = record.angle_lag() as f64;
        (0..=HIGHEST)
            .map(|order| {
                let mut power = 0.0;
                for (class, count) in classes.iter().enumerate() {
                    let phase = order as f64 * largest * (class as f64 + 0.5) / CLASSES as f64 * record.dt_s;
                    let (s, c) = phase.sin_cos();
                    let rate2 = self.gain * self.gain / ((c - self.decay).powi(2) + s * s).max(1e-12);
                    for (channel, weight) in record.channels.iter().zip(weights) {
                        power += weight
                            * count
                            * match channel.shows {
                                Channel::Rate => rate2,
                                Channel::Current => rate2 * self.current_per_rate.powi(2) + self.demanded.powi(2),
                                Channel::Torque => self.demanded.powi(2),
                                Channel::Angle => {
                                    let half = 0.5 * phase;
                                    let sum = if half.abs() < 1e-9 { lag } else { (lag * half).sin() / half.sin() };
                                    rate2 * (record.dt_s * sum).powi(2)
                                }
                                Channel::Voltage => 0.0,
                            };
                    }
                }
                power.max(1e-300)
            })
            .collect()
    }
}

/// Gradient of the misfit by the torque at each row, and by a current at each row that shows at once.
fn gradients(record: &Record, residuals: &[&[f64]], weights: &[f64], response: &Response) -> (Vec<f64>, Vec<f64>) {
    let mut torque = vec![0.0; record.len()];
    let mut direct = vec![0.0; record.len()];
    let lag = record.angle_lag();
    for rows in &record.segments {
        let mut pull = 0.0;
        // Sum of the increments that still contain this row's angle.
        let mut increments = 0.0;
        for k in rows.clone().rev() {
            torque[k] = response.gain * pull;
            let mut now = 0.0;
            for (c, channel) in record.channels.iter().enumerate() {
                let at = |row: usize| residuals[c].get(row).copied().filter(|r| r.is_finite() && !record.held_out(row)).unwrap_or(0.0) * weights[c];
                match channel.shows {
                    Channel::Rate => now += at(k),
                    Channel::Current => {
                        now += at(k) * response.current_per_rate;
                        direct[k] = at(k);
                        torque[k] += at(k) * response.demanded;
                    }
                    Channel::Torque => torque[k] += at(k) * response.demanded,
                    Channel::Angle => {
                        now += increments * record.dt_s;
                        increments += at(k);
                        if k + lag < rows.end {
                            increments -= at(k + lag);
                        }
                    }
                    Channel::Voltage => {}
                }
            }
            pull = now + response.decay * pull;
        }
    }
    (torque, direct)
}

/// Rate of each row, from the angle over 20 ms.
fn rates(record: &Record, theta: &[f64]) -> Vec<f64> {
    let lag = record.angle_lag();
    let last = record.len() - 1;
    (0..=last)
        .map(|k| {
            let (a, b) = (k.saturating_sub(lag / 2), (k + lag.div_ceil(2)).min(last));
            let dt = record.t_s[b] - record.t_s[a];
            if dt > 0.0 { (theta[b] - theta[a]) / dt } else { 0.0 }
        })
        .collect()
}

/// |Σ g e^{inθ}|² for every order n.
fn spectrum(theta: &[f64], gradient: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut bins = vec![0.0; BINS];
    for (k, angle) in theta.iter().enumerate() {
        let bin = (angle.rem_euclid(TAU) / TAU * BINS as f64) as usize;
        bins[bin.min(BINS - 1)] += gradient(k);
    }
    let transform = RealFftPlanner::<f64>::new().plan_fft_forward(BINS);
    let mut out = transform.make_output_vec();
    if transform.process(&mut bins, &mut out).is_err() {
        return vec![0.0; HIGHEST + 1];
    }
    out.iter().take(HIGHEST + 1).map(|z| z.norm_sqr()).collect()
}

/// The `count` orders from 1 to `highest` with the largest score, but for those `taken`.
fn best(score: &[f64], power: &[f64], taken: &[u32], highest: usize, count: usize) -> Vec<u32> {
    let mut orders: Vec<usize> = (1..=highest.min(score.len() - 1)).filter(|n| !taken.contains(&(*n as u32))).collect();
    orders.sort_by(|a, b| (score[*b] / power[*b]).total_cmp(&(score[*a] / power[*a])));
    orders.into_iter().take(count).map(|n| n as u32).collect()
}
