//! Shaft compliance: two masses (share r of J at the motor) on a shaft of stiffness k and damping c.

use crate::{Description, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Domain, Scalar, Screen, Shaft};

/// The card of `compliance`.
pub const CARD: Card = Card {
    id: "compliance",
    title: "Shaft compliance",
    equation: "two masses (share r of J at the motor) on a shaft of stiffness k and damping c",
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
            description: "share r of the inertia on the motor’s side",
            range: (0.01, 0.99),
            start: 0.3,
            kind: ParameterKind::Fraction,
            simulated_range: (0.3, 0.3),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    description: Description {
        summary: "Motor and platform are joined by something that twists: a coupling, a belt, a thin shaft.",
        signature: "After every step the rate rings at one frequency, and high-frequency excitation hardly reaches the platform.",
        experiment: "A sweep or PRBS through the suspected resonance.",
        similar: "Backlash (rings only after reversals); a late or slow rate sensor.",
        reference: "Ljung, Glad, Modeling of Dynamic Systems (1994); theory of the two-mass drive",
    },
};

/// The law of `compliance`; its parameters in the card's order.
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
