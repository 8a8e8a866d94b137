//! Cable spring: −k (θ − θ0).

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `cable-spring`.
pub const CARD: Card = Card {
    id: "cable-spring",
    title: "Cable spring",
    equation: "−k (θ − θ0)",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "cable_N_m_rad",
            unit: "N m/rad",
            description: "stiffness k",
            range: (0.0, f64::INFINITY),
            start: 5e-06,
            kind: ParameterKind::NonNegative,
            simulated_range: (5e-06, 2e-05),
        },
        Parameter {
            name: "cable_rest_rad",
            unit: "rad",
            description: "angle θ0 at which it is relaxed",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "The lead to the platform winds up and pulls back.",
        signature: "The torque needed grows with the angle turned, over many turns; the platform unwinds at rest.",
        experiment: "Turn many turns one way, stop, turn back.",
        similar: "A constant load over a short stretch of angle; warming, which grows with time too.",
        reference: "effects.md",
    },
};

/// The law of `cable-spring`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct CableSpring;

impl<S: Scalar> Law<S> for CableSpring {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.torque -= p[0] * (x.theta - p[1]);
    }
}
