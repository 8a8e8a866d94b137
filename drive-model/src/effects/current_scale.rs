//! Scale of the current sensor: i seen = (1 + k) i.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `current-scale`.
pub const CARD: Card = Card {
    id: "current-scale",
    title: "Scale of the current sensor",
    equation: "i seen = (1 + k) i",
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
    polar: false,
    screen: Screen::AtZero,
    family: "current-scale",
    description: Description {
        summary: "The current sensor shows a fixed percentage too much or too little: a shunt off its value.",
        signature: "The current channel is off in proportion to the current.",
        experiment: "A known resistor in place of the motor.",
        similar: "A wrong resistance and motor constant together: without another measurement of torque it is the same.",
        reference: "Texas Instruments INA240 data sheet (SBOS662), gain error",
    },
};

/// The law of `current-scale`; its parameters in the card's order.
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
