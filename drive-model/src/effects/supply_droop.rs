//! Supply droop: the motor gets u × supply_V / nominal where the supply is measured, and loses r i.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `supply-droop`.
pub const CARD: Card = Card {
    id: "supply-droop",
    title: "Supply droop",
    equation: "the motor gets u × supply_V / nominal where the supply is measured, and loses r i",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "supply_ohm",
            unit: "Ω",
            description: "resistance r of supply and leads",
            range: (0.0, f64::INFINITY),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.2, 0.8),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "resistance",
    description: Description {
        summary: "The supply and its leads give way under load.",
        signature: "The drive is weaker than asked for when the current is high.",
        experiment: "Log supply_V at the bridge beside the current.",
        similar: "A winding resistance that is too small in the model: the same, unless the supply is logged and moves.",
        reference: "effects.md",
    },
};

/// The law of `supply-droop`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct SupplyDroop;

impl<S: Scalar> Law<S> for SupplyDroop {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.series_ohm += p[0];
        a.voltage += x.voltage * (x.supply_ratio - 1.0);
    }
}
