//! g-sensitivity of the rate sensor: reading ω + a sin(θ + φ) on a tilted stand; no torque causes it.

use crate::{Card, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, StandRun};

/// The card of `rate-g-sensitivity`.
pub const CARD: Card = Card {
    id: "rate-g-sensitivity",
    title: "g-sensitivity of the rate sensor",
    equation: "reading ω + a sin(θ + φ) on a tilted stand; no torque causes it",
    domain: Domain::Measurement,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "rate_g_rad_s",
            unit: "rad/s",
            description: "amplitude a",
            range: (0.0, f64::INFINITY),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.02, 0.08),
        },
        Parameter::phase("rate_g_phase_rad"),
    ],
    polar: true,
    requires: &[Requirement::Angle, Requirement::ComparedRate, Requirement::Turns { min: 1.5, rival: None }],
    family: "order-one",
    next_run: StandRun::LOW_RATES,
    law: &RateGSensitivity,
    description: Description {
        summary: "The rate sensor responds to acceleration; on a tilted stand gravity rotates through its axes once per turn.",
        signature: "A ripple of harmonic order 1 in the rate channel alone, of the same amplitude at every rate.",
        experiment: "Turn slowly through whole turns on a tilted stand and compare rate sensor and encoder.",
        similar: "Unbalance, if only this sensor measures the rate.",
        reference: "Bosch BST-BMG160-DS000, g-sensitivity 0.1 °/s/g; IEEE Std 528",
    },
    ..Card::DEFAULT
};

/// The law of `rate-g-sensitivity`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct RateGSensitivity;

impl<S: Scalar> Law<S> for RateGSensitivity {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * (x.theta + p[1]).portable_sin();
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
