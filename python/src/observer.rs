//! `observer`: design of state observers of a gyrotheodolite, their frequency responses, and an observer run over a log.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_analysis::observer::recorded::row_interval_s;
use stand_analysis::observer::{Bode, Kind, Plant, Poles, Request};
use stand_report::observer as report;

use crate::answer::Answer;
use crate::error::{analysis_error, log_error};
use crate::log::Log;
use crate::task;

/// What is asked of an observer: all poles at −ω (1/s) or a list of poles, kind, row and gain of the integral channel, highest vibration
/// frequency (Hz).
type Design = (Option<f64>, Option<String>, Option<String>, Option<usize>, Option<f64>, Option<f64>);

fn kind_of(word: &str) -> PyResult<Kind> {
    Kind::named(word).ok_or_else(|| PyValueError::new_err(format!("kind {word:?}: must be \"static\", \"integral\" or \"augmented\"")))
}

fn frequency(vibration_Hz: Option<f64>) -> PyResult<Option<f64>> {
    match vibration_Hz.filter(|f| !(f.is_finite() && *f > 0.0)) {
        Some(f) => Err(PyValueError::new_err(format!("vibration_Hz {f}: must be above 0"))),
        None => Ok(vibration_Hz),
    }
}

fn request(element: &str, usual: Option<Kind>, step_s: Option<f64>, design: Design) -> PyResult<Request> {
    let (omega_1_s, poles, kind, row, gain, vibration_Hz) = design;
    let plant = Plant::named(element).map_err(analysis_error)?;
    let poles = poles.map(|list| Poles::parse(&list)).transpose().map_err(analysis_error)?;
    let poles = poles.unwrap_or_else(|| Poles::Binomial(omega_1_s.unwrap_or(plant.default_omega_1_s())));
    let kind = match kind {
        Some(word) => kind_of(&word)?,
        None => usual.unwrap_or(Kind::usual(&plant)),
    };
    let with_integral = kind.with_integral(row, gain);
    let kind = with_integral
        .ok_or_else(|| PyValueError::new_err(format!("row and integral_gain apply to kind=\"integral\", not to {}", kind.name())))?;
    Ok(Request { plant, poles, kind, step_s, vibration_Hz: frequency(vibration_Hz)? })
}

/// Gains of an observer.
#[pyfunction]
pub fn observer_design(py: Python<'_>, element: &str, step_s: f64, design: Design) -> PyResult<Answer> {
    let request = request(element, None, Some(step_s), design)?;
    task::run(py, None, move |_| {
        let design = request.design().map_err(analysis_error)?;
        Ok(Answer::new(&report::design_json(&design), report::design_text(&design), report::design_html(&design)))
    })
}

/// Frequency responses of the element and of observers.
#[pyfunction]
pub fn observer_bode(py: Python<'_>, element: &str, kind: &str, omega_1_s: Vec<f64>, vibration_Hz: Option<f64>) -> PyResult<Answer> {
    let (plant, kind) = (Plant::named(element).map_err(analysis_error)?, kind_of(kind)?);
    let vibration_Hz = frequency(vibration_Hz)?;
    task::run(py, None, move |_| {
        let omegas = if omega_1_s.is_empty() { Bode::default_omegas_1_s(&plant) } else { omega_1_s };
        let bodes = Bode::of(&plant, kind, &omegas).map_err(analysis_error)?;
        let html = report::bode_html(&plant, &bodes, vibration_Hz);
        Ok(Answer::new(&report::bode_json(&plant, &bodes, vibration_Hz), report::bode_text(&plant, &bodes, vibration_Hz), html))
    })
}

/// An observer run over a log: states and learnt moment.
#[pyfunction]
pub fn observer_track(
    py: Python<'_>,
    log: &Log,
    element: &str,
    design: Design,
    angle_gain_V_rad: Option<f64>,
    torquer_N_m_A: Option<f64>,
) -> PyResult<Answer> {
    let log = log.shared();
    let step_s = row_interval_s(&log).map_err(analysis_error)?;
    if let Some(torquer) = torquer_N_m_A.filter(|torquer| !torquer.is_finite()) {
        return Err(PyValueError::new_err(format!("torquer_N_m_A {torquer}: must be a finite number")));
    }
    let request = request(element, Some(Kind::Augmented), Some(step_s), design)?;
    task::run(py, None, move |_| {
        let design = request.design().map_err(analysis_error)?;
        let tracked = design.track(&log, angle_gain_V_rad, torquer_N_m_A).map_err(analysis_error)?;
        let name = log.path().display().to_string();
        let rows = tracked.log(log.path()).map_err(|error| log_error(&error))?;
        let text = report::track_text(&name, &design, &tracked);
        Ok(Answer::new(&report::track_json(&name, &design, &tracked), text, String::new()).with_series(rows))
    })
}
