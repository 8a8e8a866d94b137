//! Lag of the rate sensor: the rate channel passes a first-order lag.

use crate::{Account, Arms, Card, Coordinate, Kind, Law, Parameter, Room, Scalar, Screen};

/// The card of `sensor-lag`.
pub const CARD: Card = Card {
    id: "sensor-lag",
    title: "Lag of the rate sensor",
    equation: "the rate channel passes a first-order lag",
    room: Room::Measurement,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "lag_s",
            unit: "s",
            says: "time constant",
            range: (0.0, 0.5),
            start: 0.002,
            kind: Kind::Level,
            hidden: (0.003, 0.01),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "late-rate",
    account: Account {
        what: "The rate sensor has a finite bandwidth and shows the rate late and smoothed.",
        shows: "The rate channel is off in proportion to the acceleration, and to nothing else.",
        experiment: "Steps of the voltage, or a sweep.",
        looks_like: "A late channel (time skew), which keeps sharp corners sharp; shaft compliance.",
        reference: "theory.md §4; IEEE Std 528",
    },
};

/// The law of `sensor-lag`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct SensorLag;

impl<S: Scalar> Law<S> for SensorLag {
    fn arm(&self, p: &[S], arms: &mut Arms<S>) {
        arms.lag_s = Some(p[0]);
    }
    fn is_silent(&self) -> bool {
        true
    }
}
