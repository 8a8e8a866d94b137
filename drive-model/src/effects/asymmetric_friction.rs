//! Friction that differs by direction: torque −(d + e |ω|), in addition to viscous and Coulomb friction.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Rival, Scalar, StandRun};

/// The card of `asymmetric-friction`.
pub const CARD: Card = Card {
    id: "asymmetric-friction",
    title: "Friction that differs by direction",
    equation: "torque −(d + e |ω|), in addition to viscous and Coulomb friction",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "asymmetry_N_m",
            unit: "N m",
            description: "constant part d: half the difference of the two Coulomb levels",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0001,
            kind: ParameterKind::Signed,
            simulated_range: (0.0002, 0.0006),
        },
        Parameter {
            name: "asymmetry_N_m_s",
            unit: "N m s",
            description: "rate-dependent part e",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
    ],
    rests_on: &["coulomb"],
    family: "offset",
    rivals: &[Rival::by_rate_dependence("stribeck"), Rival::by_rate_dependence("quadratic-drag")],
    next_run: StandRun::HIGH_RATES,
    law: &AsymmetricFriction,
    description: Description {
        summary: "Friction is higher in one direction: worn screws, tilted brushes, a preloaded bearing.",
        signature: "Forward and backward runs at the same |rate| need different currents.",
        experiment: "Run the same staircase of rates forward and backward.",
        similar: "A constant load or an offset of the drive: equivalent while the rotor does not stick and e is not observable.",
        reference: "Janot, Gautier, Brunot, EMPS benchmark (2019): asymmetric friction of a worn screw",
    },
    ..Card::DEFAULT
};

/// The law of `asymmetric-friction`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct AsymmetricFriction;

impl<S: Scalar> Law<S> for AsymmetricFriction {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque -= p[0] + p[1] * x.omega.abs();
    }
}
