//! Constant load: a constant torque.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `load`.
pub const CARD: Card = Card {
    id: "load",
    title: "Constant load",
    equation: "a constant torque",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "load_N_m",
            unit: "N m",
            description: "torque on the rotor",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0001,
            kind: ParameterKind::Signed,
            simulated_range: (0.0003, 0.001),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "offset",
    description: Description {
        summary: "A weight on a cord, or an offset of the drive, turns the rotor always the same way.",
        signature: "The rate drifts at zero voltage, and forward and backward runs differ by the same torque at every rate.",
        experiment: "Hold the stand at zero voltage, then run the same rates forward and backward.",
        similar: "Friction that differs by direction, as long as nothing sticks; an offset of the current sensor.",
        reference: "theory.md §4; effects.md",
    },
};

/// The law of `load`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Load;

impl<S: Scalar> Law<S> for Load {
    fn contribute(&self, p: &[S], _x: &Point<S>, a: &mut Contributions<S>) {
        a.torque += p[0];
    }
}
