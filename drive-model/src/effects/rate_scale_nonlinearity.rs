//! Nonlinear scale factor of the rate sensor: rate seen = ω (1 + k2 |ω| + k3 ω²).

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `rate-scale-nonlinearity`.
pub const CARD: Card = Card {
    id: "rate-scale-nonlinearity",
    title: "Nonlinear scale factor of the rate sensor",
    equation: "rate seen = ω (1 + k2 |ω| + k3 ω²)",
    domain: Domain::Measurement,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "rate_scale_2_s",
            unit: "s",
            description: "coefficient k2",
            range: (-0.1, 0.1),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
        Parameter {
            name: "rate_scale_3_s2",
            unit: "s²",
            description: "coefficient k3",
            range: (-0.01, 0.01),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (3e-05, 0.0001),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "The rate sensor bends towards the end of its range.",
        signature: "Rate and derivative of the angle differ at high rates, by more than in proportion.",
        experiment: "A staircase of rates up to full scale, in both directions.",
        similar: "Quadratic drag, where there is no encoder.",
        reference: "IEEE Std 1431; effects.md",
    },
};

/// The law of `rate-scale-nonlinearity`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct RateScaleNonlinearity;

impl<S: Scalar> Law<S> for RateScaleNonlinearity {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += x.omega * (p[0] * x.omega.abs() + p[1] * x.omega * x.omega);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
