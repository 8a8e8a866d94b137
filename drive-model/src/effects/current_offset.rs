//! Offset of the current sensor: reading i + o.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, Output};

/// The card of `current-offset`.
pub const CARD: Card = Card {
    id: "current-offset",
    title: "Offset of the current sensor",
    equation: "reading i + o",
    domain: Domain::Measurement,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "current_offset_A",
            unit: "A",
            description: "offset o",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.01, 0.05),
        },
    ],
    requires: &[Requirement::ComparedCurrent],
    demonstration: Some(Demonstration {
        motion: Motion::Off,
        duration_s: 4.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    law: &CurrentOffset,
    description: Description {
        summary: "The current sensor reads a current where none flows.",
        signature: "The current channel is off by a constant.",
        experiment: "Record some seconds with the drive off.",
        similar: "A constant load.",
        reference: "Texas Instruments INA240 data sheet (SBOS662), offset",
    },
    ..Card::DEFAULT
};

/// The law of `current-offset`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct CurrentOffset;

impl<S: Scalar> Law<S> for CurrentOffset {
    fn measure(&self, p: &[S], _x: &Point<S>, y: &mut Reading<S>) {
        y.current += p[0];
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
