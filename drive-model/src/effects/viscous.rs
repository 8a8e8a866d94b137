//! Viscous friction: −b ω.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `viscous`.
pub const CARD: Card = Card {
    id: "viscous",
    title: "Viscous friction",
    equation: "−b ω",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "viscous_N_m_s",
            unit: "N m s",
            description: "viscous coefficient b",
            range: (0.0, f64::INFINITY),
            start: 5e-05,
            kind: ParameterKind::NonNegative,
            simulated_range: (3e-05, 0.0002),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "Oil and eddy currents resist in proportion to the rate.",
        signature: "The steady rate bends away from the voltage as the rate grows; a coast-down is exponential.",
        experiment: "Coast down from a high rate with the drive open, or hold several rates and plot the torque against the rate.",
        similar: "A wrong motor constant: K² / R brakes in proportion to the rate too. The current tells them apart.",
        reference: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, §2",
    },
};

/// The law of `viscous`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Viscous;

impl<S: Scalar> Law<S> for Viscous {
    fn contribute(&self, p: &[S], _x: &Point<S>, a: &mut Contributions<S>) {
        a.viscous += p[0];
    }
}
