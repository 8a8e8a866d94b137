//! Quadratic drag: torque −q ω |ω|.

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Rival, Scalar, Output, StandRun};

/// The card of `quadratic-drag`.
pub const CARD: Card = Card {
    id: "quadratic-drag",
    title: "Quadratic drag",
    equation: "torque −q ω |ω|",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "drag_N_m_s2",
            unit: "N m s²",
            description: "coefficient q",
            range: (0.0, f64::INFINITY),
            start: 1e-06,
            kind: ParameterKind::NonNegative,
            simulated_range: (1e-06, 5e-06),
        },
    ],
    rivals: &[Rival {
        effect: "magnetic-saturation",
        separation: "Drag depends on the rate, saturation on the current: accelerate hard at low rates, and hold high rates",
        run: StandRun::VARYING_CURRENT,
        change_of_stand: None,
    }],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(60.0, 8.0),
        duration_s: 8.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Omega),
        added: &[],
    }),
    law: &QuadraticDrag,
    description: Description {
        summary: "The platform accelerates air: the drag grows with the square of the rate.",
        signature: "At high rates the rate falls below the straight line of rate over voltage.",
        experiment: "Run several high rates in both directions, and a coast-down from the highest.",
        similar: "Viscous friction over a narrow range of rates; magnetic saturation at high current.",
        reference: "Schlichting, Boundary-Layer Theory, rotating disc",
    },
    ..Card::DEFAULT
};

/// The law of `quadratic-drag`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticDrag;

impl<S: Scalar> Law<S> for QuadraticDrag {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque -= p[0] * x.omega * x.omega.abs();
    }
}
