//! Viscosity that falls with temperature: b exp(−κ (T − T0)), T0 = 25 °C.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen, T0_C};

/// The card of `viscous-temperature`.
pub const CARD: Card = Card {
    id: "viscous-temperature",
    title: "Viscosity that falls with temperature",
    equation: "b exp(−κ (T − T0)), T0 = 25 °C",
    room: Room::Torque,
    coordinate: Coordinate::Temperature,
    parameters: &[
        Parameter {
            name: "viscous_temperature_per_K",
            unit: "1/K",
            says: "relative fall κ per kelvin",
            range: (0.0, 0.2),
            start: 0.01,
            kind: Kind::Level,
            hidden: (0.01, 0.03),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "",
    account: Account {
        what: "Grease thins as it warms, so that the viscous friction falls.",
        shows: "The same voltage gives a slowly rising rate while the stand warms up.",
        experiment: "The same rates cold and after half an hour of running.",
        looks_like: "A winding resistance that rises with temperature acts the other way, and shows in the current.",
        reference: "Vogel (1921); SKF rolling bearings catalogue, friction",
    },
};

/// The law of `viscous-temperature`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct ViscousTemperature;

impl<S: Scalar> Law<S> for ViscousTemperature {
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
        a.viscous_factor *= (-(p[0] * (x.temp_C - T0_C))).exp();
    }
}
