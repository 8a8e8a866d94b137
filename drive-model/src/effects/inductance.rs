//! Winding inductance: L i’ = u − R i − K ω.

use crate::{Account, Arms, Card, Coordinate, Kind, Law, Parameter, Room, Scalar, Screen};

/// The card of `inductance`.
pub const CARD: Card = Card {
    id: "inductance",
    title: "Winding inductance",
    equation: "L i’ = u − R i − K ω",
    room: Room::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "inductance_H",
            unit: "H",
            says: "terminal inductance L",
            range: (1e-06, 1.0),
            start: 0.002,
            kind: Kind::Positive,
            hidden: (0.005, 0.025),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    account: Account {
        what: "The current cannot jump: it rises over the electrical time constant L/R.",
        shows: "The measured current lags behind the model after every step of the voltage.",
        experiment: "Steps or a PRBS of the voltage, sampled faster than L/R.",
        looks_like: "A filter of the current sensor; a late channel.",
        reference: "theory.md §4",
    },
};

/// The law of `inductance`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Inductance;

impl<S: Scalar> Law<S> for Inductance {
    fn arm(&self, p: &[S], arms: &mut Arms<S>) {
        arms.inductance_H = Some(p[0]);
    }
    fn is_silent(&self) -> bool {
        true
    }
}
