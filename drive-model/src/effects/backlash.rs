//! Backlash: the shaft of compliance with a gap (the whole play).

use crate::{Account, Arms, Card, Coordinate, Kind, Law, Parameter, Room, Scalar, Screen, Shaft};

/// The card of `backlash`.
pub const CARD: Card = Card {
    id: "backlash",
    title: "Backlash",
    equation: "the shaft of compliance with a gap (the whole play)",
    room: Room::Torque,
    coordinate: Coordinate::History,
    parameters: &[
        Parameter {
            name: "gap_rad",
            unit: "rad",
            says: "whole play of the gap",
            range: (0.0, 1.0),
            start: 0.02,
            kind: Kind::Level,
            hidden: (0.02, 0.06),
        },
        Parameter {
            name: "shaft_N_m_rad",
            unit: "N m/rad",
            says: "stiffness k in contact",
            range: (0.001, 100000.0),
            start: 5.0,
            kind: Kind::Positive,
            hidden: (4.0, 8.0),
        },
        Parameter {
            name: "shaft_N_m_s_rad",
            unit: "N m s/rad",
            says: "damping c in contact",
            range: (0.0, f64::INFINITY),
            start: 0.02,
            kind: Kind::Level,
            hidden: (0.01, 0.03),
        },
        Parameter {
            name: "motor_inertia_share",
            unit: "1",
            says: "share r of the inertia on the motor’s side",
            range: (0.01, 0.99),
            start: 0.3,
            kind: Kind::Share,
            hidden: (0.3, 0.3),
        },
    ],
    polar: false,
    screen: Screen::Probe,
    family: "",
    account: Account {
        what: "There is play between motor and platform: a worn gear or coupling.",
        shows: "After each reversal of the torque the platform coasts for a moment, then is hit.",
        experiment: "Small reversing torques: multisine or square waves around zero.",
        looks_like: "Compliance; presliding friction.",
        reference: "Nordin, Gutman, Automatica 38 (2002) 1633",
    },
};

/// The law of `backlash`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Backlash;

impl<S: Scalar> Law<S> for Backlash {
    fn arm(&self, p: &[S], arms: &mut Arms<S>) {
        arms.shaft = Some(Shaft { stiffness: p[1], damping: p[2], share: p[3], gap: p[0] });
    }
    fn is_silent(&self) -> bool {
        true
    }
}
