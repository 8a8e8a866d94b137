//! Unbalance: a sin(θ + φ): a mass off the axis of a tilted stand.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `unbalance`.
pub const CARD: Card = Card {
    id: "unbalance",
    title: "Unbalance",
    equation: "a sin(θ + φ): a mass off the axis of a tilted stand",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "unbalance_N_m",
            unit: "N m",
            description: "amplitude a = m g r sin(tilt)",
            range: (0.0, f64::INFINITY),
            start: 0.0005,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.001, 0.004),
        },
        Parameter {
            name: "unbalance_phase_rad",
            unit: "rad",
            description: "phase φ",
            range: (0.0, std::f64::consts::TAU),
            start: 0.0,
            kind: ParameterKind::Phase,
            simulated_range: (0.0, std::f64::consts::TAU),
        },
    ],
    polar: true,
    screen: Screen::AtZero,
    family: "order-one",
    description: Description {
        summary: "The centre of mass lies off the axis and the axis is not vertical: gravity pulls once per turn.",
        signature: "A ripple of order one, strongest at low rates; the platform comes to rest at the same angle.",
        experiment: "Slow whole turns; then tilt the stand and see the amplitude change.",
        similar: "Encoder eccentricity (grows with the rate); a g-sensitive rate sensor, where only that sensor sees the rate.",
        reference: "ISO 21940; effects.md",
    },
};

/// The law of `unbalance`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Unbalance;

impl<S: Scalar> Law<S> for Unbalance {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.torque += p[0] * (x.theta + p[1]).sin();
    }
}
