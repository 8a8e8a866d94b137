//! Errors of the drift measurement. `report` adds the reasons that are data: defect, parameters, why no cycle was found.

use super::cycle::CycleDefect;
use identification::parameters::NamesParameters;

/// Why the input gives no drift.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriftError {
    /// The deadline has passed.
    #[error("interrupted by the user")]
    Interrupted,
    /// A number out of its range.
    #[error("{name} = {value}: must be a number from {min} to {max}")]
    Number {
        /// Its name.
        name: String,
        /// The number.
        value: f64,
        /// Smallest valid number.
        min: f64,
        /// Greatest valid number.
        max: f64,
    },
    /// Two amplitudes of the pulses are too similar.
    #[error(
        "amplitude {rate}: amplitudes must differ by at least {:.0} % to determine the inequality of the torquer", 100.0 * (.min_ratio - 1.0)
    )]
    SimilarAmplitudes {
        /// The amplitude, in the user's unit.
        rate: f64,
        /// Smallest ratio of two amplitudes.
        min_ratio: f64,
    },
    /// The measured horizontal rate disagrees with the latitude.
    #[error(
        "the measured horizontal Earth rate, {measured_deg_h:.4} ± {expanded_deg_h:.4} °/h, disagrees with the {expected_deg_h:.4} °/h of the \
         latitude {latitude_deg}°: check the latitude, the angles of the positions and the gain of the angle sensor, or state how exactly they are known"
    )]
    LatitudeDisagrees {
        /// Latitude given, degrees.
        latitude_deg: f64,
        /// Horizontal Earth rate by the latitude, °/h.
        expected_deg_h: f64,
        /// Measured horizontal Earth rate, °/h.
        measured_deg_h: f64,
        /// Its expanded uncertainty, °/h.
        expanded_deg_h: f64,
    },
    /// A column is missing.
    #[error("{log}: no column `{column}`; the drift needs the voltage of the angle sensor and the current of the torquer")]
    Column {
        /// The log.
        log: String,
        /// The column.
        column: String,
    },
    /// A parameter is neither given nor a note of the log.
    #[error("{log}: no note `{note}`, and no value is given")]
    Note {
        /// The log.
        log: String,
        /// The note, which has the name of the parameter.
        note: &'static str,
    },
    /// A note is not a number.
    #[error("{log}: note `{note}`: `{text}` is not a number")]
    NoteText {
        /// The log.
        log: String,
        /// The note.
        note: String,
        /// Its text.
        text: String,
    },
    /// No cycles in the log.
    #[error("{log}: no cycle of two pulses of {pulse_s} s found")]
    NoCycle {
        /// The log.
        log: String,
        /// Duration of a pulse, s.
        pulse_s: f64,
        /// The reason, where it is known.
        reason: Option<NoCycleReason>,
    },
    /// No cycle is valid.
    #[error("{log}: none of the {count} cycles is valid")]
    NoValidCycle {
        /// The log.
        log: String,
        /// Number of cycles.
        count: usize,
        /// Defect of the first.
        defect: Option<CycleDefect>,
    },
    /// All valid cycles are in one position.
    #[error(
        "no turn: all valid cycles are in one position (turned {turned_deg}°, raised {raised_deg}°, rolled {rolled_deg}°); a second position, turned by \
         180°, separates own and apparent drift"
    )]
    OnePosition {
        /// Angle of the turn, degrees.
        turned_deg: f64,
        /// Elevation of the sensitive axis, degrees.
        raised_deg: f64,
        /// Roll about the sensitive axis, degrees.
        rolled_deg: f64,
    },
    /// The positions do not separate the parameters.
    #[error("{positions} positions do not separate all parameters of the drift; add positions with another turn, roll or elevation")]
    NotSeparable {
        /// The parameters.
        parameters: Vec<PositionParameter>,
        /// Number of positions.
        positions: usize,
    },
    /// A raised axis needs the latitude.
    #[error("the sensitive axis is raised: the latitude is needed to correct the Earth's rotation")]
    RaisedWithoutLatitude,
    /// Three axes need two positions half a turn apart.
    #[error("three axes need two positions, 180° apart")]
    ThreeAxisPositions,
    /// A position lacks an axis.
    #[error("{log}: axis {axis} has no valid cycle in one of the positions")]
    AxisMissing {
        /// The log.
        log: String,
        /// The axis: x, y or z.
        axis: &'static str,
    },
    /// The pulses are not a whole number of rows.
    #[error("{log}: pulses of {pulse_s} s are not a whole number of rows of {dt_s} s")]
    PulseRows {
        /// The log.
        log: String,
        /// Duration of a pulse, s.
        pulse_s: f64,
        /// Interval of the rows, s.
        dt_s: f64,
    },
    /// The static log is too short.
    #[error("{log}: {length_s} s without a gap are too short: the static log must last two pulses, {needed_s} s")]
    TooShort {
        /// The log.
        log: String,
        /// Longest stretch without a gap, s.
        length_s: f64,
        /// Needed, s.
        needed_s: f64,
    },
    /// A column of the platform method is missing.
    #[error("{log}: no column `{column}`; needed are the angle of the platform and the rate of the gyro")]
    PlatformColumn {
        /// The log.
        log: String,
        /// The column.
        column: &'static str,
    },
}

impl NamesParameters for DriftError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            DriftError::Number { name, .. } => vec![name],
            DriftError::Note { note, .. } => vec![note],
            DriftError::SimilarAmplitudes { .. } => vec!["rate_rad_s"],
            DriftError::LatitudeDisagrees { .. } => vec!["latitude_deg", "latitude_error_rad", "gain_error", "level_error_rad"],
            DriftError::RaisedWithoutLatitude => vec!["latitude_deg"],
            _ => Vec::new(),
        }
    }
}

/// A parameter of the fit over positions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PositionParameter {
    /// d₀.
    OwnDrift,
    /// C = ω_h cos A.
    AzimuthCosine,
    /// S = ω_h sin A.
    AzimuthSine,
    /// d_I, by g along the sensitive axis.
    GSensitive,
    /// d_O, by g along the output axis.
    GOutput,
    /// d_S, by g along the spin axis.
    GSpin,
}

/// Why a log has no cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoCycleReason {
    /// The current of the torquer is constant.
    ConstantCurrent,
    /// The log has one row.
    OneRow,
    /// The platform does not turn both ways.
    NoPlatformPulses,
}

/// Checks that a number is within its range.
///
/// # Errors
/// It is not, or not finite.
pub fn within(name: &str, value: f64, min: f64, max: f64) -> Result<f64, DriftError> {
    if value.is_finite() && (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(DriftError::Number { name: name.to_owned(), value, min, max })
    }
}
