//! Viscosity that falls with temperature: b exp(−κ (T − T0)), T0 = 25 °C.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen, T0_C};

/// The card of `viscous-temperature`.
pub const CARD: Card = Card {
    id: "viscous-temperature",
    title: "Viscosity that falls with temperature",
    equation: "b exp(−κ (T − T0)), T0 = 25 °C",
    domain: Domain::Torque,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "viscous_temperature_per_K",
            unit: "1/K",
            description: "relative fall κ per kelvin",
            range: (0.0, 0.2),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.01, 0.03),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    description: Description {
        summary: "Grease thins as it warms, so that the viscous friction falls.",
        signature: "The same voltage gives a slowly rising rate while the stand warms up.",
        experiment: "The same rates cold and after half an hour of running.",
        similar: "A winding resistance that rises with temperature acts the other way, and shows in the current.",
        reference: "Vogel (1921); SKF rolling bearings catalogue, friction",
    },
};

/// The law of `viscous-temperature`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct ViscousTemperature;

impl<S: Scalar> Law<S> for ViscousTemperature {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.viscous_factor *= (-(p[0] * (x.temp_C - T0_C))).exp();
    }
}
