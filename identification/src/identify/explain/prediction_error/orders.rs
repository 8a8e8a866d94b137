//! Harmonic orders that are worth an exact screening, by the gradient of the likelihood over the angle.
//!
//! A torque a e^{inθ} has the score |Σ gₖ e^{inθₖ}|², with the gradient g of ln L by a torque in each row. Sums in bins of the angle and one Fourier
//! transform give all orders at once. The variance of the score under noise is taken from the neighbouring orders.

use drive_model::{HarmonicSource, Screening};

use super::model::PredictedModel;
use crate::identify::explain::harmonics::HarmonicOrders;
use crate::identify::explain::motion::{angle, measured_current};
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

/// The best orders of each source that the model does not have yet.
pub fn search_orders(base: &PredictedModel, gradient: &Gradient) -> HarmonicOrders {
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
    let k = model.base(BaseParameter::MotorConstant);
    let resistance = model.base(BaseParameter::Resistance).unwrap_or(0.0);
    let motor_constant = match (k, measured_current(data)) {
        (Some(k), Some(current)) => {
            let lag = data.angle_lag();
            let rate = |row: usize| {
                let (a, b) = (row.saturating_sub(lag / 2), (row + lag.div_ceil(2)).min(theta.len() - 1));
                (theta[b] - theta[a]) / (data.t_s[b] - data.t_s[a]).max(1e-12)
            };
            // The back-EMF acts as a voltage: as the torque K v/R, and as the current v/R.
            let by_voltage = |row: usize| {
                if data.driven != Input::Voltage || resistance <= 0.0 {
                    return 0.0;
                }
                (k * gradient.torque[row] + channel(Channel::Current).map_or(0.0, |c| gradient.readings[c][row])) / resistance
            };
            let value = |row: usize| k * (current[row] * gradient.torque[row] - rate(row) * by_voltage(row));
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
    HarmonicOrders::new(torque_orders, motor_constant, encoder)
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
    let level = |k: usize| {
        let (from, to) = (k.saturating_sub(NEIGHBOURS).max(1), (k + NEIGHBOURS + 1).min(power.len()));
        median((from..to).filter(|j| *j != k).map(|j| power[j])).unwrap_or(0.0).max(f64::MIN_POSITIVE)
    };
    let mut orders: Vec<(usize, f64)> = (1..power.len()).filter(|n| !taken.contains(&(*n as u32))).map(|n| (n, power[n] / level(n))).collect();
    orders.sort_by(|a, b| b.1.total_cmp(&a.1));
    orders.into_iter().take(count).map(|(n, _)| n as u32).collect()
}
