//! g-sensitivity of the rate sensor: + g-dependent bias on a tilted stand: a sin(θ + φ), with no torque behind it.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `rate-g-sensitivity`.
pub const CARD: Card = Card {
    id: "rate-g-sensitivity",
    title: "g-sensitivity of the rate sensor",
    equation: "+ g-dependent bias on a tilted stand: a sin(θ + φ), with no torque behind it",
    domain: Domain::Measurement,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "rate_g_rad_s",
            unit: "rad/s",
            description: "amplitude",
            range: (0.0, f64::INFINITY),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.02, 0.08),
        },
        Parameter {
            name: "rate_g_phase_rad",
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
        summary: "The rate sensor answers to acceleration; on a tilted stand gravity turns through it once per turn.",
        signature: "A ripple of order one in the rate channel alone, of the same size at every rate.",
        experiment: "Slow whole turns on a tilted stand, encoder beside rate sensor.",
        similar: "Unbalance, where only this sensor sees the rate.",
        reference: "Bosch BST-BMG160-DS000, g-sensitivity 0.1 °/s/g; IEEE Std 528",
    },
};

/// The law of `rate-g-sensitivity`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct RateGSensitivity;

impl<S: Scalar> Law<S> for RateGSensitivity {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * (x.theta + p[1]).sin();
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
