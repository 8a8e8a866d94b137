//! Viscous friction: torque −b ω.

use crate::{Abscissa, Card, Compensation, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Rival, Scalar, Output, StandRun};

/// The card of `viscous`.
pub const CARD: Card = Card {
    id: "viscous",
    title: "Viscous friction",
    equation: "torque −b ω",
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
    rivals: &[
        Rival::by_rate_dependence("coulomb"),
        Rival::by_rate_dependence("asymmetric-friction"),
        Rival::by_rate_dependence("load"),
        Rival::by_rate_dependence("stribeck"),
        Rival::by_rate_dependence("quadratic-drag"),
    ],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(60.0, 8.0),
        duration_s: 8.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Omega),
        added: &[],
    }),
    compensation: Some(Compensation::ViscousCoefficient),
    law: &Viscous,
    description: Description {
        summary: "Oil and eddy currents oppose the motion in proportion to the rate.",
        signature: "The steady rate falls below proportionality to the voltage; a coast-down is exponential.",
        experiment: "Coast down from a high rate with the drive open, or hold several rates and plot torque over rate.",
        similar: "A wrong motor constant: K²/R also brakes in proportion to the rate. A current measurement separates the two.",
        reference: "Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083, §2",
    },
    ..Card::DEFAULT
};

/// The law of `viscous`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Viscous;

impl<S: Scalar> Law<S> for Viscous {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.viscous += p[0];
    }
}
