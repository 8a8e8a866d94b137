//! A load that sets in: a constant torque from some moment on.

use crate::{Account, Acts, Card, Coordinate, Kind, Law, Parameter, Point, Room, Scalar, Screen};

/// The card of `load-step`.
pub const CARD: Card = Card {
    id: "load-step",
    title: "A load that sets in",
    equation: "a constant torque from some moment on",
    room: Room::Torque,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "load_step_N_m",
            unit: "N m",
            says: "torque from then on",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0003,
            kind: Kind::Signed,
            hidden: (0.0003, 0.001),
        },
        Parameter {
            name: "load_from_s",
            unit: "s",
            says: "moment at which it sets in",
            range: (0.0, f64::INFINITY),
            start: 0.0,
            kind: Kind::Moment,
            hidden: (5.0, 25.0),
        },
    ],
    polar: false,
    screen: Screen::Scan,
    family: "",
    account: Account {
        what: "Something began to rub, or a weight was put on, during the record.",
        shows: "The model fits until one moment and is off by a constant torque after it.",
        experiment: "Repeat the same profile twice and compare.",
        looks_like: "Slow warming; a cable that winds up.",
        reference: "Basseville, Nikiforov, Detection of Abrupt Changes (1993)",
    },
};

/// The law of `load-step`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct LoadStep;

impl<S: Scalar> Law<S> for LoadStep {
    fn act(&self, p: &[S], x: &Point<S>, a: &mut Acts<S>) {
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
