//! Lag of the rate sensor: the rate channel passes a first-order low-pass; so does the angle of a sensor under test.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Requirement, Rival, Scalar, Output, StandRun, Structure};

/// The card of `sensor-lag`.
pub const CARD: Card = Card {
    id: "sensor-lag",
    title: "Lag of the rate sensor",
    equation: "the rate channel, or an angle sensor under test, passes a first-order low-pass",
    domain: Domain::Measurement,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "lag_s",
            unit: "s",
            description: "time constant",
            range: (0.0, 0.5),
            start: 0.002,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.003, 0.01),
        },
    ],
    requires: &[Requirement::RateOrSensorAngle, Requirement::SimulatedMotion],
    family: "late-rate",
    rivals: &[Rival {
        effect: "time-skew",
        separation: "A slow sensor rounds corners and attenuates high frequencies; a delayed channel is only shifted. Excite many frequencies at once",
        run: StandRun::MULTISINE,
        change_of_stand: None,
    }],
    next_run: StandRun::MULTISINE,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(5.0, 0.25),
        duration_s: 0.5,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::Acceleration),
        added: &[],
    }),
    limited_at_zero: &[0],
    law: &SensorLag,
    description: Description {
        summary: "The rate sensor has a finite bandwidth: its reading is delayed and smoothed. So is that of a tracking converter of a resolver.",
        signature: "The error of the rate channel is proportional to the acceleration.",
        experiment: "Apply voltage steps or a sweep.",
        similar: "A delayed channel, which keeps sharp corners; shaft compliance.",
        reference: "IEEE Std 528",
    },
    ..Card::DEFAULT
};

/// The law of `sensor-lag`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct SensorLag;

impl<S: Scalar> Law<S> for SensorLag {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.lag_s = Some(p[0]);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
