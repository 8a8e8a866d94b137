//! Scale factor of the rate sensor: rate seen = (1 + k) ω.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `rate-scale`.
pub const CARD: Card = Card {
    id: "rate-scale",
    title: "Scale factor of the rate sensor",
    equation: "rate seen = (1 + k) ω",
    domain: Domain::Measurement,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "rate_scale",
            unit: "1",
            description: "relative error k of the scale factor",
            range: (-0.5, 0.5),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.01, 0.05),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "rate-scale",
    description: Description {
        summary: "The rate sensor shows a fixed percentage too much or too little, against the encoder.",
        signature: "Rate and derivative of the angle differ in proportion to the rate.",
        experiment: "Whole turns at several rates, encoder beside rate sensor.",
        similar: "A wrong motor constant, where there is no encoder.",
        reference: "IEEE Std 528; theory.md §4",
    },
};

/// The law of `rate-scale`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct RateScale;

impl<S: Scalar> Law<S> for RateScale {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * x.omega;
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
