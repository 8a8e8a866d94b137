//! Cable spring: −k (θ − θ0).

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `cable-spring`.
pub const CARD: Card = Card {
    id: "cable-spring",
    title: "Cable spring",
    equation: "−k (θ − θ0)",
    room: Room::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "cable_N_m_rad",
            unit: "N m/rad",
            says: "stiffness k",
            range: (0.0, f64::INFINITY),
            start: 5e-06,
            kind: Kind::Level,
            hidden: (5e-06, 2e-05),
        },
        Parameter {
            name: "cable_rest_rad",
            unit: "rad",
            says: "angle θ0 at which it is relaxed",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: Kind::Signed,
            hidden: (0.0, 0.0),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    account: Account {
        what: "The lead to the platform winds up and pulls back.",
        shows: "The torque needed grows with the angle turned, over many turns; the platform unwinds at rest.",
        experiment: "Turn many turns one way, stop, turn back.",
        looks_like: "A constant load over a short stretch of angle; warming, which grows with time too.",
        reference: "effects.md",
    },
};

/// The law of `cable-spring`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct CableSpring;

impl<S: Scalar> Law<S> for CableSpring {
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
        a.torque -= p[0] * (x.theta - p[1]);
    }
}
