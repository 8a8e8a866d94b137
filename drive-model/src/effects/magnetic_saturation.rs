//! Magnetic saturation: K / (1 + (i/i_s)²).

use crate::{Description, Contributions, Structure, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `magnetic-saturation`.
pub const CARD: Card = Card {
    id: "magnetic-saturation",
    title: "Magnetic saturation",
    equation: "K / (1 + (i/i_s)²)",
    domain: Domain::Electrical,
    coordinate: Coordinate::Current,
    parameters: &[
        Parameter {
            name: "saturation_A",
            unit: "A",
            description: "current i_s at which K has halved",
            range: (0.05, 1000.0),
            start: 3.0,
            kind: ParameterKind::Positive,
            simulated_range: (0.7, 1.5),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    description: Description {
        summary: "At high current the iron saturates and the torque no longer follows the current.",
        signature: "The torque per ampere falls at high current.",
        experiment: "Accelerate hard with several currents and compare torque per ampere.",
        similar: "Quadratic drag, when high current and high rate come together; a rising winding resistance.",
        reference: "Hanselman (2006), ch. 2",
    },
};

/// The law of `magnetic-saturation`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct MagneticSaturation;

impl<S: Scalar> Law<S> for MagneticSaturation {
    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.needs_current = true;
    }
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        let q = x.current / p[0];
        a.motor_factor *= (q * q + 1.0).recip();
    }
}
