//! Nonlinear scale factor of the rate sensor: reading ω (1 + k2 |ω| + k3 ω²).

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, Output, StandRun};

/// The card of `rate-scale-nonlinearity`.
pub const CARD: Card = Card {
    id: "rate-scale-nonlinearity",
    title: "Nonlinear scale factor of the rate sensor",
    equation: "reading ω (1 + k2 |ω| + k3 ω²)",
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
    requires: &[Requirement::ComparedRate],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(34.0, 8.0),
        duration_s: 8.0,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::Omega),
        added: &[],
    }),
    law: &RateScaleNonlinearity,
    description: Description {
        summary: "The scale factor of the rate sensor changes towards the end of its range.",
        signature: "Rate and derivative of the angle differ at high rates by more than in proportion.",
        experiment: "Run a staircase of rates up to full scale in both directions.",
        similar: "Quadratic drag, if there is no encoder.",
        reference: "IEEE Std 1431",
    },
    ..Card::DEFAULT
};

/// The law of `rate-scale-nonlinearity`; its parameters in the order of the card.
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
