//! Coulomb (dry) friction: Coulomb torque c: holds the rotor while |torque| ≤ c, otherwise −c sign(ω).

use crate::{Card, Compensation, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Rival, Scalar, StandRun};

/// Separates friction from a lost voltage.
const FRICTION_OR_VOLTAGE: &str = "Record the current together with the voltage (i_A): friction needs a torque and therefore a current, a lost voltage does not. Apply small voltages, at which the rotor sticks";

/// The card of `coulomb`.
pub const CARD: Card = Card {
    id: "coulomb",
    title: "Coulomb (dry) friction",
    equation: "Coulomb torque c: holds the rotor while |torque| ≤ c, otherwise −c sign(ω)",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "coulomb_N_m",
            unit: "N m",
            description: "Coulomb torque c",
            range: (0.0, f64::INFINITY),
            start: 0.001,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.001, 0.004),
        },
    ],
    rivals: &[
        Rival { effect: "brush-drop", separation: FRICTION_OR_VOLTAGE, run: StandRun::BREAKAWAY, change_of_stand: None },
        Rival { effect: "dead-time", separation: FRICTION_OR_VOLTAGE, run: StandRun::BREAKAWAY, change_of_stand: None },
        Rival::by_rate_dependence("asymmetric-friction"),
        Rival::by_rate_dependence("load"),
        Rival::by_rate_dependence("stribeck"),
        Rival::by_rate_dependence("quadratic-drag"),
    ],
    next_run: StandRun::BREAKAWAY,
    compensation: Some(Compensation::CoulombTorque),
    limited_at_zero: &[0],
    dry_friction: Some(0),
    law: &Coulomb,
    description: Description {
        summary: "Brushes and bearings rub with a torque that is independent of the rate, opposes the motion, and holds the rotor at rest.",
        signature: "The residual jumps where the rate changes sign; the rotor stays at rest under a small voltage; a coast-down is a straight line that ends in finite time.",
        experiment: "Let the rate pass through zero slowly in both directions: a slow sine or a staircase around zero.",
        similar: "An offset of the drive, if the rate never changes sign; a brush drop, if the current is not measured.",
        reference: "Coulomb, Théorie des machines simples (1785)",
    },
    ..Card::DEFAULT
};

/// The law of `coulomb`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Coulomb;

impl<S: Scalar> Law<S> for Coulomb {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.coulomb_torque += p[0];
    }
}
