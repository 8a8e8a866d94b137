//! Constant load: a constant torque.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Rival, Scalar, StandRun};

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
    family: "offset",
    rivals: &[
        Rival {
            effect: "asymmetric-friction",
            separation: "A load is the same torque at every rate; direction-dependent friction can also grow with the rate. Hold low and high rates in both directions. If only the constant part remains, the two are the same torque, and only an inspection of the stand can decide",
            run: StandRun::HIGH_RATES,
            change_of_stand: Some("Remove the weight, the cable or the tilt of the axis that may cause a load, and record the same run again. A load changes; the friction stays"),
        },
        Rival::by_rate_dependence("stribeck"),
        Rival::by_rate_dependence("quadratic-drag"),
    ],
    next_run: StandRun::HIGH_RATES,
    law: &Load,
    description: Description {
        summary: "A weight on a cord, or an offset of the drive, turns the rotor in one direction.",
        signature: "The rate drifts at zero voltage; forward and backward runs differ by the same torque at every rate.",
        experiment: "Hold zero voltage, then run the same rates forward and backward.",
        similar: "Friction that differs by direction, if the rotor does not stick; an offset of the current sensor.",
        reference: "Equation of motion of a rigid rotor",
    },
    ..Card::DEFAULT
};

/// The law of `load`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Load;

impl<S: Scalar> Law<S> for Load {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.torque += p[0];
    }
}
