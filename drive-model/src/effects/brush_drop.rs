//! Brush voltage drop: u loses V sign i, and no current flows below it.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `brush-drop`.
pub const CARD: Card = Card {
    id: "brush-drop",
    title: "Brush voltage drop",
    equation: "u loses V sign i, and no current flows below it",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "brush_V",
            unit: "V",
            description: "drop V of both brushes together",
            range: (0.0, 10.0),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.08, 0.3),
        },
    ],
    polar: false,
    screen: Screen::AtZero,
    family: "voltage-drop",
    description: Description {
        summary: "A film between brush and commutator eats a nearly constant voltage.",
        signature: "No current flows until the voltage passes the drop: a dead zone of the voltage.",
        experiment: "A slow sine of the voltage through zero, with the current measured.",
        similar: "Dead time of the bridge (the same, unless the terminal voltage is measured); Coulomb friction where the current is not measured.",
        reference: "Hamilton, DC Motor Brush Life (2000); effects.md",
    },
};

/// The law of `brush-drop`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct BrushDrop;

impl<S: Scalar> Law<S> for BrushDrop {
    fn contribute(&self, p: &[S], _x: &Point<S>, a: &mut Contributions<S>) {
        a.drop_V += p[0];
    }
}
