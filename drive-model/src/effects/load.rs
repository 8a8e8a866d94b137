//! Constant load: a constant torque.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `load`.
pub const CARD: Card = Card {
    id: "load",
    title: "Constant load",
    equation: "a constant torque",
    room: Room::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "load_N_m",
            unit: "N m",
            says: "torque on the rotor",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0001,
            kind: Kind::Signed,
            hidden: (0.0003, 0.001),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "offset",
    account: Account {
        what: "A weight on a cord, or an offset of the drive, turns the rotor always the same way.",
        shows: "The rate drifts at zero voltage, and forward and backward runs differ by the same torque at every rate.",
        experiment: "Hold the stand at zero voltage, then run the same rates forward and backward.",
        looks_like: "Friction that differs by direction, as long as nothing sticks; an offset of the current sensor.",
        reference: "theory.md §4; effects.md",
    },
};

/// The law of `load`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Load;

impl<S: Scalar> Law<S> for Load {
    fn act(&self, p: &[S], _x: &Point<S>, a: &mut Acts<S>) {
        a.torque += p[0];
    }
}
