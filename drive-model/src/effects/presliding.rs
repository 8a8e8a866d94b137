//! Presliding (bristles): a bristle state takes the place of the dry level: z’ = ω − σ |ω| z / c, torque −σ z (Dahl).

use crate::{Description, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Domain, Scalar, Screen};

/// The card of `presliding`.
pub const CARD: Card = Card {
    id: "presliding",
    title: "Presliding (bristles)",
    equation: "a bristle state takes the place of the dry level: z’ = ω − σ |ω| z / c, torque −σ z (Dahl)",
    domain: Domain::Torque,
    coordinate: Coordinate::History,
    parameters: &[
        Parameter {
            name: "presliding_stiffness_N_m_rad",
            unit: "N m/rad",
            description: "stiffness σ of the contact before it slides",
            range: (0.001, 10000.0),
            start: 0.5,
            kind: ParameterKind::Positive,
            simulated_range: (0.05, 0.3),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    description: Description {
        summary: "Before it slides, dry friction is a spring: the asperities bend like bristles.",
        signature: "After each reversal the friction builds up over an angle c/σ instead of jumping; at rest the rotor rings and creeps back.",
        experiment: "Small slow sines around one angle, or a sweep through many reversals.",
        similar: "Coulomb friction with an error near each reversal; backlash; a cable spring over small angles.",
        reference: "Dahl (1968); Canudas de Wit, Olsson, Åström, Lischinsky, IEEE TAC 40 (1995) 419",
    },
};

/// The law of `presliding`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Presliding;

impl<S: Scalar> Law<S> for Presliding {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.bristle_N_m_rad = Some(p[0]);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
