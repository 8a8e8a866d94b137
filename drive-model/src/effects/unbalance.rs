//! Unbalance: a sin(θ + φ): a mass off the axis of a tilted stand.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `unbalance`.
pub const CARD: Card = Card {
    id: "unbalance",
    title: "Unbalance",
    equation: "a sin(θ + φ): a mass off the axis of a tilted stand",
    room: Room::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "unbalance_N_m",
            unit: "N m",
            says: "amplitude a = m g r sin(tilt)",
            range: (0.0, f64::INFINITY),
            start: 0.0005,
            kind: Kind::Level,
            hidden: (0.001, 0.004),
        },
        Parameter {
            name: "unbalance_phase_rad",
            unit: "rad",
            says: "phase φ",
            range: (0.0, std::f64::consts::TAU),
            start: 0.0,
            kind: Kind::Phase,
            hidden: (0.0, std::f64::consts::TAU),
        },
    ],
    polar: true,
    screen: Screen::AtZero,
    family: "order-one",
    account: Account {
        what: "The centre of mass lies off the axis and the axis is not vertical: gravity pulls once per turn.",
        shows: "A ripple of order one, strongest at low rates; the platform comes to rest at the same angle.",
        experiment: "Slow whole turns; then tilt the stand and see the amplitude change.",
        looks_like: "Encoder eccentricity (grows with the rate); a g-sensitive rate sensor, where only that sensor sees the rate.",
        reference: "ISO 21940; effects.md",
    },
};

/// The law of `unbalance`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Unbalance;

impl<S: Scalar> Law<S> for Unbalance {
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
        a.torque += p[0] * (x.theta + p[1]).sin();
    }
}
