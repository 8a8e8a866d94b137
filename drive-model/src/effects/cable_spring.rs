//! Cable spring: torque −k (θ − θ0).

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Requirement, Scalar, Screening, Output, StandRun};

/// The card of `cable-spring`.
pub const CARD: Card = Card {
    id: "cable-spring",
    title: "Cable spring",
    equation: "torque −k (θ − θ0)",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "cable_N_m_rad",
            unit: "N m/rad",
            description: "stiffness k",
            range: (0.0, f64::INFINITY),
            start: 5e-06,
            kind: ParameterKind::NonNegative,
            simulated_range: (5e-06, 2e-05),
        },
        Parameter {
            name: "cable_rest_rad",
            unit: "rad",
            description: "angle θ0 at which the cable is relaxed",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
    ],
    requires: &[Requirement::Angle],
    screening: Screening::FirstAtZero,
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(20.0, 16.0),
        duration_s: 16.0,
        output: Output::Current,
        abscissa: Abscissa::TotalAngle,
        added: &[],
    }),
    law: &CableSpring,
    description: Description {
        summary: "The cable to the platform winds up and pulls back.",
        signature: "The required torque grows with the angle over many turns; the platform unwinds at rest.",
        experiment: "Turn many turns in one direction, stop, and turn back.",
        similar: "A constant load over a short range of angle; warming, which also grows with time.",
        reference: "Hooke's law for the torsion of the cable",
    },
    ..Card::DEFAULT
};

/// The law of `cable-spring`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct CableSpring;

impl<S: Scalar> Law<S> for CableSpring {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque -= p[0] * (x.theta - p[1]);
    }
}
