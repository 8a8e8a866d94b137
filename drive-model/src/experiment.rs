//! Experiments that show or determine an effect: runs of the stand, and simulated demonstrations.

use std::f64::consts::TAU;

use crate::coordinate::Coordinate;

/// A run of the stand: mode, profile, amplitude, duration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandRun {
    /// `rate` or `voltage`.
    pub mode: &'static str,
    /// The firmware's name of the profile.
    pub profile: &'static str,
    /// Amplitude, rad/s or V.
    pub amplitude: f64,
    /// Duration, s.
    pub duration_s: f64,
}

impl StandRun {
    /// Slow staircase through zero in both directions: whole turns at a few rad/s.
    pub const LOW_RATES: StandRun = StandRun::rate("staircase", 4.0, 60.0);
    /// Staircase up to the highest rate of the rate sensor.
    pub const HIGH_RATES: StandRun = StandRun::rate("staircase", 30.0, 40.0);
    /// Small steps of the voltage, at which the rotor sticks and breaks away.
    pub const BREAKAWAY: StandRun = StandRun::voltage("staircase", 0.4, 60.0);
    /// Many frequencies at once, up to 20 Hz, without the speed loop.
    pub const MULTISINE: StandRun = StandRun::voltage("multisine", 0.7, 30.0);
    /// Sharp steps without the speed loop.
    pub const SHARP_STEPS: StandRun = StandRun::voltage("prbs", 0.7, 30.0);
    /// The same angles and rates at small and at large currents.
    pub const VARYING_CURRENT: StandRun = StandRun::rate("sweep", 15.0, 60.0);
    /// Continual reversals: large currents that warm the winding.
    pub const WARM_UP: StandRun = StandRun::rate("prbs", 15.0, 120.0);
    /// Various rates with rests between them.
    pub const STEPS: StandRun = StandRun::rate("multi-step", 15.0, 60.0);

    /// Every run that a card may name.
    pub const ALL: [StandRun; 8] = [
        Self::LOW_RATES,
        Self::HIGH_RATES,
        Self::BREAKAWAY,
        Self::MULTISINE,
        Self::SHARP_STEPS,
        Self::VARYING_CURRENT,
        Self::WARM_UP,
        Self::STEPS,
    ];

    /// A run with the speed loop; amplitude in rad/s.
    pub const fn rate(profile: &'static str, amplitude: f64, duration_s: f64) -> StandRun {
        StandRun { mode: "rate", profile, amplitude, duration_s }
    }

    /// A run without the speed loop; amplitude in V.
    pub const fn voltage(profile: &'static str, amplitude: f64, duration_s: f64) -> StandRun {
        StandRun { mode: "voltage", profile, amplitude, duration_s }
    }
}

/// The motion of a simulated demonstration.
///
/// Most motions are controlled by a stiff loop: the motion is then the same with and without the effect, and current or voltage differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// The drive is off.
    Off,
    /// A constant rate, rad/s.
    Constant(f64),
    /// A triangle of the rate about zero: amplitude, rad/s, and period, s.
    Triangle(f64, f64),
    /// A sine of the rate: amplitude, rad/s, and period, s.
    Sine(f64, f64),
    /// A square wave of the voltage without a loop: amplitude, V, and period, s.
    VoltageSteps(f64, f64),
}

impl Motion {
    /// The controlled rate at `t_s`, rad/s; `None`: no loop.
    pub fn rate_rad_s(self, t_s: f64) -> Option<f64> {
        match self {
            Motion::Off | Motion::VoltageSteps(..) => None,
            Motion::Constant(rate) => Some(rate),
            Motion::Triangle(rate, period) => {
                let phase = (t_s / period + 0.25).rem_euclid(1.0);
                Some(rate * if phase < 0.5 { 4.0 * phase - 1.0 } else { 3.0 - 4.0 * phase })
            }
            Motion::Sine(rate, period) => Some(rate * libm::sin(TAU * t_s / period)),
        }
    }

    /// The voltage at `t_s` without a loop, V.
    pub fn open_loop_V(self, t_s: f64) -> f64 {
        match self {
            // The first step is shorter by half, so that the rate is symmetric about zero.
            Motion::VoltageSteps(volt, period) => {
                if (t_s / period + 0.25).rem_euclid(1.0) < 0.5 {
                    volt
                } else {
                    -volt
                }
            }
            _ => 0.0,
        }
    }
}

/// The channel that a demonstration shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// Measured current.
    Current,
    /// Commanded voltage.
    Voltage,
    /// Rate of the rate sensor.
    Rate,
    /// Rate from the encoder, over 20 ms.
    EncoderRate,
}

/// The abscissa of a demonstration's difference plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// A coordinate of the residual.
    Coordinate(Coordinate),
    /// The angle over many turns.
    TotalAngle,
}

/// A simulated experiment with and without an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demonstration {
    /// The motion.
    pub motion: Motion,
    /// Duration, s.
    pub duration_s: f64,
    /// The channel that is shown.
    pub output: Output,
    /// Abscissa of the difference plot.
    pub abscissa: Abscissa,
    /// Effects that both simulated stands have in addition: effect, parameter, value.
    pub added: &'static [(&'static str, &'static str, f64)],
}

impl Demonstration {
    /// A weight on a cord: a current flows, and the winding warms.
    pub const WEIGHT: (&'static str, &'static str, f64) = ("load", "load_N_m", -0.02);
}
