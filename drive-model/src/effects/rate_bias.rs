//! Bias of the rate sensor: reading ω + β.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, Output};

/// The card of `rate-bias`.
pub const CARD: Card = Card {
    id: "rate-bias",
    title: "Bias of the rate sensor",
    equation: "reading ω + β",
    domain: Domain::Measurement,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "rate_bias_rad_s",
            unit: "rad/s",
            description: "bias β",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.02, 0.08),
        },
    ],
    requires: &[Requirement::ComparedRate],
    demonstration: Some(Demonstration {
        motion: Motion::Off,
        duration_s: 4.0,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    law: &RateBias,
    description: Description {
        summary: "The rate sensor reads a rate at rest.",
        signature: "The rate channel is off by a constant, also at rest.",
        experiment: "Record some seconds at rest.",
        similar: "A constant load, if there is no encoder.",
        reference: "IEEE Std 528",
    },
    ..Card::DEFAULT
};

/// The law of `rate-bias`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct RateBias;

impl<S: Scalar> Law<S> for RateBias {
    fn measure(&self, p: &[S], _x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0];
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
