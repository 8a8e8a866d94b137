//! Dead time of the bridge: the bridge loses V sign(i) of the commanded voltage.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Requirement, Scalar, StandRun};

/// The card of `dead-time`.
pub const CARD: Card = Card {
    id: "dead-time",
    title: "Dead time of the bridge",
    equation: "the bridge loses V sign(i) of the commanded voltage",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "dead_time_V",
            unit: "V",
            description: "lost voltage V = supply × dead time × switching frequency",
            range: (0.0, 10.0),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.08, 0.3),
        },
    ],
    requires: &[Requirement::CommandedVoltage, Requirement::Voltage],
    family: "voltage-drop",
    next_run: StandRun::BREAKAWAY,
    limited_at_zero: &[0],
    law: &DeadTime,
    description: Description {
        summary: "Between switching one transistor off and the other on, the current flows through a diode; a constant voltage is lost.",
        signature: "A dead zone of the commanded voltage, which the terminal voltage does not show.",
        experiment: "Measure the terminal voltage and compare it with the commanded voltage.",
        similar: "Brush drop: equivalent unless the terminal voltage is measured.",
        reference: "Holmes, Lipo, Pulse Width Modulation (2003), §7.4",
    },
    ..Card::DEFAULT
};

/// The law of `dead-time`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct DeadTime;

impl<S: Scalar> Law<S> for DeadTime {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.drop_V += p[0];
    }
}
