//! Friction that differs by direction: −(d + e |ω|) on top of viscous and coulomb.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `asymmetric-friction`.
pub const CARD: Card = Card {
    id: "asymmetric-friction",
    title: "Friction that differs by direction",
    equation: "−(d + e |ω|) on top of viscous and coulomb",
    room: Room::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "asymmetry_N_m",
            unit: "N m",
            says: "constant part d: half the difference of the dry levels",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0001,
            kind: Kind::Signed,
            hidden: (0.0002, 0.0006),
        },
        Parameter {
            name: "asymmetry_N_m_s",
            unit: "N m s",
            says: "part e that grows with the rate",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: Kind::Signed,
            hidden: (0.0, 0.0),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "offset",
    account: Account {
        what: "One direction runs harder than the other: worn screws, tilted brushes, a preloaded bearing.",
        shows: "Forward and backward runs at the same |rate| need different currents.",
        experiment: "The same staircase of rates forward and backward.",
        looks_like: "A constant load or an offset of the drive: the same while nothing sticks and e is not seen.",
        reference: "Janot, Gautier, Brunot, EMPS benchmark (2019): asymmetric friction of a worn screw",
    },
};

/// The law of `asymmetric-friction`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct AsymmetricFriction;

impl<S: Scalar> Law<S> for AsymmetricFriction {
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
        a.torque -= p[0] + p[1] * x.omega.abs();
    }
}
