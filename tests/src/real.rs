//! External records of real drives (`STAND_DATA`) and the quantities compared with publications.

use identification::recording;
use std::path::Path;

use drive_rig::DriveState;
use identification::identify::fit::{self, FitError, FitResult};
use identification::log::Log;
use identification::model::Model;

/// The record of that name. `also` names additional columns to read.
///
/// # Panics
/// The record cannot be read.
pub fn record(data: &Path, name: &str, also: &[&str]) -> Log {
    Log::read_also(data.join(name), also).expect("the record is readable")
}

/// The log with one more note.
///
/// # Panics
/// Never: the columns are those of a log.
pub fn noted(log: &Log, key: &str, value: &str) -> Log {
    let mut notes = log.notes().to_vec();
    notes.push((key.to_owned(), value.to_owned()));
    Log::new(log.path(), log.columns().to_vec(), notes).expect("the columns are those of a log")
}

/// `model` with the fitted values.
///
/// # Panics
/// A name is not a parameter of the model.
pub fn with_values(model: &Model, parameters: &fit::Parameters) -> Model {
    let mut fitted = model.clone();
    fitted.set_all(parameters.list.iter().map(|p| (p.name.as_str(), p.value))).expect("the names are parameters of the model");
    fitted
}

/// Root mean square of measured minus modelled position over all of `log`, in the angle's unit: a free run from the measured first angle at
/// the initial rate that fits best. (`stand` itself compares increments over 20 ms.)
///
/// # Errors
/// The model cannot be simulated.
///
/// # Panics
/// The log lacks a column.
pub fn position_rms(log: &Log, model: &Model) -> Result<f64, FitError> {
    let (prepared, _) = recording::prepare(log, model, false).expect("the log has the columns of the model");
    let (system, parameters) = fit::build::system(model, prepared.temp_C.is_some());
    let comparison: FitResult = fit::compare(&system, &parameters, &prepared)?;
    let rig = system.rig::<f64>(&parameters, prepared.driven);
    let theta = prepared.theta.expect("the log has an angle");
    let (mut sum, mut n) = (0.0, 0usize);
    for (rows, start) in prepared.segments.iter().zip(&comparison.initial_states.values) {
        let mut state = DriveState::turning(start[0], theta[rows.start]);
        for row in rows.clone() {
            sum += (theta[row] - state.theta).powi(2);
            n += 1;
            rig.advance(&mut state, &prepared.row_input(row, rows.end));
        }
    }
    Ok((sum / n as f64).sqrt())
}

/// Largest correlation of `function(θ + shift)` with `map`, the values at the angles `theta_rad`, for shifts of at most ± `reach_rad`; and
/// that shift, rad. Means are removed.
pub fn correlation_with_map(function: impl Fn(f64) -> f64, theta_rad: &[f64], map: &[f64], reach_rad: f64) -> (f64, f64) {
    // Shifts tried on each side of zero.
    let steps = 64;
    (-steps..=steps)
        .map(|k| {
            let shift = reach_rad * f64::from(k) / f64::from(steps);
            let shifted: Vec<f64> = theta_rad.iter().map(|&t| function(t + shift)).collect();
            (correlation(&shifted, map), shift)
        })
        .fold((f64::NEG_INFINITY, 0.0), |best, one| if one.0 > best.0 { one } else { best })
}

/// Pearson's correlation coefficient.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        ab += (a - ma) * (b - mb);
        aa += (a - ma).powi(2);
        bb += (b - mb).powi(2);
    }
    ab / (aa * bb).sqrt()
}
