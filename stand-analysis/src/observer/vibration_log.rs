//! The record of a vibrating gyrotheodolite from a log, and its corrected azimuth.

use super::vibration::{Compensated, Measured, VibrationUncertainties, compensate};
use super::{Element, Kind, ObserverError, Plant, Poles, Request, Warning};
use identification::log::Log;
use identification::parameters::NamesParameters;

/// Columns beside those of every log.
pub const COLUMNS: [&str; 4] = ["alpha_rad", "gamma_rad", "alpha_rate_rad_s", "beta_rate_rad_s"];
/// Largest relative deviation of a row interval from the mean: the observer runs at a constant step.
const MAX_INTERVAL_DEVIATION: f64 = 1e-3;

/// Why a log cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum VibrationLogError {
    /// A column is missing.
    #[error("{log}: the log has no column {column}")]
    NoColumn {
        /// The log.
        log: String,
        /// The column.
        column: &'static str,
    },
    /// The rows are not evenly spaced.
    #[error("{log}: row {row}, column t_s: the rows are not evenly spaced, but the observer runs at a constant step; resample the log")]
    Uneven {
        /// The log.
        log: String,
        /// The row, from 1.
        row: usize,
    },
    /// The gain of the angle sensor is unknown.
    #[error("{log}: no note `angle_gain_V_rad`, and no value is given")]
    NoGain {
        /// The log.
        log: String,
    },
    /// The gain of the angle sensor is invalid.
    #[error("angle gain {0} V/rad: must be a number other than 0")]
    Gain(f64),
    /// The element does not have four states.
    #[error("{element}: the correction needs an element with four states ([four_state])")]
    NotFourStates {
        /// Name of the element.
        element: String,
    },
    /// The observer cannot be designed.
    #[error(transparent)]
    Design(#[from] ObserverError),
    /// The log cannot be corrected.
    #[error("{log}: {source}")]
    Correction {
        /// The log.
        log: String,
        /// Cause.
        source: ObserverError,
    },
}

impl NamesParameters for VibrationLogError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            VibrationLogError::NoGain { .. } | VibrationLogError::Gain(_) => vec!["angle_gain_V_rad"],
            VibrationLogError::Design(error) | VibrationLogError::Correction { source: error, .. } => error.parameters(),
            _ => Vec::new(),
        }
    }
}

/// A corrected log.
#[derive(Debug, Clone, PartialEq)]
pub struct CorrectedLog {
    /// The correction.
    pub compensated: Compensated,
    /// Warnings of the observer's design at the frequency of the vibration.
    pub warnings: Vec<Warning>,
}

/// Azimuth, roll and exact rates of a log, with constant sampling interval.
#[derive(Debug, Clone)]
pub struct VibrationLog<'a> {
    name: String,
    step_s: f64,
    alpha_rad: Vec<f64>,
    gamma_rad: &'a [f64],
    exact: Option<(&'a [f64], &'a [f64])>,
}

impl<'a> VibrationLog<'a> {
    /// Reads the columns of `log`. The azimuth is the column alpha_rad, or angle_sensor_V divided by the gain: `angle_gain_V_rad` or the
    /// note of that name.
    ///
    /// # Errors
    /// A column or the gain is missing, or the rows are not evenly spaced.
    pub fn of(log: &'a Log, angle_gain_V_rad: Option<f64>) -> Result<Self, VibrationLogError> {
        let name = || log.path().display().to_string();
        let missing = |column| VibrationLogError::NoColumn { log: name(), column };
        let alpha_rad = azimuth(log, angle_gain_V_rad)?;
        let gamma_rad = column(log, "gamma_rad").ok_or_else(|| missing("gamma_rad"))?;
        let step_s = step_s(log)?;
        let exact = column(log, "alpha_rate_rad_s").zip(column(log, "beta_rate_rad_s"));
        Ok(Self { name: name(), step_s, alpha_rad, gamma_rad, exact })
    }

    /// Corrects the azimuth by a static observer of `plant`, called `element` by the user, with all poles at −`omega_1_s`. Without
    /// `vibration_Hz` the vibration is the largest spectral line of gamma_rad.
    ///
    /// # Errors
    /// The element does not have four states; the observer cannot be designed; the record is too short or shows no vibration.
    pub fn corrected(
        &self,
        element: &str,
        plant: Plant,
        omega_1_s: f64,
        vibration_Hz: Option<f64>,
        uncertainties: &VibrationUncertainties,
    ) -> Result<CorrectedLog, VibrationLogError> {
        let Element::Four(four_state) = plant.element else {
            return Err(VibrationLogError::NotFourStates { element: element.to_owned() });
        };
        let request = Request { plant, poles: Poles::Binomial(omega_1_s), kind: Kind::Static, step_s: Some(self.step_s), vibration_Hz };
        let mut design = request.design()?;
        let compensated = compensate(&self.measured(), &four_state, &design, vibration_Hz, uncertainties)
            .map_err(|source| VibrationLogError::Correction { log: self.name.clone(), source })?;
        design.request.vibration_Hz = Some(compensated.vibration_Hz);
        let mut warnings = design.warnings();
        let window_s = compensated.periods / compensated.vibration_Hz;
        if window_s < compensated.precession_s {
            warnings.push(Warning::ShorterThanPrecession { window_s, precession_s: compensated.precession_s });
        }
        Ok(CorrectedLog { compensated, warnings })
    }

    /// The record for the correction.
    pub fn measured(&self) -> Measured<'_> {
        Measured { step_s: self.step_s, alpha_rad: &self.alpha_rad, gamma_rad: self.gamma_rad, exact: self.exact }
    }
}

/// The interval of evenly spaced rows, s.
pub(super) fn step_s(log: &Log) -> Result<f64, VibrationLogError> {
    let name = || log.path().display().to_string();
    let t_s = column(log, "t_s").ok_or_else(|| VibrationLogError::NoColumn { log: name(), column: "t_s" })?;
    let step_s = (t_s[t_s.len() - 1] - t_s[0]) / (t_s.len().max(2) - 1) as f64;
    match t_s.windows(2).position(|w| ((w[1] - w[0]) / step_s - 1.0).abs() > MAX_INTERVAL_DEVIATION) {
        Some(k) => Err(VibrationLogError::Uneven { log: name(), row: k + 2 }),
        None => Ok(step_s),
    }
}

/// The angle, rad, by angle_sensor_V where the log has it, and whether it has; else by alpha_rad.
pub(super) fn measured_angle(log: &Log, angle_gain_V_rad: Option<f64>) -> Result<(Vec<f64>, bool), VibrationLogError> {
    match column(log, "angle_sensor_V") {
        Some(volts) => Ok((in_rad(log, volts, angle_gain_V_rad)?, true)),
        None => Ok((azimuth(log, angle_gain_V_rad)?, false)),
    }
}

/// Voltages over the gain of the angle sensor.
fn in_rad(log: &Log, volts: &[f64], angle_gain_V_rad: Option<f64>) -> Result<Vec<f64>, VibrationLogError> {
    let noted = log.notes().number("angle_gain_V_rad");
    let gain: f64 = angle_gain_V_rad.or(noted).ok_or_else(|| VibrationLogError::NoGain { log: log.path().display().to_string() })?;
    if !(gain.is_finite() && gain != 0.0) {
        return Err(VibrationLogError::Gain(gain));
    }
    Ok(volts.iter().map(|volts| volts / gain).collect())
}

/// The azimuth, rad.
fn azimuth(log: &Log, angle_gain_V_rad: Option<f64>) -> Result<Vec<f64>, VibrationLogError> {
    if let Some(alpha) = column(log, "alpha_rad") {
        return Ok(alpha.to_vec());
    }
    let name = || log.path().display().to_string();
    let volts =
        column(log, "angle_sensor_V").ok_or_else(|| VibrationLogError::NoColumn { log: name(), column: "alpha_rad or angle_sensor_V" })?;
    in_rad(log, volts, angle_gain_V_rad)
}

pub(super) fn column<'a>(log: &'a Log, name: &str) -> Option<&'a [f64]> {
    log.columns().iter().find(|column| column.name == name).map(|column| column.values.as_slice())
}
