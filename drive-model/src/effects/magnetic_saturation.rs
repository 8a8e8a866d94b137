//! Magnetic saturation: K / (1 + (i/i_s)²).

use crate::{Account, Acts, Arms, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `magnetic-saturation`.
pub const CARD: Card = Card {
    id: "magnetic-saturation",
    title: "Magnetic saturation",
    equation: "K / (1 + (i/i_s)²)",
    room: Room::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "saturation_A",
            unit: "A",
            says: "current i_s at which K has halved",
            range: (0.05, 1000.0),
            start: 3.0,
            kind: Kind::Positive,
            hidden: (0.7, 1.5),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    account: Account {
        what: "At high current the iron saturates and the torque no longer follows the current.",
        shows: "The torque per ampere falls at high current.",
        experiment: "Accelerate hard with several currents and compare torque per ampere.",
        looks_like: "Quadratic drag, when high current and high rate come together; a rising winding resistance.",
        reference: "Hanselman (2006), ch. 2",
    },
};

/// The law of `magnetic-saturation`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct MagneticSaturation;

impl<S: Scalar> Law<S> for MagneticSaturation {
    fn arm(&self, _p: &[S], arms: &mut Arms<S>) {
        arms.by_current = true;
    }
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
        let q = x.current / p[0];
        a.motor_factor *= (q * q + 1.0).recip();
    }
}
