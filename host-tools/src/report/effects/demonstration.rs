//! The experiment that demonstrates an effect on its page.
//!
//! In most experiments a stiff loop controls the rate, so that the motion with and without the effect is the same and the effect appears
//! in current or voltage. Voltage steps are applied in open loop.

use std::f64::consts::TAU;

use drive_model::{Card, Coordinate, Domain};

/// Motion or voltage that the stand is commanded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// The drive is off.
    Off,
    /// Constant rate, rad/s.
    Constant(f64),
    /// Triangle of the rate: amplitude, rad/s, and period, s.
    Triangle(f64, f64),
    /// Sine of the rate: amplitude, rad/s, and period, s.
    Sine(f64, f64),
    /// Square wave of the voltage: amplitude, V, and period, s.
    Steps(f64, f64),
}

impl Motion {
    /// The commanded rate at `t_s`, rad/s; `None` in open loop.
    pub fn rate_rad_s(self, t_s: f64) -> Option<f64> {
        match self {
            Motion::Off | Motion::Steps(..) => None,
            Motion::Constant(rate) => Some(rate),
            Motion::Triangle(rate, period) => {
                let phase = (t_s / period + 0.25).rem_euclid(1.0);
                Some(rate * if phase < 0.5 { 4.0 * phase - 1.0 } else { 3.0 - 4.0 * phase })
            }
            Motion::Sine(rate, period) => Some(rate * (TAU * t_s / period).sin()),
        }
    }

    /// The voltage at `t_s` in open loop, V.
    pub fn open_V(self, t_s: f64) -> f64 {
        match self {
            // Starts with a quarter of the period, so that the mean rate is zero.
            Motion::Steps(volt, period) => {
                if (t_s / period + 0.25).rem_euclid(1.0) < 0.5 {
                    volt
                } else {
                    -volt
                }
            }
            _ => 0.0,
        }
    }

    /// The motion as a clause.
    pub fn description(self) -> String {
        match self {
            Motion::Off => "the drive is off".to_owned(),
            Motion::Constant(0.0) => "the rate is controlled to zero".to_owned(),
            Motion::Constant(rate) => format!("the rate is controlled to {rate} rad/s"),
            Motion::Triangle(rate, period) => {
                format!("the rate follows a triangle between +{rate} and −{rate} rad/s with a period of {period} s")
            }
            Motion::Sine(rate, period) => format!("the rate follows a sine of {rate} rad/s with a period of {period} s"),
            Motion::Steps(volt, period) => format!("the voltage steps between +{volt} and −{volt} V with a period of {period} s"),
        }
    }
}

/// The plotted quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    /// The measured current.
    Current,
    /// The voltage that the loop commands.
    Voltage,
    /// The rate of the rate sensor.
    Rate,
    /// The rate of the encoder, over 20 ms.
    EncoderRate,
}

impl Output {
    /// Name and unit for an axis.
    pub fn label(self) -> (&'static str, &'static str) {
        match self {
            Output::Current => ("current", "A"),
            Output::Voltage => ("commanded voltage", "V"),
            Output::Rate => ("rate of the rate sensor", "rad/s"),
            Output::EncoderRate => ("rate of the encoder", "rad/s"),
        }
    }
}

/// The horizontal axis of the lower plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    /// The coordinate of the card.
    Coordinate(Coordinate),
    /// The angle over several turns.
    TotalAngle,
}

/// An experiment that demonstrates an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Demonstration {
    /// Motion of the stand.
    pub motion: Motion,
    /// Duration, s.
    pub duration_s: f64,
    /// The plotted quantity.
    pub output: Output,
    /// The horizontal axis of the difference.
    pub abscissa: Abscissa,
    /// Effects of both stands: effect, parameter, value.
    pub also: &'static [(&'static str, &'static str, f64)],
}

/// A weight on a cord: it causes a current, which warms the winding.
const WEIGHT: (&str, &str, f64) = ("load", "load_N_m", -0.02);

impl Demonstration {
    /// The experiment for this effect.
    pub fn of(card: &Card) -> Demonstration {
        let base = Demonstration::by_coordinate(card);
        let with = |motion, duration_s| Demonstration { motion, duration_s, ..base };
        match card.id {
            "viscous" | "quadratic-drag" => with(Motion::Triangle(60.0, 8.0), 8.0),
            "stribeck" => with(Motion::Triangle(6.0, 8.0), 8.0),
            "presliding" => with(Motion::Sine(0.1, 2.0), 4.0),
            "viscous-temperature" => {
                Demonstration { motion: Motion::Constant(60.0), also: &[WEIGHT, ("viscous", "viscous_N_m_s", 2e-4)], ..base }
            }
            "torque-ripple" => Demonstration { also: &[WEIGHT], ..base },
            "cable-spring" => {
                Demonstration { motion: Motion::Triangle(20.0, 16.0), duration_s: 16.0, abscissa: Abscissa::TotalAngle, ..base }
            }
            // The stand oscillates after each step: over the acceleration the plot would be a spiral.
            "compliance" => Demonstration { abscissa: Abscissa::Coordinate(Coordinate::History), ..with(Motion::Steps(2.0, 0.4), 0.8) },
            "backlash" => Demonstration { motion: Motion::Steps(0.5, 0.4), duration_s: 0.8, output: Output::Rate, ..base },
            "inductance" => Demonstration {
                motion: Motion::Steps(2.0, 0.4),
                duration_s: 0.8,
                output: Output::Current,
                abscissa: Abscissa::Coordinate(Coordinate::History),
                ..base
            },
            // The torque of a saturated motor is limited; the commanded acceleration stays below the limit.
            "magnetic-saturation" => Demonstration { motion: Motion::Sine(5.0, 1.0), duration_s: 2.0, output: Output::Current, ..base },
            "resistance-temperature" => Demonstration { output: Output::Voltage, ..base },
            "encoder-eccentricity" => {
                Demonstration { motion: Motion::Constant(20.0), duration_s: 1.0, output: Output::EncoderRate, ..base }
            }
            "sensor-lag" | "time-skew" => with(Motion::Sine(5.0, 0.25), 0.5),
            "rate-scale-nonlinearity" => with(Motion::Triangle(34.0, 8.0), 8.0),
            "rate-bias-temperature" => with(Motion::Constant(0.0), 60.0),
            "rate-bias" => with(Motion::Off, 4.0),
            "current-offset" => Demonstration { motion: Motion::Off, duration_s: 4.0, output: Output::Current, ..base },
            "current-scale" => Demonstration { output: Output::Current, ..base },
            _ => base,
        }
    }

    /// The experiment that suits domain and coordinate.
    fn by_coordinate(card: &Card) -> Demonstration {
        let shown = if card.domain == Domain::Measurement { Output::Rate } else { Output::Current };
        let base = |motion, duration_s| Demonstration {
            motion,
            duration_s,
            output: shown,
            abscissa: Abscissa::Coordinate(card.coordinate),
            also: &[],
        };
        match card.coordinate {
            Coordinate::Theta => base(Motion::Constant(2.0), 7.0),
            Coordinate::Omega => base(Motion::Triangle(20.0, 8.0), 8.0),
            Coordinate::Current => {
                let shown = if card.domain == Domain::Electrical { Output::Voltage } else { shown };
                Demonstration { output: shown, ..base(Motion::Sine(20.0, 1.0), 2.0) }
            }
            Coordinate::Temperature => Demonstration { also: &[WEIGHT], ..base(Motion::Constant(20.0), 60.0) },
            Coordinate::Time => base(Motion::Constant(10.0), 10.0),
            Coordinate::Acceleration => Demonstration { output: Output::Rate, ..base(Motion::Steps(2.0, 1.0), 2.0) },
            Coordinate::History => base(Motion::Sine(5.0, 2.0), 4.0),
        }
    }
}
