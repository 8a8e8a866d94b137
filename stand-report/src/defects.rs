//! Words for the defects of a log.

use super::listed;
use super::numbers::{plain, significant};
use identification::log::Axis;
use identification::log::plausible::{Defect, SLOPE_TOLERANCE, ShiftedConstant, UnitError};

/// One sentence: the observation and its probable cause.
pub fn defect(defect: &Defect) -> String {
    match defect {
        Defect::MissingInput { input } => {
            format!("The log has no column {input}, the input of the model: record it, or choose another input in [drive].")
        }
        Defect::WholeNumbers { columns } => {
            format!("{}: only whole numbers. Were decimals lost (decimal comma), or are these counts?", columns.join(" and "))
        }
        Defect::NoMotion { fault: Some(fault), .. } => format!("The rotor does not move in this log: a fault ended the log first ({fault})."),
        Defect::NoMotion { fault: None, .. } => {
            "The rotor does not move in this log: the drive was off or too weak for its friction, or the sensor is not connected.".to_owned()
        }
        Defect::ConstantInput { input, value, fault } => {
            let remedy = match fault {
                Some(fault) => format!("A fault ended the log early ({fault})."),
                None => "Use a profile that changes.".to_owned(),
            };
            format!("The input {input} is {value} in all rows, which identifies no model. {remedy}")
        }
        Defect::ConstantChannel { column, fault: Some(fault) } => {
            format!("{column} never changes: a fault ended the log early ({fault}).")
        }
        Defect::ConstantChannel { column, fault: None } => format!("{column} never changes: is the sensor connected?"),
        Defect::ExchangedAngleAndRate => {
            "theta_rad and omega_rad_s seem to be exchanged: theta_rad is the derivative of omega_rad_s.".to_owned()
        }
        Defect::ExchangedRates { ratio } => format!(
            "omega_rad_s is {} × dθ/dt, but gyro_rad_s agrees with dθ/dt: are the two rate columns exchanged?",
            significant(*ratio, 3)
        ),
        Defect::ExchangedVoltageAndCurrent => {
            "u_V falls with the rate at constant i_A, as a current does: are the columns u_V and i_A exchanged?".to_owned()
        }
        Defect::UnrelatedRate => {
            "omega_rad_s and dθ/dt are unrelated: is one of the columns another quantity, or from another recording?".to_owned()
        }
        Defect::RateScale { ratio, unit } => rate_scale(*ratio, *unit),
        Defect::Unsigned { column } => format!(
            "{column} is never negative, although it falls to zero and rises again after each reversal of the input: it is recorded without its sign. State this with --note {column}=magnitude."
        ),
        Defect::ReversedCurrent => {
            "u_V and i_A have opposite signs while the voltage drives in the right direction: the current has the wrong sign.".to_owned()
        }
        Defect::ReversedVoltage => "u_V is opposite to the current and to the rate: the voltage has the wrong sign.".to_owned(),
        Defect::ReversedDrive => "Positive voltage and current turn the drive backwards (a negative motor constant): reverse the sign of both columns, or of the motion.".to_owned(),
        Defect::ReversedAcceleration { column } => format!(
            "Positive {} accelerates the drive backwards: {column} or the motion has the wrong sign (a negative motor constant).",
            match *column {
                "torque_N_m" => "torque",
                "i_A" => "current",
                _ => "voltage",
            }
        ),
        Defect::Thousandths { columns, evidence } => thousandths(columns, evidence),
    }
}

fn thousandths(columns: &[&str], evidence: &[ShiftedConstant]) -> String {
    let units: Vec<String> = columns
        .iter()
        .map(|column| match *column {
            "u_V" => "u_V looks like mV".to_owned(),
            "i_A" => "i_A looks like mA".to_owned(),
            _ => "torque_N_m looks like mN m".to_owned(),
        })
        .collect();
    let shifts: Vec<String> = evidence.iter().map(|s| shifted_constant(Axis::Rotary, s)).collect();
    if shifts.is_empty() {
        return format!("{}: the column is about 1000 × the modelled one. Convert it to the unit of its name.", listed(&units));
    }
    format!(
        "{}: {}. Convert the column to the unit of its name; if the column is right, correct the start value in the model.",
        listed(&units),
        listed(&shifts)
    )
}

/// A constant with its fitted and its start value.
pub fn shifted_constant(axis: Axis, shifted: &ShiftedConstant) -> String {
    let ShiftedConstant { parameter, unit, start, fitted } = shifted;
    let (name, unit) = (axis.parameter(parameter), axis.unit(unit));
    format!("{name} would be {} {unit} where the model begins with {}", significant(*fitted, 3), plain(*start, 4))
}

fn rate_scale(ratio: f64, unit: Option<UnitError>) -> String {
    let observation = format!("omega_rad_s is {} × dθ/dt", significant(ratio, 3));
    let cause = match unit {
        None if (ratio + 1.0).abs() <= SLOPE_TOLERANCE => return format!("{observation}: one of them has the wrong sign."),
        None => return format!("{observation}, but should be 1 ± {SLOPE_TOLERANCE}: check the scale factors of both channels."),
        Some(UnitError::RateInDegrees) => "is omega_rad_s in degrees per second?",
        Some(UnitError::AngleInDegrees) => "is theta_rad in degrees?",
        Some(UnitError::RateInRpm) => "is omega_rad_s in revolutions per minute (rpm)?",
        Some(UnitError::RateDividedByRpm) => "9.55 times too small: was the rate divided by the factor of rpm, or is t_s not in seconds?",
        Some(UnitError::RateInRevolutions) => "is omega_rad_s in revolutions per second?",
        Some(UnitError::AngleInRevolutions) => "is theta_rad in revolutions?",
        Some(UnitError::Milliseconds) => "is t_s in milliseconds, or omega_rad_s in mrad/s?",
        Some(UnitError::AngleInMilliradians) => "is theta_rad in mrad?",
    };
    let sign = if ratio < 0.0 { " The sign is wrong, too." } else { "" };
    format!("{observation}: {cause}{sign}")
}
