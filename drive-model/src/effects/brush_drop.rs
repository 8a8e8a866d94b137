//! Brush voltage drop: the winding loses V sign(i); no current flows below V.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, StandRun};

/// The card of `brush-drop`.
pub const CARD: Card = Card {
    id: "brush-drop",
    title: "Brush voltage drop",
    equation: "the winding loses V sign(i); no current flows below V",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "brush_V",
            unit: "V",
            description: "voltage drop V of both brushes together",
            range: (0.0, 10.0),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.08, 0.3),
        },
    ],
    requires: &[Requirement::Voltage],
    family: "voltage-drop",
    rivals: &[Rival {
        effect: "dead-time",
        separation: "Both subtract a constant voltage. Measure the voltage at the motor terminals and log it as u_V with the note `u_V: terminal`. If the drop remains, it is in the brushes; if it disappears, it is in the bridge. The run passes slowly through the dead zone, where the drop is largest relative to the voltage",
        run: StandRun::BREAKAWAY,
        change_of_stand: None,
    }],
    next_run: StandRun::BREAKAWAY,
    limited_at_zero: &[0],
    law: &BrushDrop,
    description: Description {
        summary: "A film between brush and commutator drops a nearly constant voltage.",
        signature: "No current flows until the voltage exceeds the drop: a dead zone of the voltage.",
        experiment: "Apply a slow sine of the voltage through zero and measure the current.",
        similar: "Dead time of the bridge (equivalent unless the terminal voltage is measured); Coulomb friction where the current is not measured.",
        reference: "Hamilton, DC Motor Brush Life (2000)",
    },
    ..Card::DEFAULT
};

/// The law of `brush-drop`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct BrushDrop;

impl<S: Scalar> Law<S> for BrushDrop {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.drop_V += p[0];
    }
}
