//! Shaft compliance: two masses (fraction r of J at the motor) on a shaft of stiffness k and damping c.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Elastic, Law, Motion, Parameter, ParameterKind, Requirement, Rival, Scalar, Screening, Shaft, Output, StandRun, Structure};

/// The card of `compliance`.
pub const CARD: Card = Card {
    id: "compliance",
    title: "Shaft compliance",
    equation: "two masses (fraction r of J at the motor) on a shaft of stiffness k and damping c",
    domain: Domain::Torque,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "shaft_N_m_rad",
            unit: "N m/rad",
            description: "stiffness k",
            range: (0.001, 100000.0),
            start: 1.0,
            kind: ParameterKind::Positive,
            simulated_range: (0.3, 1.0),
        },
        Parameter {
            name: "shaft_N_m_s_rad",
            unit: "N m s/rad",
            description: "damping c",
            range: (0.0, f64::INFINITY),
            start: 0.0003,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.0002, 0.0006),
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
    screening: Screening::ShaftResonances { resonances_Hz: &[5.0, 12.0, 30.0, 70.0], damping_ratio: 0.1 },
    rivals: &[Rival {
        effect: "backlash",
        separation: "A compliant shaft oscillates after every step, backlash acts only at torque reversals. Apply sharp steps with and without a reversal",
        run: StandRun::SHARP_STEPS,
        change_of_stand: None,
    }],
    next_run: StandRun::MULTISINE,
    // The response oscillates: over the acceleration it would be a spiral.
    demonstration: Some(Demonstration {
        motion: Motion::VoltageSteps(2.0, 0.4),
        duration_s: 0.8,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::History),
        added: &[],
    }),
    limited_at_zero: &[1],
    law: &Compliance,
    description: Description {
        summary: "An elastic part connects motor and platform: a coupling, a belt, a thin shaft.",
        signature: "After every step the rate oscillates at one frequency; high-frequency excitation hardly reaches the platform.",
        experiment: "Run a sweep or a PRBS through the expected resonance.",
        similar: "Backlash (oscillates only after reversals); a delayed or slow rate sensor.",
        reference: "Ljung, Glad, Modeling of Dynamic Systems (1994): two-mass drive",
    },
    ..Card::DEFAULT
};

/// The law of `compliance`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Compliance;

impl<S: Scalar> Law<S> for Compliance {
    fn configure(&self, p: &[S], structure: &mut Structure<S>) {
        structure.shaft = Some(Shaft { stiffness: p[0], damping: p[1], motor_inertia_fraction: p[2], gap: S::zero() });
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
