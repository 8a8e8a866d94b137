//! One cycle of the measurement: two pulses of opposite sign in one position of the gyroscope.

use super::integral::Integral;
use hal_sim::gyro::Place;
use std::f64::consts::TAU;

/// Largest difference of angles in one position, rad: 2″.
const POSITION_TOLERANCE_RAD: f64 = 1e-5;

/// Why a cycle is not used.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CycleDefect {
    /// The cycle ended early.
    CutShort,
    /// A sample is missing.
    SampleLost,
    /// The angle sensor reached the end of its range.
    SensorSaturated,
    /// The currents of the two pulses differ in size.
    CurrentLimited,
    /// The firmware rejected the cycle, with this text.
    Firmware(String),
}

/// One cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Cycle {
    /// Its number, from 1.
    pub number: u32,
    /// Position of the gyroscope.
    pub position: Place,
    /// Axis of the platform, 0 to 2; 0 for a single-axis gyroscope.
    pub axis: usize,
    /// Sign of the first pulse.
    pub sign: i8,
    /// Begin, s.
    pub start_s: f64,
    /// Sums over the cycle.
    pub integral: Integral,
    /// Magnitude of the pulses, rad/s: the setpoint, or by the angles that of a rectangular pulse with the same rotation.
    pub amplitude_rad_s: f64,
    /// Inequality of the pulses by the measured current, rad/s; `None` where the current or K_m/H is not known.
    pub residual_rad_s: Option<f64>,
    /// Why the cycle is not used.
    pub defect: Option<CycleDefect>,
}

impl Cycle {
    /// Drift rate, corrected by the inequality of the current, rad/s.
    pub fn rate_rad_s(&self) -> f64 {
        self.integral.drift_rad_s() - self.residual_rad_s.unwrap_or(0.0)
    }

    /// Sequence of the signs: 0 for + −, 1 for − +.
    pub fn sequence(&self) -> usize {
        usize::from(self.sign < 0)
    }
}

/// The positions agree within 2″.
pub fn is_same_position(a: &Place, b: &Place) -> bool {
    let turned = (a.turned_rad - b.turned_rad).rem_euclid(TAU);
    turned.min(TAU - turned) < POSITION_TOLERANCE_RAD
        && (a.raised_rad - b.raised_rad).abs() < POSITION_TOLERANCE_RAD
        && (a.rolled_rad - b.rolled_rad).abs() < POSITION_TOLERANCE_RAD
}
