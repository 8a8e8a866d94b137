//! Uncertainty of the parameters by the unknown course of the voltage within the rows.
//!
//! A log has the mean and the first moment of the voltage of each row. Its course is an assumption ([`super::voltage`]); where the voltage jumps within rows, as
//! in a speed loop with a shaft, the inductance above all depends on it. The parameters are fitted by a second course that the log does not exclude, of a
//! random walk with the same variance in all rows. Each parameter may be as far from its value as that of the other course, on either side: a
//! rectangular distribution (JCGM 100:2008, 4.3.7), the same for all parameters at once.

use super::voltage::{WalkVariance, voltage_course_V};
use super::{FitResult, PreparedLog, System, refit_from};
use crate::log::Log;

/// Adds this uncertainty to `result`, the parameters that are reported. `free_run` is the fit by the expected course. Nothing changes where the log has no moments of the
/// voltage, or the other course cannot be fitted.
pub fn add_course_uncertainty(system: &System, log: &Log, data: &PreparedLog, free_run: &FitResult, result: &mut FitResult) {
    if data.voltage_course_V.is_none() || data.input_at_t || !free_run.converged || data.deadline.has_passed() {
        return;
    }
    let mut uniform = data.clone();
    uniform.voltage_course_V = voltage_course_V(log, data.driven, false, &data.segments, WalkVariance::Uniform);
    if uniform.voltage_course_V == data.voltage_course_V {
        return;
    }
    let Ok(other) = refit_from(system, &uniform, free_run) else { return };
    if !other.converged {
        return;
    }
    let difference =
        |k: usize| if result.sigmas[k] > 0.0 { other.parameters.list[k].value - free_run.parameters.list[k].value } else { 0.0 };
    let differences: Vec<f64> = (0..result.sigmas.len()).map(difference).collect();
    for (i, di) in differences.iter().enumerate() {
        for (j, dj) in differences.iter().enumerate() {
            result.covariance[(i, j)] += di * dj / 3.0;
        }
        result.sigmas[i] = result.sigmas[i].hypot(di / 3.0_f64.sqrt());
    }
}
