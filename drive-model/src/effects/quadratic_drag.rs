//! Quadratic drag: −q ω |ω|.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `quadratic-drag`.
pub const CARD: Card = Card {
    id: "quadratic-drag",
    title: "Quadratic drag",
    equation: "−q ω |ω|",
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
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "Air is thrown off the platform: its resistance grows with the square of the rate.",
        signature: "At high rates the drive falls behind the straight line of rate against voltage.",
        experiment: "Several high rates in both directions; a coast-down from the highest.",
        similar: "Viscous friction over a narrow range of rates; magnetic saturation at high current.",
        reference: "Prandtl/Schlichting, Boundary-Layer Theory, rotating disc",
    },
};

/// The law of `quadratic-drag`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct QuadraticDrag;

impl<S: Scalar> Law<S> for QuadraticDrag {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.torque -= p[0] * x.omega * x.omega.abs();
    }
}
