//! Bias of the rate sensor and temperature: β_T (T − T0).

use crate::{Account, Card, Coordinate, Kind, Law, Parameter, Point, Reading, Room, Scalar, Screen, T0_C};

/// The card of `rate-bias-temperature`.
pub const CARD: Card = Card {
    id: "rate-bias-temperature",
    title: "Bias of the rate sensor and temperature",
    equation: "β_T (T − T0)",
    room: Room::Measurement,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "rate_bias_per_K",
            unit: "rad/(s K)",
            says: "bias per kelvin",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: Kind::Signed,
            hidden: (0.01, 0.05),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    account: Account {
        what: "The bias of the rate sensor wanders with temperature.",
        shows: "The rate channel drifts away from the encoder while the stand warms.",
        experiment: "Stand still while it warms.",
        looks_like: "Anything else that drifts with time.",
        reference: "IEEE Std 528; Bosch BST-BMG160-DS000, TCO 0.015 °/s/K",
    },
};

/// The law of `rate-bias-temperature`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct RateBiasTemperature;

impl<S: Scalar> Law<S> for RateBiasTemperature {
    fn see(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        y.omega += p[0] * (x.temp_C - T0_C);
    }
    fn is_silent(&self) -> bool {
        true
    }
}
