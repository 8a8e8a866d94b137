//! Bias of the rate sensor: rate seen = ω + β.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `rate-bias`.
pub const CARD: Card = Card {
    id: "rate-bias",
    title: "Bias of the rate sensor",
    equation: "rate seen = ω + β",
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
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "The rate sensor shows a rate at rest.",
        signature: "The rate channel is off by a constant, also at rest.",
        experiment: "Stand still for some seconds.",
        similar: "A constant load, where there is no encoder.",
        reference: "IEEE Std 528",
    },
};

/// The law of `rate-bias`; its parameters in the card's order.
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
