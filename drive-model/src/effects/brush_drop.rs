//! Brush voltage drop: u loses V sign i, and no current flows below it.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `brush-drop`.
pub const CARD: Card = Card {
    id: "brush-drop",
    title: "Brush voltage drop",
    equation: "u loses V sign i, and no current flows below it",
    room: Room::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "brush_V",
            unit: "V",
            says: "drop V of both brushes together",
            range: (0.0, 10.0),
            start: 0.1,
            kind: Kind::Level,
            hidden: (0.08, 0.3),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "voltage-drop",
    account: Account {
        what: "A film between brush and commutator eats a nearly constant voltage.",
        shows: "No current flows until the voltage passes the drop: a dead zone of the voltage.",
        experiment: "A slow sine of the voltage through zero, with the current measured.",
        looks_like: "Dead time of the bridge (the same, unless the terminal voltage is measured); Coulomb friction where the current is not measured.",
        reference: "Hamilton, DC Motor Brush Life (2000); effects.md",
    },
};

/// The law of `brush-drop`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct BrushDrop;

impl<S: Scalar> Law<S> for BrushDrop {
    fn act(&self, p: &[S], _x: &Point<S>, a: &mut Acts<S>) {
        a.drop_V += p[0];
    }
}
