//! Plausibility of a log: the columns must contain the quantities that their names state. Checked before any model is fitted.
//!
//! Input: a [`Log`] and the name of the model's input column. Output: [`Defect`]s; none for a sound log. Checked are: motion and a varying
//! input; lost decimals; the slope between dθ/dt and ω (sign, unit, exchanged columns); the signs of voltage, current and torque relative
//! to the motion. Effects of the catalogue (a delayed, nonlinear or biased rate channel, an eccentric encoder, friction, cogging) are not
//! defects: a defect must be beyond doubt.

mod drive;
mod magnitude;
mod regress;
mod response;
mod slope;
mod still;
mod windows;

pub use response::is_one as is_one_response;
pub use slope::SLOPE_TOLERANCE;

use crate::log::Log;

/// Kind of a defect, as in the `code` of the JSON answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum DefectCode {
    /// The model's input is not a column of the log.
    MissingInput,
    /// The input never changes, and the motion is no response to it.
    ConstantInput,
    /// A measured channel never changes while others do.
    ConstantChannel,
    /// The rotor does not move.
    NoMotion,
    /// A measured channel contains only whole numbers.
    WholeNumbers,
    /// Two channels disagree in sign.
    WrongSign,
    /// A column lacks its sign.
    Unsigned,
    /// Two channels differ by a conversion factor between units.
    WrongUnit,
    /// dθ/dt and ω differ by another factor, or are unrelated.
    RateDisagrees,
    /// Two columns seem to be exchanged.
    Swapped,
    /// Voltage, current or torque acts against the motion that it causes.
    NegativeMotorConstant,
}

impl DefectCode {
    /// Name in the JSON answers.
    pub fn name(self) -> &'static str {
        match self {
            DefectCode::MissingInput => "missing-input",
            DefectCode::ConstantInput => "constant-input",
            DefectCode::ConstantChannel => "constant-channel",
            DefectCode::NoMotion => "no-motion",
            DefectCode::WholeNumbers => "whole-numbers",
            DefectCode::WrongSign => "wrong-sign",
            DefectCode::Unsigned => "unsigned",
            DefectCode::WrongUnit => "wrong-unit",
            DefectCode::RateDisagrees => "rate-disagrees",
            DefectCode::Swapped => "swapped",
            DefectCode::NegativeMotorConstant => "negative-motor-constant",
        }
    }
}

/// A defect of a log, with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub enum Defect {
    /// The model's input is not a column of the log.
    MissingInput {
        /// The column.
        input: String,
    },
    /// These columns contain only whole numbers.
    WholeNumbers {
        /// The columns.
        columns: Vec<&'static str>,
    },
    /// The rotor does not move.
    NoMotion {
        /// The angle and rate columns of the log.
        columns: Vec<&'static str>,
        /// The fault that ended the log.
        fault: Option<String>,
    },
    /// The input is the same in all rows, and the motion is no response to it.
    ConstantInput {
        /// The column.
        input: &'static str,
        /// Its value.
        value: f64,
        /// The fault that ended the log.
        fault: Option<String>,
    },
    /// A measured channel never changes.
    ConstantChannel {
        /// The column.
        column: &'static str,
        /// The fault that ended the log.
        fault: Option<String>,
    },
    /// `theta_rad` is the derivative of `omega_rad_s`.
    ExchangedAngleAndRate,
    /// `gyro_rad_s` agrees with dθ/dt, `omega_rad_s` does not.
    ExchangedRates {
        /// `omega_rad_s` over dθ/dt.
        ratio: f64,
    },
    /// `u_V` falls with the rate at constant `i_A`.
    ExchangedVoltageAndCurrent,
    /// `omega_rad_s` and dθ/dt are not related linearly.
    UnrelatedRate,
    /// `omega_rad_s` is a multiple of dθ/dt.
    RateScale {
        /// `omega_rad_s` over dθ/dt.
        ratio: f64,
        /// The unit error with this ratio, if there is one; the sign apart.
        unit: Option<UnitError>,
    },
    /// The column is a magnitude, and no note states it.
    Unsigned {
        /// `omega_rad_s` or `i_A`.
        column: &'static str,
    },
    /// `i_A` has the opposite sign.
    ReversedCurrent,
    /// `u_V` has the opposite sign.
    ReversedVoltage,
    /// The drive turns against its voltage and current.
    ReversedDrive,
    /// The drive accelerates against this column.
    ReversedAcceleration {
        /// `torque_N_m`, `i_A` or `u_V`.
        column: &'static str,
    },
    /// These columns are in thousandths of their unit: a fit shifts the physical constants of the model by factors of 1000.
    Thousandths {
        /// `u_V`, `i_A` or `torque_N_m`.
        columns: Vec<&'static str>,
        /// The shifted constants.
        evidence: Vec<ShiftedConstant>,
    },
}

/// A physical constant that a fit shifts far from its start value.
#[derive(Debug, Clone, PartialEq)]
pub struct ShiftedConstant {
    /// Name in the model file.
    pub parameter: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Start value.
    pub start: f64,
    /// Fitted value.
    pub fitted: f64,
}

/// A unit error of angle, rate or time, by the factor that it gives `omega_rad_s` over dθ/dt.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitError {
    /// 180/π: the rate in degrees per second.
    RateInDegrees,
    /// π/180: the angle in degrees.
    AngleInDegrees,
    /// 30/π: the rate in revolutions per minute.
    RateInRpm,
    /// π/30: the rate divided by the factor of rpm, or a wrong unit of time.
    RateDividedByRpm,
    /// 1/2π: the rate in revolutions per second.
    RateInRevolutions,
    /// 2π: the angle in revolutions.
    AngleInRevolutions,
    /// 1000: the time in milliseconds, or the rate in mrad/s.
    Milliseconds,
    /// 1/1000: the angle in mrad.
    AngleInMilliradians,
}

impl Defect {
    /// Kind of the defect.
    pub fn code(&self) -> DefectCode {
        match self {
            Defect::MissingInput { .. } => DefectCode::MissingInput,
            Defect::WholeNumbers { .. } => DefectCode::WholeNumbers,
            Defect::NoMotion { .. } => DefectCode::NoMotion,
            Defect::ConstantInput { .. } => DefectCode::ConstantInput,
            Defect::ConstantChannel { .. } => DefectCode::ConstantChannel,
            Defect::ExchangedAngleAndRate | Defect::ExchangedRates { .. } | Defect::ExchangedVoltageAndCurrent => DefectCode::Swapped,
            Defect::RateScale { unit: Some(_), .. } | Defect::Thousandths { .. } => DefectCode::WrongUnit,
            Defect::RateScale { ratio, unit: None } if *ratio < 0.0 => DefectCode::WrongSign,
            Defect::UnrelatedRate | Defect::RateScale { .. } => DefectCode::RateDisagrees,
            Defect::Unsigned { .. } => DefectCode::Unsigned,
            Defect::ReversedCurrent | Defect::ReversedVoltage => DefectCode::WrongSign,
            Defect::ReversedDrive | Defect::ReversedAcceleration { .. } => DefectCode::NegativeMotorConstant,
        }
    }

    /// The columns concerned.
    pub fn columns(&self) -> Vec<&'static str> {
        match self {
            Defect::MissingInput { .. } => Vec::new(),
            Defect::WholeNumbers { columns } | Defect::NoMotion { columns, .. } | Defect::Thousandths { columns, .. } => columns.clone(),
            Defect::ConstantInput { input: column, .. }
            | Defect::ConstantChannel { column, .. }
            | Defect::Unsigned { column }
            | Defect::ReversedAcceleration { column } => vec![column],
            Defect::ExchangedAngleAndRate | Defect::UnrelatedRate | Defect::RateScale { .. } => vec!["theta_rad", "omega_rad_s"],
            Defect::ExchangedRates { .. } => vec!["omega_rad_s", "gyro_rad_s"],
            Defect::ExchangedVoltageAndCurrent | Defect::ReversedVoltage => vec!["u_V", "i_A"],
            Defect::ReversedCurrent => vec!["i_A", "u_V"],
            Defect::ReversedDrive => vec!["u_V", "omega_rad_s"],
        }
    }
}

/// The fault that ended a log early, from its note, such as `overspeed at 0.2 s`. A stand's message has number, name and remedy.
pub fn fault_that_ended(log: &Log) -> Option<String> {
    let fault = log.notes().fault()?;
    let at = if fault.at_s.is_empty() { String::new() } else { format!(" at {} s", fault.at_s) };
    (!fault.name().is_empty()).then(|| format!("{}{at}", fault.name()))
}

/// Defects of `log` for a model whose input is the column `input`, the most basic first; empty for a sound log.
///
/// The effort is one pass over the rows per test; the memory a few numbers per tenth of a second.
pub fn check(log: &Log, input: &str) -> Vec<Defect> {
    let defects = still::check(log, input);
    // Without motion or input the tests of slopes and signs have no meaning.
    if defects.iter().any(|d| d.code() != DefectCode::WholeNumbers) {
        return defects;
    }
    let magnitudes = ["omega_rad_s", "i_A"].into_iter().any(|column| log.provenance(column).magnitude);
    // A magnitude has no sign that could be wrong.
    let signs = if magnitudes { None } else { magnitude::check(log, input).or_else(|| slope::check(log)).or_else(|| drive::check(log)) };
    match signs {
        // A stepped voltage in the current's column has whole numbers, too.
        Some(swapped) if swapped.code() == DefectCode::Swapped => vec![swapped],
        signs if defects.is_empty() => signs.into_iter().collect(),
        _ => defects,
    }
}

#[cfg(test)]
mod tests;
