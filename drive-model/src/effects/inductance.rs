//! Winding inductance: L i’ = u − R i − K ω.

use crate::{Description, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Domain, Scalar, Screen};

/// The card of `inductance`.
pub const CARD: Card = Card {
    id: "inductance",
    title: "Winding inductance",
    equation: "L i’ = u − R i − K ω",
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
    polar: false,
    screen: Screen::Probe,
    family: "",
    description: Description {
        summary: "The current cannot jump: it rises over the electrical time constant L/R.",
        signature: "The measured current lags behind the model after every step of the voltage.",
        experiment: "Steps or a PRBS of the voltage, sampled faster than L/R.",
        similar: "A filter of the current sensor; a late channel.",
        reference: "theory.md §4",
    },
};

/// The law of `inductance`; its parameters in the card's order.
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
