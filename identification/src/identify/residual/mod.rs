//! Analysis of residuals: over which coordinates is the residual of a fitted model not noise?
//!
//! Input: a log, its prepared data and the fit result. Output: [`Misfit`]s, the most significant first. Nothing is simulated again: the
//! response of every channel to a missing torque or voltage follows from inertia, motor constant and resistance ([`rows`]). A few shapes
//! over each coordinate ([`shapes`]), harmonics of the angle and lines in time ([`harmonics`]) are searched in all channels together
//! ([`search`]) and tested against noise of the remaining residual's colour ([`significance`]).

pub mod harmonics;
mod misfits;
pub mod plot_data;
mod rows;
mod search;
mod shapes;
mod significance;

use drive_model::Coordinate;

pub use shapes::Difference;

use crate::identify::fit::FitResult;
use crate::log::Log;
use crate::model::{Channel, Input};
use crate::recording::PreparedLog;

/// One coordinate over which the residual of one channel is not noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// The channel.
    pub channel: Channel,
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Fraction of the residual's variance explained by this coordinate, 0 to 1, in addition to the coordinates found before.
    pub explained_fraction: f64,
    /// Periods per revolution of the harmonics found, the strongest first; empty for other coordinates than the angle.
    pub harmonic_orders: Vec<u32>,
    /// Probability of this fraction by chance, corrected for the number of channels and shapes tested.
    pub p_value: f64,
    /// Decimal logarithm of the probability; finite where the probability itself underflows.
    pub log10_p: f64,
    /// Form of the missing term; `None` if the fraction is too small to attribute.
    pub signature: Option<Signature>,
}

/// Form of the term that the model lacks, by its effect on the channels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Signature {
    /// A torque, a smooth function of the coordinate.
    Torque,
    /// A torque that always acts in the same direction.
    ConstantTorque,
    /// A torque from a time on.
    TorqueStep {
        /// Time of the step, s.
        t_s: f64,
    },
    /// A torque that depends on the angle only.
    AngleTorque,
    /// A torque harmonic that grows with the current.
    TorqueRipple,
    /// Friction that depends on the angle.
    AngleFriction,
    /// A voltage, a smooth function of the coordinate.
    Voltage,
    /// A variation of the voltage, proportional to the voltage command.
    VoltageLine {
        /// Frequency, Hz.
        frequency_hz: f64,
    },
    /// A variation of the motor constant.
    MotorConstant,
    /// A variation at one frequency.
    Line {
        /// Frequency, Hz.
        frequency_hz: f64,
    },
    /// An angle error, in the angle and in the rate derived from it.
    EncoderError,
    /// A harmonic angle error, in the angle and in the rate derived from it.
    EncoderEccentricity,
    /// A harmonic of the angle only, growing with the rate.
    AngleHarmonic,
    /// A harmonic of one channel, independent of the rate.
    SensorHarmonic,
    /// Something that is constant within each log and differs from log to log.
    ByLog {
        /// What differs.
        difference: Difference,
        /// The channel whose reading differs; `None`: a torque or a voltage.
        channel: Option<Channel>,
        /// It is a voltage.
        is_voltage: bool,
    },
    /// A constant offset of a channel.
    Offset,
    /// An error of one channel, a smooth function of the coordinate.
    Sensor {
        /// The channel.
        channel: Option<Channel>,
    },
    /// A torque or an error of the sensor, not distinguishable under a prescribed motion.
    TorqueOrSensor,
    /// A harmonic independent of the rate: a torque or an error of the sensor, not distinguishable under a prescribed motion.
    HarmonicTorqueOrSensor,
}

/// Coordinates over which the residuals of `fit` are not noise, the most significant first.
///
/// A misfit is listed if its probability by chance is below 1/1000, corrected for the number of tests.
pub fn misfits(log: &Log, data: &PreparedLog, fit: &FitResult) -> Vec<Misfit> {
    let Some(rows) = rows::ResidualRows::new(log, data, fit) else { return Vec::new() };
    misfits::by_channel(search::search(rows, fit))
}

/// Excess χ²/n that an error of the input (by row, in its unit) would leave in each channel, by the linear response of the fitted drive;
/// `None` for a prescribed motion.
pub fn excess_of_input_error(log: &Log, data: &PreparedLog, fit: &FitResult, error: &[f64]) -> Option<Vec<f64>> {
    let rows = rows::ResidualRows::new(log, data, fit)?;
    let disturbance = match data.driven {
        Input::Voltage => rows::Disturbance { voltage: Some(error), ..Default::default() },
        Input::Torque => rows::Disturbance { torque: Some(error), ..Default::default() },
        Input::Current => {
            let motor_constant = rows.drive?.motor_constant();
            let torque: Vec<f64> = error.iter().map(|a| a * motor_constant).collect();
            let response = rows.response(rows::Disturbance { torque: Some(&torque), ..Default::default() });
            return Some(rows.mean_squares(&response));
        }
        Input::Motion | Input::Setpoint => return None,
    };
    Some(rows.mean_squares(&rows.response(disturbance)))
}

#[cfg(test)]
mod tests;
