//! Scale factor of the rate sensor: reading (1 + k) ω; of an angle sensor under test (1 + k) θ.

use crate::{Card, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, StandRun};

/// The card of `rate-scale`.
pub const CARD: Card = Card {
    id: "rate-scale",
    title: "Scale factor of the rate sensor",
    equation: "reading (1 + k) ω; of an angle sensor under test (1 + k) θ",
    domain: Domain::Measurement,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "rate_scale",
            unit: "1",
            description: "relative error k of the scale factor",
            range: (-0.5, 0.5),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.01, 0.05),
        },
    ],
    requires: &[Requirement::RateOrSensorAngle],
    family: "rate-scale",
    next_run: StandRun::HIGH_RATES,
    law: &RateScale,
    description: Description {
        summary: "The rate sensor reads a fixed percentage too much or too little compared with the encoder. So does an angle sensor under test with a wrong number of counts or pole pairs per turn.",
        signature: "Rate and derivative of the angle differ in proportion to the rate.",
        experiment: "Run whole turns at several rates and compare rate sensor and encoder.",
        similar: "A wrong motor constant, if there is no encoder.",
        reference: "IEEE Std 528",
    },
    ..Card::DEFAULT
};

/// The law of `rate-scale`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct RateScale;

impl<S: Scalar> Law<S> for RateScale {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * x.omega;
        if x.reference_angle {
            y.theta += p[0] * x.theta;
        }
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
