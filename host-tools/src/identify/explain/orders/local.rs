//! The torque that rows lack by themselves, by order: J Ω′ − K i less friction, from what was measured alone.
//!
//! No simulation takes part, so a model that is far off does not spoil it; differences over some milliseconds make it noisy instead.

use crate::identify::fit::PreparedLog;
use crate::identify::residual::harmonics::spectrum;
use crate::model::{Channel, Input, Model};
use crate::statistics::least_squares;

/// Rows before and behind, over which the rate's change is taken.
const REACH: usize = 10;

/// Power by order, from 0 to `highest`; nothing where current, voltage or angle are not there.
pub(super) fn torque_by_order(model: &Model, record: &PreparedLog, theta: &[f64], highest: usize) -> Vec<f64> {
    let (Some(j), Some(k)) = (model.value("inertia_kg_m2"), model.value("motor_constant_N_m_A")) else { return Vec::new() };
    let measured = |shows: Channel| record.channels.iter().find(|c| c.channel == shows).map(|c| c.measured);
    let current = measured(Channel::Current).or(record.current);
    let resistance = model.value("resistance_ohm").unwrap_or(0.0);
    if record.driven == Input::Motion || (current.is_none() && !(record.driven == Input::Voltage && resistance > 0.0)) {
        return Vec::new();
    }
    let (mut rates, mut angles, mut torques) = (Vec::new(), Vec::new(), Vec::new());
    for segment in &record.segments {
        for row in segment.start + REACH..segment.end.saturating_sub(REACH) {
            let rate_over = |a: usize, b: usize| (theta[b] - theta[a]) / (record.t_s[b] - record.t_s[a]).max(1e-12);
            let (before, behind) = (rate_over(row - REACH, row), rate_over(row, row + REACH));
            let rate = 0.5 * (before + behind);
            // Both rates are means: half the stretch apart.
            let apart_s = 0.5 * (record.t_s[row + REACH] - record.t_s[row - REACH]);
            let drive = match current {
                Some(i) => i[row - REACH..row + REACH].iter().sum::<f64>() / (2 * REACH) as f64,
                None => (record.input[row] - k * rate) / resistance,
            };
            rates.push(rate);
            angles.push(theta[row]);
            torques.push(j * (behind - before) / apart_s - k * drive);
        }
    }
    // Friction, and what is the same everywhere, are none of the angle's.
    let step = (rates.len() / 5000).max(1);
    let rows: Vec<Vec<f64>> = rates.iter().step_by(step).map(|rate| vec![rate.signum(), *rate, 1.0]).collect();
    let y: Vec<f64> = torques.iter().step_by(step).copied().collect();
    let Some(fit) = least_squares(&rows, &y) else { return Vec::new() };
    let c = &fit.coefficients;
    let left: Vec<f64> = torques.iter().zip(&rates).map(|(torque, rate)| torque - c[0] * rate.signum() - c[1] * rate - c[2]).collect();
    // What passes by within a stretch is averaged away: rows that are fast say little.
    let length_s = 2.0 * REACH as f64 * record.dt_s;
    let slow = |row: usize| 1.0 / (1.0 + (rates[row] * length_s * 3.0).powi(2));
    let found = spectrum(&angles, &left, slow, highest);
    std::iter::once(0.0).chain(found.amplitude.iter().map(|a| a * a)).collect()
}
