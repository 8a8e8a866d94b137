//! Dead time of the bridge: the bridge loses V sign i of the voltage asked for.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `dead-time`.
pub const CARD: Card = Card {
    id: "dead-time",
    title: "Dead time of the bridge",
    equation: "the bridge loses V sign i of the voltage asked for",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "dead_time_V",
            unit: "V",
            description: "lost voltage V = supply × dead time × switching rate",
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
        summary: "Between switching one transistor off and the other on, the current takes its own way; a constant voltage is lost.",
        signature: "A dead zone of the voltage asked for; the voltage at the terminals does not show it.",
        experiment: "Measure the terminal voltage beside the one asked for.",
        similar: "Brush drop: the same, unless the terminal voltage is measured.",
        reference: "Holmes, Lipo, Pulse Width Modulation (2003), §7.4",
    },
};

/// The law of `dead-time`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct DeadTime;

impl<S: Scalar> Law<S> for DeadTime {
    fn contribute(&self, p: &[S], _x: &Point<S>, a: &mut Contributions<S>) {
        a.drop_V += p[0];
    }
}
