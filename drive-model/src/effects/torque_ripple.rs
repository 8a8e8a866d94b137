//! Torque ripple: K(θ) = K (1 + a sin(nθ + φ)), in torque and back-EMF.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `torque-ripple`.
pub const CARD: Card = Card {
    id: "torque-ripple",
    title: "Torque ripple",
    equation: "K(θ) = K (1 + a sin(nθ + φ)), in torque and back-EMF",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "ripple",
            unit: "1",
            description: "relative amplitude a",
            range: (0.0, 1.0),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.03, 0.08),
        },
        Parameter {
            name: "ripple_order",
            unit: "1/turn",
            description: "order n: periods per turn",
            range: (1.0, 400.0),
            start: 7.0,
            kind: ParameterKind::HarmonicOrder,
            simulated_range: (5.0, 14.0),
        },
        Parameter {
            name: "ripple_phase_rad",
            unit: "rad",
            description: "phase φ",
            range: (0.0, std::f64::consts::TAU),
            start: 0.0,
            kind: ParameterKind::Phase,
            simulated_range: (0.0, std::f64::consts::TAU),
        },
    ],
    polar: true,
    screen: Screen::Scan,
    family: "",
    description: Description {
        summary: "The motor constant changes with the angle: few commutator segments, uneven magnets.",
        signature: "A ripple at a fixed order that grows with the current and shows in the back-EMF.",
        experiment: "Slow turns under different loads; compare the ripple at small and at large current.",
        similar: "Cogging, which is there without current too.",
        reference: "Hanselman (2006), ch. 5",
    },
};

/// The law of `torque-ripple`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct TorqueRipple;

impl<S: Scalar> Law<S> for TorqueRipple {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.motor_factor *= p[0] * (x.theta * p[1] + p[2]).sin() + 1.0;
    }
}
