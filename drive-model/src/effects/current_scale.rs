//! Scale of the current sensor: reading (1 + k) i.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, Output, StandRun};

/// The card of `current-scale`.
pub const CARD: Card = Card {
    id: "current-scale",
    title: "Scale of the current sensor",
    equation: "reading (1 + k) i",
    domain: Domain::Measurement,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "current_scale",
            unit: "1",
            description: "relative error k",
            range: (-0.5, 0.5),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.02, 0.06),
        },
    ],
    requires: &[Requirement::ComparedCurrent],
    family: "current-scale",
    next_run: StandRun::VARYING_CURRENT,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(20.0, 1.0),
        duration_s: 2.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Current),
        added: &[],
    }),
    law: &CurrentScale,
    description: Description {
        summary: "The current sensor reads a fixed percentage too much or too little: a shunt off its nominal value.",
        signature: "The error of the current channel is proportional to the current.",
        experiment: "Measure a known resistor in place of the motor.",
        similar: "A wrong resistance together with a wrong motor constant: equivalent without an independent torque measurement.",
        reference: "Texas Instruments INA240 data sheet (SBOS662), gain error",
    },
    ..Card::DEFAULT
};

/// The law of `current-scale`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct CurrentScale;

impl<S: Scalar> Law<S> for CurrentScale {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.current += p[0] * x.current;
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
