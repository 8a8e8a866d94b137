//! Load step: a constant torque from a time t0 on.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Rival, Scalar, Screening, StandRun};

/// Separates a single event from a repeatable cause.
const ONCE_OR_REPEATED: &str = "Repeat the same profile: a single event does not recur at the same time";

/// The card of `load-step`.
pub const CARD: Card = Card {
    id: "load-step",
    title: "Load step",
    equation: "a constant torque from a time t0 on",
    domain: Domain::Torque,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "load_step_N_m",
            unit: "N m",
            description: "torque after t0",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0003,
            kind: ParameterKind::Signed,
            simulated_range: (0.0003, 0.001),
        },
        Parameter {
            name: "load_from_s",
            unit: "s",
            description: "time t0 of the step",
            range: (0.0, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::EventTime,
            simulated_range: (5.0, 25.0),
        },
    ],
    screening: Screening::EventTimes(24),
    rivals: &[
        Rival { effect: "cable-spring", separation: ONCE_OR_REPEATED, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "viscous-temperature", separation: ONCE_OR_REPEATED, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "resistance-temperature", separation: ONCE_OR_REPEATED, run: StandRun::STEPS, change_of_stand: None },
    ],
    law: &LoadStep,
    description: Description {
        summary: "Something began to rub, or a weight was added, during the record.",
        signature: "The model fits until t0 and is off by a constant torque afterwards.",
        experiment: "Repeat the same profile twice and compare.",
        similar: "Slow warming; a cable that winds up.",
        reference: "Basseville, Nikiforov, Detection of Abrupt Changes (1993)",
    },
    ..Card::DEFAULT
};

/// The law of `load-step`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct LoadStep;

impl<S: Scalar> Law<S> for LoadStep {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque += p[0] * since(p[1], x.from_s, x.to_s);
    }
}

/// The part of [from, to) that lies after `moment`; its derivative by the moment is exact.
fn since<S: Scalar>(moment: S, from_s: f64, to_s: f64) -> S {
    if moment <= from_s {
        S::one()
    } else if moment >= to_s {
        S::zero()
    } else {
        (-moment + to_s) / (to_s - from_s)
    }
}
