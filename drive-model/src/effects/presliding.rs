//! Presliding (bristles): a bristle state takes the place of the dry level: z’ = ω − σ |ω| z / c, torque −σ z (Dahl).

use crate::{Account, Arms, Card, Coordinate, Kind, Law, Parameter, Room, Scalar, Screen};

/// The card of `presliding`.
pub const CARD: Card = Card {
    id: "presliding",
    title: "Presliding (bristles)",
    equation: "a bristle state takes the place of the dry level: z’ = ω − σ |ω| z / c, torque −σ z (Dahl)",
    room: Room::Torque,
    coordinate: Coordinate::History,
    parameters: &[
        Parameter {
            name: "presliding_stiffness_N_m_rad",
            unit: "N m/rad",
            says: "stiffness σ of the contact before it slides",
            range: (0.001, 10000.0),
            start: 0.5,
            kind: Kind::Positive,
            hidden: (0.05, 0.3),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    account: Account {
        what: "Before it slides, dry friction is a spring: the asperities bend like bristles.",
        shows: "After each reversal the friction builds up over an angle c/σ instead of jumping; at rest the rotor rings and creeps back.",
        experiment: "Small slow sines around one angle, or a sweep through many reversals.",
        looks_like: "Coulomb friction with an error near each reversal; backlash; a cable spring over small angles.",
        reference: "Dahl (1968); Canudas de Wit, Olsson, Åström, Lischinsky, IEEE TAC 40 (1995) 419",
    },
};

/// The law of `presliding`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Presliding;

impl<S: Scalar> Law<S> for Presliding {
    fn arm(&self, p: &[S], arms: &mut Arms<S>) {
        arms.bristle_N_m_rad = Some(p[0]);
    }
    fn is_silent(&self) -> bool {
        true
    }
}
