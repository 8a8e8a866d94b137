//! Cubic drag: torque −c ω³. An effect that only this test has.

use drive_model::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Scalar};

/// The card of `cubic-drag`.
pub const CARD: Card = Card {
    id: "cubic-drag",
    title: "Cubic drag",
    equation: "torque −c ω³",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[Parameter {
        name: "cubic_N_m_s3",
        unit: "N m s³",
        description: "coefficient c",
        range: (0.0, f64::INFINITY),
        start: 1e-7,
        kind: ParameterKind::NonNegative,
        simulated_range: (2e-7, 4e-7),
    }],
    law: &CubicDrag,
    description: Description {
        summary: "A drag that grows with the third power of the rate.",
        signature: "The rate falls below that of quadratic drag at high rates.",
        experiment: "Run several high rates in both directions.",
        similar: "Quadratic drag over a narrow range of rates.",
        reference: "none: an effect of a test",
    },
    ..Card::DEFAULT
};

/// The law of `cubic-drag`.
#[derive(Debug, Clone, Copy)]
pub struct CubicDrag;

impl<S: Scalar> Law<S> for CubicDrag {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque -= p[0] * x.omega * x.omega * x.omega;
    }
}
