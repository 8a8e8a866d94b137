//! Bias of the rate sensor and temperature: β_T (T − T0).

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen, T0_C};

/// The card of `rate-bias-temperature`.
pub const CARD: Card = Card {
    id: "rate-bias-temperature",
    title: "Bias of the rate sensor and temperature",
    equation: "β_T (T − T0)",
    domain: Domain::Measurement,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "rate_bias_per_K",
            unit: "rad/(s K)",
            description: "bias per kelvin",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.01, 0.05),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "The bias of the rate sensor wanders with temperature.",
        signature: "The rate channel drifts away from the encoder while the stand warms.",
        experiment: "Stand still while it warms.",
        similar: "Anything else that drifts with time.",
        reference: "IEEE Std 528; Bosch BST-BMG160-DS000, TCO 0.015 °/s/K",
    },
};

/// The law of `rate-bias-temperature`; its parameters in the card's order.
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
