//! Dead zone of the amplifier: no output up to a commanded voltage V, beyond it u − V sign(u).

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Output, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, StandRun};

/// The card of `voltage-dead-zone`.
pub const CARD: Card = Card {
    id: "voltage-dead-zone",
    title: "Dead zone of the amplifier",
    equation: "motor voltage 0 for |u| ≤ V, otherwise u − V sign(u)",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "dead_zone_V",
            unit: "V",
            description: "half-width V",
            range: (0.0, 100.0),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.08, 0.3),
        },
    ],
    requires: &[Requirement::CommandedVoltage, Requirement::Voltage, Requirement::SimulatedMotion],
    family: "voltage-drop",
    rivals: &[
        Rival {
            effect: "dead-time",
            separation: "A dead zone depends on the sign of the commanded voltage, a lost voltage on the sign of the current. Let the drive brake: then the two signs differ",
            run: StandRun::SHARP_STEPS,
            change_of_stand: None,
        },
        Rival {
            effect: "brush-drop",
            separation: "A dead zone depends on the sign of the commanded voltage, a brush drop on the sign of the current. Let the drive brake: then the two signs differ",
            run: StandRun::SHARP_STEPS,
            change_of_stand: None,
        },
        Rival {
            effect: "coulomb",
            separation: "Friction needs a torque and therefore a current, a lost voltage does not. Record the current together with the voltage (i_A), at small voltages",
            run: StandRun::BREAKAWAY,
            change_of_stand: None,
        },
    ],
    next_run: StandRun::SHARP_STEPS,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(20.0, 1.0),
        duration_s: 2.0,
        output: Output::Voltage,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    limited_at_zero: &[0],
    law: &VoltageDeadZone,
    description: Description {
        summary: "A linear amplifier with crossover distortion, or a bridge whose shortest pulses are suppressed, gives no output for small commands.",
        signature: "A step of the voltage where the command changes its sign; the motor is short-circuited, not driven, at small commands.",
        experiment: "Let the commanded voltage pass through zero while the rotor turns.",
        similar: "Dead time and brush drop, which follow the sign of the current.",
        reference: "Slotine, Li, Applied Nonlinear Control (1991), §5.2: dead zone",
    },
    ..Card::DEFAULT
};

/// The law of `voltage-dead-zone`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct VoltageDeadZone;

impl<S: Scalar> Law<S> for VoltageDeadZone {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.voltage -= if x.voltage.abs() <= p[0] {
            x.voltage
        } else if x.voltage > 0.0 {
            p[0]
        } else {
            -p[0]
        };
    }
}
