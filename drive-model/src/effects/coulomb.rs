//! Coulomb (dry) friction: a dry level c: holds the rotor while |torque| ≤ c, else −c sign ω.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `coulomb`.
pub const CARD: Card = Card {
    id: "coulomb",
    title: "Coulomb (dry) friction",
    equation: "a dry level c: holds the rotor while |torque| ≤ c, else −c sign ω",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "coulomb_N_m",
            unit: "N m",
            description: "dry level c",
            range: (0.0, f64::INFINITY),
            start: 0.001,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.001, 0.004),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "Brushes and bearings rub with a torque that does not depend on the rate but always opposes it, and that holds the rotor at rest.",
        signature: "The residual jumps where the rate changes sign; the rotor stays at rest under a small voltage; a coast-down ends in finite time on a straight line.",
        experiment: "Let the rate pass through zero slowly in both directions: a slow sine or a staircase around zero.",
        similar: "An offset of the drive, as long as the rate never changes sign; a brush drop, as long as the current is not measured.",
        reference: "Coulomb, Théorie des machines simples (1785); theory.md §4",
    },
};

/// The law of `coulomb`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Coulomb;

impl<S: Scalar> Law<S> for Coulomb {
    fn contribute(&self, p: &[S], _x: &Point<S>, a: &mut Contributions<S>) {
        a.coulomb_torque += p[0];
    }
}
