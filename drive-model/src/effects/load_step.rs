//! A load that sets in: a constant torque from some moment on.

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `load-step`.
pub const CARD: Card = Card {
    id: "load-step",
    title: "A load that sets in",
    equation: "a constant torque from some moment on",
    domain: Domain::Torque,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "load_step_N_m",
            unit: "N m",
            description: "torque from then on",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0003,
            kind: ParameterKind::Signed,
            simulated_range: (0.0003, 0.001),
        },
        Parameter {
            name: "load_from_s",
            unit: "s",
            description: "moment at which it sets in",
            range: (0.0, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::EventTime,
            simulated_range: (5.0, 25.0),
        },
    ],
    polar: false,
    screen: Screen::Scan,
    family: "",
    description: Description {
        summary: "Something began to rub, or a weight was put on, during the record.",
        signature: "The model fits until one moment and is off by a constant torque after it.",
        experiment: "Repeat the same profile twice and compare.",
        similar: "Slow warming; a cable that winds up.",
        reference: "Basseville, Nikiforov, Detection of Abrupt Changes (1993)",
    },
};

/// The law of `load-step`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct LoadStep;

impl<S: Scalar> Law<S> for LoadStep {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        a.torque += p[0] * since(p[1], x.from_s, x.to_s);
    }
}

/// The part of [from, to) that lies after `moment`; its derivative by the moment is exact.
fn since<S: Scalar>(moment: S, from_s: f64, to_s: f64) -> S {
    if moment <= from_s {
        S::one()
    } else if moment >= to_s {
        S::zero()
    } else {
        (-moment + to_s) / (to_s - from_s)
    }
}
