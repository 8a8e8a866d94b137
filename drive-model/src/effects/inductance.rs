//! Winding inductance: L di/dt = u − R i − K ω.

use crate::{Abscissa, Card, Compensation, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Requirement, Scalar, Screening, Output, StandRun, Structure};

/// The card of `inductance`.
pub const CARD: Card = Card {
    id: "inductance",
    title: "Winding inductance",
    equation: "L di/dt = u − R i − K ω",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "inductance_H",
            unit: "H",
            description: "terminal inductance L",
            range: (1e-06, 1.0),
            start: 0.002,
            kind: ParameterKind::Positive,
            simulated_range: (0.005, 0.025),
        },
    ],
    requires: &[Requirement::Voltage, Requirement::SimulatedMotion],
    screening: Screening::WindingTimeConstants(&[0.5, 3.0]),
    next_run: StandRun::SHARP_STEPS,
    demonstration: Some(Demonstration {
        motion: Motion::VoltageSteps(2.0, 0.4),
        duration_s: 0.8,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::History),
        added: &[],
    }),
    compensation: Some(Compensation::WindingTimeConstant),
    law: &Inductance,
    description: Description {
        summary: "The current cannot jump: it rises with the electrical time constant L/R.",
        signature: "After every voltage step the current lags behind the model, and with it the torque: without a current column, only the rate shows it.",
        experiment: "Apply steps or a PRBS of the voltage, sampled faster than L/R.",
        similar: "A filter of the current sensor; a delayed channel.",
        reference: "Leonhard, Control of Electrical Drives (2001), ch. 5",
    },
    ..Card::DEFAULT
};

/// The law of `inductance`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Inductance;

impl<S: Scalar> Law<S> for Inductance {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.inductance_H = Some(p[0]);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
