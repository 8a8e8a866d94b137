//! A late channel: one channel is late by a constant time (the rate, unless the model says another).

use crate::{Account, Arms, Card, Coordinate, Kind, Law, Parameter, Room, Scalar, Screen};

/// The card of `time-skew`.
pub const CARD: Card = Card {
    id: "time-skew",
    title: "A late channel",
    equation: "one channel is late by a constant time (the rate, unless the model says another)",
    room: Room::Measurement,
    coordinate: Coordinate::Acceleration,
    parameters: &[
        Parameter {
            name: "skew_s",
            unit: "s",
            says: "delay",
            range: (0.0, 0.5),
            start: 0.002,
            kind: Kind::Level,
            hidden: (0.003, 0.012),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "late-rate",
    account: Account {
        what: "One channel was stamped late: a filter, a bus, another clock.",
        shows: "That channel is off in proportion to its slope.",
        experiment: "Sharp steps, sampled fast.",
        looks_like: "The lag of a slow sensor, which rounds corners.",
        reference: "effects.md",
    },
};

/// The law of `time-skew`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct TimeSkew;

impl<S: Scalar> Law<S> for TimeSkew {
    fn arm(&self, p: &[S], arms: &mut Arms<S>) {
        arms.skew_s = Some(p[0]);
    }
    fn is_silent(&self) -> bool {
        true
    }
}
