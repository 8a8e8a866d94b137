//! A log of the simulated stand in virtual time.

use std::path::PathBuf;

use hal_sim::plant::Stand;
use hal_sim::session::SessionRequest;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_acquire::hidden::hide;
use stand_acquire::profile_choice::choose_profile;
use stand_acquire::simulation::{SimulationError, described_stand, simulate_to_file};
use stand_firmware::profile::ProfileConfig;
use stand_firmware::speed_loop::Mode;
use stand_report::simulation as report;

use crate::answer::Answer;
use crate::error::{analysis_error, log_error, stand_error};
use crate::task;

/// Control mode by its name.
///
/// # Errors
/// `ValueError`: neither `rate` nor `voltage`.
fn mode_of(word: &str) -> PyResult<Mode> {
    match word {
        "rate" => Ok(Mode::Rate),
        "voltage" => Ok(Mode::Voltage),
        other => Err(PyValueError::new_err(format!("mode {other:?}: must be \"rate\" or \"voltage\""))),
    }
}

/// Mode and profile by their names; `seed` of a random profile.
///
/// # Errors
/// `ValueError`: a name or a parameter is invalid.
pub fn profile_of(profile: &str, mode: &str, seed: u64, parameters: &[(String, f64)]) -> PyResult<(Mode, ProfileConfig)> {
    let mode = mode_of(mode)?;
    let parameters: Vec<(&str, f64)> = parameters.iter().map(|(name, value)| (name.as_str(), *value)).collect();
    let profile = choose_profile(profile, mode, seed, &parameters).map_err(|error| PyValueError::new_err(error.to_string()))?;
    Ok((mode, profile))
}

/// The simulated stand of a description in TOML, or the default one.
///
/// # Errors
/// `ValueError`: the description is invalid.
pub fn stand_of(description: Option<&str>) -> PyResult<Stand> {
    let Some(text) = description else { return Ok(Stand::default()) };
    described_stand(text).map_err(|error| PyValueError::new_err(format!("stand: {error}")))
}

/// Writes a log of the simulated stand; the answer has its summary and the hidden effect.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "arguments of the Python function")]
pub fn simulated_log(
    py: Python<'_>,
    path: PathBuf,
    profile: &str,
    mode: &str,
    parameters: Vec<(String, f64)>,
    seconds: f64,
    seed: u64,
    hidden: Option<&str>,
    stand: Option<&str>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Answer> {
    let (mode, profile) = profile_of(profile, mode, seed, &parameters)?;
    let mut stand = stand_of(stand)?;
    let hidden = hidden.map(|effect| hide(effect, &mut stand)).transpose();
    let hidden = hidden.map_err(|error| PyValueError::new_err(format!("hidden: {error}")))?;
    task::run(py, progress.as_ref(), move |task| {
        let mut percent = 0;
        let log = simulate_to_file(&stand, SessionRequest { mode, profile, seconds, seed }, &path, |t_s| {
            let now = (100.0 * t_s / seconds) as u32;
            if now > percent {
                percent = now;
                task.progress("simulating".to_owned(), Some(t_s / seconds));
            }
            !task.is_cancelled()
        });
        let log = log.map_err(|error| match error {
            SimulationError::Log(error) => log_error(&error),
            SimulationError::Stand(error) => analysis_error(error),
            SimulationError::Session(error) => stand_error(error),
        })?;
        Ok(Answer::new(&report::json(&log, hidden.as_ref(), true), report::text(&log, hidden.as_ref(), true), String::new()))
    })
}
