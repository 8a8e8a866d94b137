//! Lag of the rate sensor: the rate channel passes a first-order lag.

use crate::{Description, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Domain, Scalar, Screen};

/// The card of `sensor-lag`.
pub const CARD: Card = Card {
    id: "sensor-lag",
    title: "Lag of the rate sensor",
    equation: "the rate channel passes a first-order lag",
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
    polar: false,
    screen: Screen::Probe,
    family: "late-rate",
    description: Description {
        summary: "The rate sensor has a finite bandwidth and shows the rate late and smoothed.",
        signature: "The rate channel is off in proportion to the acceleration, and to nothing else.",
        experiment: "Steps of the voltage, or a sweep.",
        similar: "A late channel (time skew), which keeps sharp corners sharp; shaft compliance.",
        reference: "theory.md §4; IEEE Std 528",
    },
};

/// The law of `sensor-lag`; its parameters in the card's order.
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
