//! Torque ripple: motor constant K (1 + a sin(nθ + φ)), in torque and back-EMF.

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, HarmonicSource, Law, Motion, Parameter, ParameterKind, Point, Requirement, Scalar, Screening, Output, StandRun};

/// The card of `torque-ripple`.
pub const CARD: Card = Card {
    id: "torque-ripple",
    title: "Torque ripple",
    equation: "motor constant K (1 + a sin(nθ + φ)), in torque and back-EMF",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "ripple",
            unit: "1",
            description: "relative amplitude a",
            range: (0.0, 1.0),
            start: 0.01,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.03, 0.08),
        },
        Parameter::harmonic_order("ripple_order"),
        Parameter::phase("ripple_phase_rad"),
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::MotorConstant, Requirement::Angle],
    screening: Screening::Harmonics(HarmonicSource::MotorConstant),
    next_run: StandRun::VARYING_CURRENT,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(2.0),
        duration_s: 7.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Theta),
        added: &[Demonstration::WEIGHT],
    }),
    law: &TorqueRipple,
    description: Description {
        summary: "The motor constant varies with the angle, because of few commutator segments or uneven magnets.",
        signature: "A ripple at a fixed harmonic order that grows with the current and appears in the back-EMF.",
        experiment: "Turn slowly under different loads and compare the ripple at small and at large current.",
        similar: "Cogging, which is present without current too.",
        reference: "Hanselman, Brushless Permanent Magnet Motor Design (2006), ch. 5",
    },
    ..Card::DEFAULT
};

/// The law of `torque-ripple`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct TorqueRipple;

impl<S: Scalar> Law<S> for TorqueRipple {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let (ripple, order, phase) = (p[0], p[1], p[2]);
        out.motor_factor *= ripple * (x.theta * order + phase).portable_sin() + 1.0;
    }
}
