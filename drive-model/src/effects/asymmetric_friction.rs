//! Friction that differs by direction: −(d + e |ω|) on top of viscous and coulomb.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `asymmetric-friction`.
pub const CARD: Card = Card {
    id: "asymmetric-friction",
    title: "Friction that differs by direction",
    equation: "−(d + e |ω|) on top of viscous and coulomb",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "asymmetry_N_m",
            unit: "N m",
            description: "constant part d: half the difference of the dry levels",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0001,
            kind: ParameterKind::Signed,
            simulated_range: (0.0002, 0.0006),
        },
        Parameter {
            name: "asymmetry_N_m_s",
            unit: "N m s",
            description: "part e that grows with the rate",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "offset",
    description: Description {
        summary: "One direction runs harder than the other: worn screws, tilted brushes, a preloaded bearing.",
        signature: "Forward and backward runs at the same |rate| need different currents.",
        experiment: "The same staircase of rates forward and backward.",
        similar: "A constant load or an offset of the drive: the same while nothing sticks and e is not seen.",
        reference: "Janot, Gautier, Brunot, EMPS benchmark (2019): asymmetric friction of a worn screw",
    },
};

/// The law of `asymmetric-friction`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct AsymmetricFriction;

impl<S: Scalar> Law<S> for AsymmetricFriction {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.torque -= p[0] + p[1] * x.omega.abs();
    }
}
