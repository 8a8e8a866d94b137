//! The work on observers: the free sensitive element of a gyrotheodolite under a constant moment, drawn by seed.
//!
//! The log has the angle of the element alone. An astatic observer identifies the moment M; a static one has the steady error (E − Φ + K
//! C)⁻¹ Γ M in its exact discrete form, which the firmware and `stand observer track` run at the interval of the rows. The parameters of
//! the element are exact; the gain of the angle sensor is not, and every quantity is inversely proportional to it.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{DMatrix, DVector};

use super::LabError;
use super::course::ObserversTask;
use super::draw::Draw;
use identification::log::{Column, Log, Note, Notes};
use identification::statistics::uncertainty::{Contribution, Estimate, Quantity};
use stand_analysis::observer::moment::Moment;
use stand_analysis::observer::recorded::{ANGLE_GAIN_V_RAD, BLOCK_TIME_CONSTANTS, RecordError, Tracked, block_mean, free_log};
use stand_analysis::observer::{Design, Disturbance, Kind, ObserverError, Plant, Poles, Request};

/// Ranges of the true values: the angle stays within two thirds of the range of the sensor, ± 33 mrad.
const MOMENT_N_M: (f64, f64) = (3e-6, 8e-6);
const ANGLE_RAD: (f64, f64) = (2e-4, 1e-3);
/// Interval of the rows, s.
const STEP_S: f64 = 1e-3;
/// Columns that a student gets.
const COLUMNS: [&str; 2] = ["t_s", "angle_sensor_V"];
/// Steady errors of static observers: quantity, state, pole of the task.
const STATIC_ERRORS: [(&str, usize, usize); 3] =
    [("static_angle_error_slow_rad", 0, 1), ("static_rate_error_slow_rad_s", 1, 1), ("static_rate_error_fast_rad_s", 1, 2)];

/// The disturbance of this seed, and the gain of the angle sensor by its certificate, V/rad.
fn drawn(task: &ObserversTask, seed: u64) -> (Disturbance, f64) {
    let mut draw = Draw::new(seed);
    let moment = Moment::constant(draw.signed(MOMENT_N_M));
    let angle_rad = draw.signed(ANGLE_RAD);
    (Disturbance { angle_rad, moment }, ANGLE_GAIN_V_RAD * draw.factor(task.angle_gain_percent))
}

/// The observer of a kind with all poles at −`omega_1_s`.
fn design(task: &ObserversTask, kind: Kind, omega_1_s: f64) -> Result<Design, ObserverError> {
    let plant = Plant::named(&task.element)?;
    Request { plant, poles: Poles::Binomial(omega_1_s), kind, step_s: Some(STEP_S), vibration_Hz: None }.design()
}

/// True values by the names of the quantities.
///
/// # Errors
/// The definition of the work is wrong.
pub(super) fn truth(task: &ObserversTask, seed: u64) -> Result<BTreeMap<String, f64>, LabError> {
    let moment_N_m = drawn(task, seed).0.moment.constant_N_m;
    let mut values = BTreeMap::from([("moment_N_m".to_owned(), moment_N_m)]);
    for (name, state, pole) in STATIC_ERRORS {
        let unit = steady_error(&design(task, Kind::Static, task.poles_1_s[pole])?).and_then(|errors| errors.get(state).copied());
        // The error of the estimate is estimate minus truth.
        values.insert(name.to_owned(), unit.map_or(f64::NAN, |unit| -unit * moment_N_m));
    }
    Ok(values)
}

/// Steady error, truth minus estimate, of a static observer per moment: e = (Φ − K C) e + Γ.
fn steady_error(design: &Design) -> Option<Vec<f64>> {
    let discrete = design.discrete.as_ref()?;
    let n = discrete.gains.len();
    let identity = |i: usize, j: usize| f64::from(u8::from(i == j));
    let gain = |i: usize, j: usize| if j == 0 { discrete.gains[i] } else { 0.0 };
    let matrix = DMatrix::from_fn(n, n, |i, j| identity(i, j) - discrete.phi[i][j] + gain(i, j));
    matrix.lu().solve(&DVector::from_column_slice(&discrete.gamma)).map(|errors| errors.as_slice().to_vec())
}

/// The log, named `path`: the angle of the element, without its true states and moment.
///
/// # Errors
/// The element cannot be simulated.
pub(super) fn record(task: &ObserversTask, (device, noise): (u64, u64), path: &Path) -> Result<Log, LabError> {
    let (disturbance, stated_gain_V_rad) = drawn(task, device);
    let log = free_log(&Plant::named(&task.element)?, disturbance, task.seconds, STEP_S, noise, path).map_err(|error| match error {
        RecordError::Log(error) => LabError::from(error),
        error @ RecordError::OutOfRange { .. } => LabError::Argument(error.to_string()),
    })?;
    let columns: Vec<Column> = log.columns().iter().filter(|column| COLUMNS.contains(&column.name.as_str())).cloned().collect();
    Ok(Log::new(path, columns, Notes::from_iter([Note::Number("angle_gain_V_rad", stated_gain_V_rad)]))?)
}

/// Value and expanded uncertainty by the reference procedure: the learnt moment, and the difference of a static and an astatic observer
/// with equal poles.
///
/// # Errors
/// The log cannot be tracked.
pub(super) fn reference(task: &ObserversTask, log: &Log) -> Result<BTreeMap<String, (f64, f64)>, LabError> {
    let track =
        |kind: Kind, pole: usize| -> Result<Tracked, LabError> { Ok(design(task, kind, task.poles_1_s[pole])?.track(log, None, None)?) };
    let mut estimates = Vec::new();
    if let Some(moment) = track(Kind::Augmented, 0)?.mean_moment_N_m {
        estimates.push(("moment_N_m", moment));
    }
    for (name, state, pole) in STATIC_ERRORS {
        let [fixed, astatic] = [track(Kind::Static, pole)?, track(Kind::Augmented, pole)?];
        let from = astatic.t_s.iter().position(|t| *t >= astatic.settled_s).unwrap_or(0);
        let estimated = |tracked: &Tracked| tracked.states[state].estimated[from..].to_vec();
        let errors: Vec<f64> = estimated(&fixed).iter().zip(estimated(&astatic)).map(|(fixed, astatic)| fixed - astatic).collect();
        estimates.push((name, block_mean(&errors, BLOCK_TIME_CONSTANTS / (task.poles_1_s[pole] * STEP_S))));
    }
    let judged = |(name, estimate): (&str, Estimate)| {
        let uncertainty = estimate.uncertainty?;
        let scatter = Contribution::type_a("scatter", uncertainty.u, uncertainty.dof, ());
        let gain = Contribution::rectangular("angle gain", task.angle_gain_percent / 100.0, "1", estimate.value, ());
        let quantity: Quantity<(), ()> = Quantity::new(name, "", estimate.value, vec![scatter, gain]);
        Some((name.to_owned(), (estimate.value, quantity.expanded_u())))
    };
    Ok(estimates.into_iter().filter_map(judged).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn task() -> ObserversTask {
        ObserversTask {
            element: "astatic-identifier-recovered".to_owned(),
            seconds: 30.0,
            poles_1_s: [5.0, 10.0, 20.0],
            angle_gain_percent: 1.0,
            quantities: Vec::new(),
        }
    }

    /// The log has neither the moment nor the states that an observer estimates.
    #[test]
    fn log_has_no_true_state() {
        let log = record(&task(), (1, 2), Path::new("element.parquet")).expect("a log");
        assert_eq!(log.columns().iter().map(|column| column.name.as_str()).collect::<Vec<_>>(), COLUMNS);
    }

    /// The steady error of the equations is that of the observer on a log whose truth is known: 8 µN m, poles at −10 1/s.
    #[test]
    fn steady_error_is_that_of_the_running_observer() {
        let task = task();
        let observer = design(&task, Kind::Static, 10.0).expect("a design");
        let unit = steady_error(&observer).expect("a solution");
        let moment = Moment::constant(8e-6);
        let plant = Plant::named(&task.element).expect("the element");
        let log = free_log(&plant, Disturbance { angle_rad: 1e-3, moment }, 30.0, STEP_S, 1, Path::new("x.parquet")).expect("a log");
        let tracked = observer.track(&log, None, None).expect("tracked");
        let rate = &tracked.states[1];
        let truth = rate.against_truth.expect("the truth").0;
        assert!(((rate.mean - truth) / (-8e-6 * unit[1]) - 1.0).abs() < 0.01, "{} {truth} {unit:?}", rate.mean);
    }
}
