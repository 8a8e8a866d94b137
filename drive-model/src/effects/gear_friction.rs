//! Load-dependent friction: the Coulomb torque increases by μ times the torque of the motor.

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Output, Parameter, ParameterKind, Point, Rival, Scalar, StandRun};

/// The card of `gear-friction`.
pub const CARD: Card = Card {
    id: "gear-friction",
    title: "Load-dependent friction of a gear",
    equation: "the Coulomb torque increases by μ |K i|",
    domain: Domain::Torque,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "gear_friction",
            unit: "1",
            description: "friction μ per torque of the motor",
            range: (0.0, 0.95),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.1, 0.3),
        },
    ],
    rivals: &[
        Rival {
            effect: "coulomb",
            separation: "The friction of a gear grows with the transmitted torque. Turn at the same rates with small and with large accelerations",
            run: StandRun::VARYING_CURRENT,
            change_of_stand: None,
        },
        Rival {
            effect: "magnetic-saturation",
            separation: "A gear loses torque while it drives and holds back while it brakes; a saturated motor loses torque at every large current. Accelerate and brake with large currents",
            run: StandRun::VARYING_CURRENT,
            change_of_stand: None,
        },
    ],
    next_run: StandRun::VARYING_CURRENT,
    demonstration: Some(Demonstration {
        motion: Motion::Sine(20.0, 1.0),
        duration_s: 2.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    limited_at_zero: &[0],
    law: &GearFriction,
    description: Description {
        summary: "The tooth flanks or threads of a gear rub in proportion to the force that they transmit: the efficiency is below one.",
        signature: "The drive needs more current than expected while it accelerates and less while it brakes, in proportion to the torque.",
        experiment: "Accelerate and brake hard at several rates in both directions.",
        similar: "A larger inertia or a smaller motor constant while driving; Coulomb friction at a constant torque.",
        reference: "Hamon, Gautier, Garrec, Dynamic identification of robots with a dry friction model depending on load and velocity, IEEE/RSJ IROS (2010) 6187",
    },
    ..Card::DEFAULT
};

/// The law of `gear-friction`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct GearFriction;

impl<S: Scalar> Law<S> for GearFriction {
    fn contribute(&self, p: &[S], _x: &Point<S>, out: &mut Contributions<S>) {
        out.coulomb_per_torque += p[0];
    }
}
