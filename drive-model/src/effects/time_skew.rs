//! A late channel: one channel is late by a constant time (the rate, unless the model says another).

use crate::{Description, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Domain, Scalar, Screen};

/// The card of `time-skew`.
pub const CARD: Card = Card {
    id: "time-skew",
    title: "A late channel",
    equation: "one channel is late by a constant time (the rate, unless the model says another)",
    domain: Domain::Measurement,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "skew_s",
            unit: "s",
            description: "delay",
            range: (0.0, 0.5),
            start: 0.002,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.003, 0.012),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "late-rate",
    description: Description {
        summary: "One channel was stamped late: a filter, a bus, another clock.",
        signature: "That channel is off in proportion to its slope.",
        experiment: "Sharp steps, sampled fast.",
        similar: "The lag of a slow sensor, which rounds corners.",
        reference: "effects.md",
    },
};

/// The law of `time-skew`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct TimeSkew;

impl<S: Scalar> Law<S> for TimeSkew {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.skew_s = Some(p[0]);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
