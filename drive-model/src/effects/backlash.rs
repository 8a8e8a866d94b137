//! Backlash: the shaft of `compliance` with a gap (total play).

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Elastic, Law, Motion, Parameter, ParameterKind, Requirement, Scalar, Screening, Shaft, Output, StandRun, Structure};

/// The card of `backlash`.
pub const CARD: Card = Card {
    id: "backlash",
    title: "Backlash",
    equation: "the shaft of `compliance` with a gap (total play)",
    domain: Domain::Torque,
    coordinate: Coordinate::History,
    parameters: &[
        Parameter {
            name: "gap_rad",
            unit: "rad",
            description: "total play of the gap",
            range: (0.0, 1.0),
            start: 0.02,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.02, 0.06),
        },
        Parameter {
            name: "shaft_N_m_rad",
            unit: "N m/rad",
            description: "stiffness k in contact",
            range: (0.001, 100000.0),
            start: 5.0,
            kind: ParameterKind::Positive,
            simulated_range: (4.0, 8.0),
        },
        Parameter {
            name: "shaft_N_m_s_rad",
            unit: "N m s/rad",
            description: "damping c in contact",
            range: (0.0, f64::INFINITY),
            start: 0.02,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.01, 0.03),
        },
        Parameter {
            name: "motor_inertia_share",
            unit: "1",
            description: "fraction r of the inertia on the motor side",
            range: (0.01, 0.99),
            start: 0.3,
            kind: ParameterKind::Fraction,
            simulated_range: (0.3, 0.3),
        },
    ],
    requires: &[Requirement::SimulatedMotion, Requirement::NoOtherShaft],
    elastic: Some(Elastic::Shaft),
    reduces_to: Some("compliance"),
    screening: Screening::Gaps { gaps_rad: &[0.01, 0.03, 0.08], resonance_Hz: 50.0, damping_ratio: 1.0 },
    next_run: StandRun::SHARP_STEPS,
    demonstration: Some(Demonstration {
        motion: Motion::VoltageSteps(0.5, 0.4),
        duration_s: 0.8,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::History),
        added: &[],
    }),
    limited_at_zero: &[0, 2],
    clearance: Some(0),
    law: &Backlash,
    description: Description {
        summary: "There is play between motor and platform: a worn gear or coupling.",
        signature: "After each torque reversal the platform coasts through the gap and is then hit by the flank.",
        experiment: "Apply small reversing torques: a multisine or square waves around zero.",
        similar: "Compliance; presliding friction.",
        reference: "Nordin, Gutman, Automatica 38 (2002) 1633",
    },
    ..Card::DEFAULT
};

/// The law of `backlash`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Backlash;

impl<S: Scalar> Law<S> for Backlash {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.shaft = Some(Shaft { stiffness: p[1], damping: p[2], motor_inertia_fraction: p[3], gap: p[0] });
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
