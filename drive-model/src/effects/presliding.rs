//! Presliding (bristles): a bristle state replaces the Coulomb torque: z’ = ω − σ |ω| z / c, torque −σ z (Dahl).

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Elastic, Law, Motion, Parameter, ParameterKind, Requirement, Scalar, Screening, Output, StandRun, Structure};

/// The card of `presliding`.
pub const CARD: Card = Card {
    id: "presliding",
    title: "Presliding (bristles)",
    equation: "a bristle state replaces the Coulomb torque: z’ = ω − σ |ω| z / c, torque −σ z (Dahl)",
    domain: Domain::Torque,
    coordinate: Coordinate::History,
    parameters: &[
        Parameter {
            name: "presliding_stiffness_N_m_rad",
            unit: "N m/rad",
            description: "stiffness σ of the contact before sliding",
            range: (0.001, 10000.0),
            start: 0.5,
            kind: ParameterKind::Positive,
            simulated_range: (0.05, 0.3),
        },
    ],
    rests_on: &["coulomb", "stribeck"],
    inert_alone: true,
    requires: &[Requirement::SimulatedMotion],
    elastic: Some(Elastic::Bristle),
    screening: Screening::BristleDeflections(&[0.003, 0.02, 0.1]),
    next_run: StandRun::BREAKAWAY,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(0.1, 2.0),
        duration_s: 4.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::History),
        added: &[],
    }),
    law: &Presliding,
    description: Description {
        summary: "Before it slides, dry friction acts as a spring: the asperities bend like bristles.",
        signature: "After each reversal the friction builds up over an angle c/σ instead of jumping; at rest the rotor oscillates and creeps back.",
        experiment: "Apply small slow sines around one angle, or a sweep with many reversals.",
        similar: "Coulomb friction with an error near each reversal; backlash; a cable spring over small angles.",
        reference: "Dahl (1968); Canudas de Wit, Olsson, Åström, Lischinsky, IEEE TAC 40 (1995) 419",
    },
    ..Card::DEFAULT
};

/// The law of `presliding`; its parameters in the order of the card.
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
