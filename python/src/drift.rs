//! `drift`: drift of a gyroscope by pulses of alternating sign, and bias and scale of a rate gyro on the turning platform.

use pyo3::prelude::*;
use stand_analysis::drift::compute::{DriftSettings, measurement};
use stand_analysis::drift::measurement::SetupUncertainties;
use stand_analysis::drift::platform;
use stand_report::drift as report;

use crate::answer::Answer;
use crate::error::analysis_error;
use crate::log::Log;
use crate::noise::units;
use crate::task;

/// Scales of the setup, a dict in Python; a missing one is taken from the notes of the log.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Scales {
    angle_gain_V_rad: Option<f64>,
    torquer_gain_rad_s_A: Option<f64>,
    pulse_s: Option<f64>,
    angle_limit_V: Option<f64>,
    latitude_deg: Option<f64>,
}

/// Standard uncertainties in SI units, a dict in Python; a missing one has the default of the library.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Uncertainties {
    turn_error_rad: Option<f64>,
    level_error_rad: Option<f64>,
    gain_error: Option<f64>,
    torquer_gain_error: Option<f64>,
    latitude_error_rad: Option<f64>,
    torquer_asymmetry: Option<f64>,
}

/// Drift from logs with `angle_sensor_V` and `torquer_A`; several form one measurement.
#[pyfunction]
pub fn drift(
    py: Python<'_>,
    logs: Vec<PyRef<'_, Log>>,
    scales: Scales,
    uncertainties: Uncertainties,
    units_of_answer: Option<&str>,
) -> PyResult<Answer> {
    let Scales { angle_gain_V_rad, torquer_gain_rad_s_A, pulse_s, angle_limit_V, latitude_deg } = scales;
    let usual = SetupUncertainties::default();
    let uncertainties = SetupUncertainties {
        turn_error_rad: uncertainties.turn_error_rad.unwrap_or(usual.turn_error_rad),
        level_error_rad: uncertainties.level_error_rad.unwrap_or(usual.level_error_rad),
        gain_error: uncertainties.gain_error.unwrap_or(usual.gain_error),
        torquer_gain_error: uncertainties.torquer_gain_error.unwrap_or(usual.torquer_gain_error),
        latitude_error_rad: uncertainties.latitude_error_rad.unwrap_or(usual.latitude_error_rad),
        torquer_asymmetry: uncertainties.torquer_asymmetry.unwrap_or(usual.torquer_asymmetry),
    };
    let settings = DriftSettings { angle_gain_V_rad, torquer_gain_rad_s_A, pulse_s, angle_limit_V, latitude_deg, uncertainties };
    let units = units(units_of_answer)?;
    let logs: Vec<_> = logs.iter().map(|log| identification::log::Log::clone(&log.shared())).collect();
    task::run(py, None, move |_| {
        let failed = |error| analysis_error(report::error_text(&error));
        let result = measurement(&logs, &settings).map_err(failed)?.evaluate().map_err(failed)?;
        Ok(Answer::new(&report::json(&result, units), report::text(&result, units), report::html(&result, units)))
    })
}

/// Bias and scale of a rate gyro from a log with `theta_rad` and `gyro_rad_s`, the platform turning to and fro.
#[pyfunction]
pub fn drift_platform(
    py: Python<'_>,
    log: &Log,
    pulse_s: Option<f64>,
    latitude_deg: Option<f64>,
    units_of_answer: Option<&str>,
) -> PyResult<Answer> {
    let units = units(units_of_answer)?;
    let log = log.shared();
    task::run(py, None, move |_| {
        let result = platform::of_log(&log, platform::PlatformSettings { pulse_s, latitude_deg });
        let result = result.map_err(|error| analysis_error(report::error_text(&error)))?;
        let name = log.path().display().to_string();
        let html = report::platform_html(&name, &result, units);
        Ok(Answer::new(&report::platform_json(&name, &result, units), report::platform_text(&name, &result, units), html))
    })
}
