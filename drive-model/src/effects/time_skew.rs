//! Delayed channel: one channel is delayed by a constant time (the rate, unless the model names another).

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Requirement, Scalar, Output, StandRun, Structure};

/// The card of `time-skew`.
pub const CARD: Card = Card {
    id: "time-skew",
    title: "Delayed channel",
    equation: "one channel is delayed by a constant time (the rate, unless the model names another)",
    domain: Domain::Measurement,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "skew_s",
            unit: "s",
            description: "delay",
            range: (0.0, 0.5),
            start: 0.002,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.003, 0.012),
        },
    ],
    requires: &[Requirement::SimulatedMotion],
    family: "late-rate",
    next_run: StandRun::MULTISINE,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(5.0, 0.25),
        duration_s: 0.5,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::Acceleration),
        added: &[],
    }),
    limited_at_zero: &[0],
    law: &TimeSkew,
    description: Description {
        summary: "One channel has late time stamps: a filter, a bus, another clock.",
        signature: "The error of this channel is proportional to its slope.",
        experiment: "Apply sharp steps, sampled fast.",
        similar: "The lag of a slow sensor, which rounds corners; an input that acts later than its column says, by the same time.",
        reference: "Ljung, System Identification (1999), §4.2: input delay",
    },
    ..Card::DEFAULT
};

/// The law of `time-skew`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct TimeSkew;

impl<S: Scalar> Law<S> for TimeSkew {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.skew_s = Some(p[0]);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
