//! Torque that the rows lack by themselves, by harmonic order: J Ω′ − K i minus friction, from measured columns only.
//!
//! Nothing is simulated, so that a model that is far off does no harm. Differences over some milliseconds make the torque noisy instead.

use crate::identify::explain::criteria::HarmonicCriteria;
use crate::identify::explain::fitted::motion::measured_current;
use crate::identify::residual::harmonics::spectrum;
use crate::model::{BaseParameter, Input, Model};
use crate::recording::PreparedLog;
use crate::statistics::least_squares;

/// Power by order, from 0 to `highest`; empty where current, voltage or angle are missing.
pub(super) fn power_by_order(model: &Model, data: &PreparedLog, theta: &[f64], highest: usize, criteria: &HarmonicCriteria) -> Vec<f64> {
    let (Some(j), Some(k)) = (model.base(BaseParameter::Inertia), model.base(BaseParameter::MotorConstant)) else { return Vec::new() };
    let current = measured_current(data);
    let resistance = model.base(BaseParameter::Resistance).unwrap_or(0.0);
    if data.driven == Input::Motion || (current.is_none() && !(data.driven == Input::Voltage && resistance > 0.0)) {
        return Vec::new();
    }
    let reach = criteria.local_torque_rows;
    let (mut rates, mut angles, mut torques) = (Vec::new(), Vec::new(), Vec::new());
    for segment in &data.segments {
        for row in segment.start + reach..segment.end.saturating_sub(reach) {
            let rate_over = |a: usize, b: usize| (theta[b] - theta[a]) / (data.t_s[b] - data.t_s[a]).max(1e-12);
            let (before, after) = (rate_over(row - reach, row), rate_over(row, row + reach));
            let rate = 0.5 * (before + after);
            // Both rates are means: their times are half of the interval apart.
            let between_s = 0.5 * (data.t_s[row + reach] - data.t_s[row - reach]);
            let current_A = match current {
                Some(i) => i[row - reach..row + reach].iter().sum::<f64>() / (2 * reach) as f64,
                None => (data.input[row] - k * rate) / resistance,
            };
            rates.push(rate);
            angles.push(theta[row]);
            torques.push(j * (after - before) / between_s - k * current_A);
        }
    }
    // Friction and a constant torque do not depend on the angle.
    let step = (rates.len() / criteria.local_friction_rows).max(1);
    let rows: Vec<Vec<f64>> = rates.iter().step_by(step).map(|rate| vec![rate.signum(), *rate, 1.0]).collect();
    let y: Vec<f64> = torques.iter().step_by(step).copied().collect();
    let Some(fit) = least_squares(&rows, &y) else { return Vec::new() };
    let c = &fit.coefficients;
    let left: Vec<f64> = torques.iter().zip(&rates).map(|(torque, rate)| torque - c[0] * rate.signum() - c[1] * rate - c[2]).collect();
    // Within the interval of a fast row the periodic torque averages out.
    let length_s = 2.0 * reach as f64 * data.dt_s;
    let weight = |row: usize| 1.0 / (1.0 + (rates[row] * length_s * criteria.local_blur_per_rad).powi(2));
    let found = spectrum(&angles, &left, weight, highest);
    std::iter::once(0.0).chain(found.amplitude.iter().map(|a| a * a)).collect()
}
