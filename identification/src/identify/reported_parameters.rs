//! The parameters of a free run with the standard errors that are reported: by prediction errors where the log may be from a loop, and with the uncertainty by the
//! unknown course of the voltage within the rows.

use super::fit::{FitResult, PreparedLog, System, add_course_uncertainty};
use super::predict::{by_prediction_errors, needs_prediction_errors};
use crate::log::Log;

/// Replaces the result of a free run by the parameters and standard errors that are reported; returns whether the parameters are by prediction errors.
pub fn reported(system: &System, log: &Log, data: &PreparedLog, result: &mut FitResult) -> bool {
    let by_innovations = if needs_prediction_errors(log, data, result) { by_prediction_errors(system, data, result) } else { None };
    let is_by_innovations = by_innovations.is_some();
    let free_run = result.clone();
    if let Some(found) = by_innovations {
        *result = found;
    }
    add_course_uncertainty(system, log, data, &free_run, result);
    is_by_innovations
}
