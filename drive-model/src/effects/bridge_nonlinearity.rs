//! Nonlinear output of the bridge: motor voltage u (1 + a |u| + b u²).

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Output, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, StandRun};

/// The card of `bridge-nonlinearity`.
pub const CARD: Card = Card {
    id: "bridge-nonlinearity",
    title: "Nonlinear output of the bridge",
    equation: "motor voltage u (1 + a |u| + b u²)",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "bridge_per_V",
            unit: "1/V",
            description: "coefficient a",
            range: (-2.0, 2.0),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.08, 0.2),
        },
        Parameter {
            name: "bridge_per_V2",
            unit: "1/V²",
            description: "coefficient b",
            range: (-2.0, 2.0),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.0, 0.0),
        },
    ],
    requires: &[Requirement::CommandedVoltage, Requirement::Voltage, Requirement::SimulatedMotion],
    rivals: &[
        Rival {
            effect: "magnetic-saturation",
            separation: "A nonlinear bridge depends on the voltage also where the current is small, at a steady rate. Hold several rates, then accelerate hard",
            run: StandRun::STEPS,
            change_of_stand: Some("Measure the voltage at the terminals of the motor and record it as u_V with the note `u_V: terminal`"),
        },
        Rival {
            effect: "dead-time",
            separation: "A lost voltage is constant from small voltages on; a nonlinear gain acts most at large ones",
            run: StandRun::BREAKAWAY,
            change_of_stand: None,
        },
        Rival {
            effect: "quadratic-drag",
            separation: "A drag needs a torque and therefore a current. Record the current together with the voltage (i_A)",
            run: StandRun::HIGH_RATES,
            change_of_stand: None,
        },
    ],
    next_run: StandRun::STEPS,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(20.0, 8.0),
        duration_s: 8.0,
        output: Output::Voltage,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    law: &BridgeNonlinearity,
    description: Description {
        summary: "The amplifier or bridge does not give the commanded voltage in proportion: its gain changes with the modulation.",
        signature: "Rate and current together leave their proportion to the voltage as the voltage grows.",
        experiment: "Hold several constant voltages in both directions and compare rate and current.",
        similar: "Dead time and brush drop, which lose a constant voltage; quadratic drag and magnetic saturation, which change rate or current alone.",
        reference: "Taylor polynomial of an odd characteristic to the third order",
    },
    ..Card::DEFAULT
};

/// The law of `bridge-nonlinearity`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct BridgeNonlinearity;

impl<S: Scalar> Law<S> for BridgeNonlinearity {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.voltage += x.voltage * (p[0] * x.voltage.abs() + p[1] * x.voltage * x.voltage);
    }
}
