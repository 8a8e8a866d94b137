//! Offset of the current sensor: i seen = i + o.

use crate::{Account, Card, Coordinate, Kind, Law, Parameter, Point, Reading, Room, Scalar, Screen};

/// The card of `current-offset`.
pub const CARD: Card = Card {
    id: "current-offset",
    title: "Offset of the current sensor",
    equation: "i seen = i + o",
    room: Room::Measurement,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "current_offset_A",
            unit: "A",
            says: "offset o",
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
        what: "The current sensor shows a current where none flows.",
        shows: "The current channel is off by a constant.",
        experiment: "Log some seconds with the drive off.",
        looks_like: "A constant load.",
        reference: "Texas Instruments INA240 data sheet (SBOS662), offset",
    },
};

/// The law of `current-offset`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct CurrentOffset;

impl<S: Scalar> Law<S> for CurrentOffset {
    fn see(&self, p: &[S], _x: &Point<S>, y: &mut Reading<S>) {
        y.current += p[0];
    }
    fn is_silent(&self) -> bool {
        true
    }
}
