//! Temperature-dependent bias of the rate sensor: reading ω + β_T (T − T0), T0 = 25 °C.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Scalar, Output, StandRun, T0_C};

/// The card of `rate-bias-temperature`.
pub const CARD: Card = Card {
    id: "rate-bias-temperature",
    title: "Temperature-dependent bias of the rate sensor",
    equation: "reading ω + β_T (T − T0), T0 = 25 °C",
    domain: Domain::Measurement,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "rate_bias_per_K",
            unit: "rad/(s K)",
            description: "bias per kelvin β_T",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.01, 0.05),
        },
    ],
    requires: &[Requirement::ComparedRate, Requirement::MeasuredTemperature, Requirement::TemperatureChange],
    next_run: StandRun::WARM_UP,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(0.0),
        duration_s: 60.0,
        output: Output::Rate,
        abscissa: Abscissa::Coordinate(Coordinate::Temperature),
        added: &[Demonstration::WEIGHT],
    }),
    law: &RateBiasTemperature,
    description: Description {
        summary: "The bias of the rate sensor changes with temperature.",
        signature: "The rate channel drifts away from the encoder while the stand warms up.",
        experiment: "Record at rest while the stand warms up.",
        similar: "Any other drift with time.",
        reference: "IEEE Std 528; Bosch BST-BMG160-DS000, TCO 0.015 °/s/K",
    },
    ..Card::DEFAULT
};

/// The law of `rate-bias-temperature`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct RateBiasTemperature;

impl<S: Scalar> Law<S> for RateBiasTemperature {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * (x.temp_C - T0_C);
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
