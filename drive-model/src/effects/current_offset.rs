//! Offset of the current sensor: i seen = i + o.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `current-offset`.
pub const CARD: Card = Card {
    id: "current-offset",
    title: "Offset of the current sensor",
    equation: "i seen = i + o",
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
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "The current sensor shows a current where none flows.",
        signature: "The current channel is off by a constant.",
        experiment: "Log some seconds with the drive off.",
        similar: "A constant load.",
        reference: "Texas Instruments INA240 data sheet (SBOS662), offset",
    },
};

/// The law of `current-offset`; its parameters in the card's order.
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
