//! Supply droop: motor voltage u × supply_V / nominal where the supply is measured, minus r i.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Requirement, Scalar, StandRun};

/// The card of `supply-droop`.
pub const CARD: Card = Card {
    id: "supply-droop",
    title: "Supply droop",
    equation: "motor voltage u × supply_V / nominal where the supply is measured, minus r i",
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
    requires: &[Requirement::CommandedVoltage, Requirement::Voltage],
    uses_supply: true,
    family: "resistance",
    next_run: StandRun::VARYING_CURRENT,
    law: &SupplyDroop,
    description: Description {
        summary: "The voltage of the supply and its leads falls under load.",
        signature: "The drive is weaker than commanded when the current is high.",
        experiment: "Record supply_V at the bridge together with the current.",
        similar: "A winding resistance that is too small in the model: equivalent unless the supply is recorded and varies.",
        reference: "Thévenin source with resistance r",
    },
    ..Card::DEFAULT
};

/// The law of `supply-droop`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct SupplyDroop;

impl<S: Scalar> Law<S> for SupplyDroop {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.series_ohm += p[0];
        out.voltage += x.voltage * (x.supply_ratio - 1.0);
    }
}
