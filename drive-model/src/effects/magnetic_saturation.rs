//! Magnetic saturation: motor constant K / (1 + (i/i_s)²).

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Requirement, Scalar, Screening, Output, StandRun, Structure};

/// The card of `magnetic-saturation`.
pub const CARD: Card = Card {
    id: "magnetic-saturation",
    title: "Magnetic saturation",
    equation: "motor constant K / (1 + (i/i_s)²)",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "saturation_A",
            unit: "A",
            description: "current i_s at which K is halved",
            range: (0.05, 1000.0),
            start: 3.0,
            kind: ParameterKind::Positive,
            simulated_range: (0.7, 1.5),
        },
    ],
    requires: &[Requirement::MotorConstant, Requirement::SimulatedCurrent],
    screening: Screening::CurrentMultiple { multiple: 3.0, limits_A: (0.051, 999.0) },
    next_run: StandRun::VARYING_CURRENT,
    // The torque of a saturated motor is limited: the command stays below the limit.
    demonstration: Some(Demonstration {
        motion: Motion::Sine(5.0, 1.0),
        duration_s: 2.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Current),
        added: &[],
    }),
    law: &MagneticSaturation,
    description: Description {
        summary: "At high current the iron saturates and the torque is no longer proportional to the current.",
        signature: "The torque per ampere falls at high current.",
        experiment: "Accelerate hard with several currents and compare the torque per ampere.",
        similar: "Quadratic drag, if high current and high rate coincide; a rising winding resistance.",
        reference: "Hanselman, Brushless Permanent Magnet Motor Design (2006), ch. 2",
    },
    ..Card::DEFAULT
};

/// The law of `magnetic-saturation`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct MagneticSaturation;

impl<S: Scalar> Law<S> for MagneticSaturation {
    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.needs_current = true;
    }
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let q = x.current / p[0];
        out.motor_factor *= (q * q + 1.0).recip();
    }
}
