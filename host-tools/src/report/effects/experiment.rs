//! Which experiment shows an effect.
//!
//! Nearly all are made with the motion held by a stiff loop, so that the same motion is made with and without the effect and the current
//! or the voltage says what it costs; steps of the voltage are made open.

use std::f64::consts::TAU;

use drive_model::{Card, Coordinate, Domain};

/// What the stand is made to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion {
    /// The drive is off.
    Off,
    /// One rate, held.
    Constant(f64),
    /// Rates from 0 up, down through zero and back, evenly: amplitude and period.
    Triangle(f64, f64),
    /// A sine of the rate: amplitude and period.
    Sine(f64, f64),
    /// Steps of the voltage up and down: amplitude and period.
    Steps(f64, f64),
}

impl Motion {
    /// The rate that is held at `t_s`, rad/s; `None`: the drive is open.
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

    /// The voltage at `t_s` where the drive is open, V.
    pub fn open_V(self, t_s: f64) -> f64 {
        match self {
            // A quarter of the period first, so that the steps lie about zero rate.
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

    /// In words.
    pub fn says(self) -> String {
        match self {
            Motion::Off => "the drive is off".to_owned(),
            Motion::Constant(0.0) => "the loop holds the stand still".to_owned(),
            Motion::Constant(rate) => format!("the loop holds {rate} rad/s"),
            Motion::Triangle(rate, period) => {
                format!("the loop leads the rate evenly between +{rate} and −{rate} rad/s, {period} s a round")
            }
            Motion::Sine(rate, period) => format!("the loop leads the rate along a sine of {rate} rad/s with a period of {period} s"),
            Motion::Steps(volt, period) => format!("the voltage steps between +{volt} and −{volt} V, {period} s a round"),
        }
    }
}

/// What is looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    /// The measured current.
    Current,
    /// The voltage that the loop asks for.
    Voltage,
    /// The rate sensor.
    Rate,
    /// The rate by the encoder, over 20 ms.
    EncoderRate,
}

impl Shown {
    /// Name and unit for an axis.
    pub fn label(self) -> (&'static str, &'static str) {
        match self {
            Shown::Current => ("current", "A"),
            Shown::Voltage => ("voltage asked for", "V"),
            Shown::Rate => ("rate by the rate sensor", "rad/s"),
            Shown::EncoderRate => ("rate by the encoder", "rad/s"),
        }
    }
}

/// The coordinate of the lower plot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// As the card says.
    Coordinate(Coordinate),
    /// The angle over many turns.
    ManyTurns,
}

/// An experiment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// What the stand does.
    pub motion: Motion,
    /// For how long, s.
    pub seconds: f64,
    /// What is looked at.
    pub shown: Shown,
    /// Over what the difference is drawn.
    pub over: Over,
    /// What both stands have besides: effect, parameter, value.
    pub besides: &'static [(&'static str, &'static str, f64)],
}

/// A weight on a cord: a current flows, and the winding warms.
const WEIGHT: (&str, &str, f64) = ("load", "load_N_m", -0.02);

impl Experiment {
    /// The experiment that shows this effect.
    pub fn of(card: &Card) -> Experiment {
        let base = Experiment::by_coordinate(card);
        let with = |motion, seconds| Experiment { motion, seconds, ..base };
        match card.id {
            "viscous" | "quadratic-drag" => with(Motion::Triangle(60.0, 8.0), 8.0),
            "stribeck" => with(Motion::Triangle(6.0, 8.0), 8.0),
            "presliding" => with(Motion::Sine(0.1, 2.0), 4.0),
            "viscous-temperature" => {
                Experiment { motion: Motion::Constant(60.0), besides: &[WEIGHT, ("viscous", "viscous_N_m_s", 2e-4)], ..base }
            }
            "torque-ripple" => Experiment { besides: &[WEIGHT], ..base },
            "cable-spring" => Experiment { motion: Motion::Triangle(20.0, 16.0), seconds: 16.0, over: Over::ManyTurns, ..base },
            // It rings after each step: over the acceleration that would be a spiral.
            "compliance" => Experiment { over: Over::Coordinate(Coordinate::History), ..with(Motion::Steps(2.0, 0.4), 0.8) },
            "backlash" => Experiment { motion: Motion::Steps(0.5, 0.4), seconds: 0.8, shown: Shown::Rate, ..base },
            "inductance" => Experiment {
                motion: Motion::Steps(2.0, 0.4),
                seconds: 0.8,
                shown: Shown::Current,
                over: Over::Coordinate(Coordinate::History),
                ..base
            },
            // A saturated motor has a most torque: what is asked for stays below it.
            "magnetic-saturation" => Experiment { motion: Motion::Sine(5.0, 1.0), seconds: 2.0, shown: Shown::Current, ..base },
            "resistance-temperature" => Experiment { shown: Shown::Voltage, ..base },
            "encoder-eccentricity" => Experiment { motion: Motion::Constant(20.0), seconds: 1.0, shown: Shown::EncoderRate, ..base },
            "sensor-lag" | "time-skew" => with(Motion::Sine(5.0, 0.25), 0.5),
            "rate-scale-nonlinearity" => with(Motion::Triangle(34.0, 8.0), 8.0),
            "rate-bias-temperature" => with(Motion::Constant(0.0), 60.0),
            "rate-bias" => with(Motion::Off, 4.0),
            "current-offset" => Experiment { motion: Motion::Off, seconds: 4.0, shown: Shown::Current, ..base },
            "current-scale" => Experiment { shown: Shown::Current, ..base },
            _ => base,
        }
    }

    /// What suits room and coordinate.
    fn by_coordinate(card: &Card) -> Experiment {
        let shown = if card.domain == Domain::Measurement { Shown::Rate } else { Shown::Current };
        let base = |motion, seconds| Experiment { motion, seconds, shown, over: Over::Coordinate(card.coordinate), besides: &[] };
        match card.coordinate {
            Coordinate::Theta => base(Motion::Constant(2.0), 7.0),
            Coordinate::Omega => base(Motion::Triangle(20.0, 8.0), 8.0),
            Coordinate::Current => {
                let shown = if card.domain == Domain::Electrical { Shown::Voltage } else { shown };
                Experiment { shown, ..base(Motion::Sine(20.0, 1.0), 2.0) }
            }
            Coordinate::Temperature => Experiment { besides: &[WEIGHT], ..base(Motion::Constant(20.0), 60.0) },
            Coordinate::Time => base(Motion::Constant(10.0), 10.0),
            Coordinate::Acceleration => Experiment { shown: Shown::Rate, ..base(Motion::Steps(2.0, 1.0), 2.0) },
            Coordinate::History => base(Motion::Sine(5.0, 2.0), 4.0),
        }
    }
}
