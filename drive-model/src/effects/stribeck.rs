//! Stribeck friction: the dry level gains s exp(−(ω/v)²).

use crate::{Description, Contributions, Card, Coordinate, ParameterKind, Law, Parameter, Point, Domain, Scalar, Screen};

/// The card of `stribeck`.
pub const CARD: Card = Card {
    id: "stribeck",
    title: "Stribeck friction",
    equation: "the dry level gains s exp(−(ω/v)²)",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "stribeck_N_m",
            unit: "N m",
            description: "gain s of the dry level at rest",
            range: (0.0, f64::INFINITY),
            start: 0.001,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.0015, 0.004),
        },
        Parameter {
            name: "stribeck_rate_rad_s",
            unit: "rad/s",
            description: "rate v over which it fades",
            range: (0.001, 100.0),
            start: 1.0,
            kind: ParameterKind::Positive,
            simulated_range: (0.5, 3.0),
        },
    ],
    polar: false,
    screen: Screen::Scan,
    family: "",
    description: Description {
        summary: "Breaking loose takes more torque than sliding: the lubricant film only builds up with the rate.",
        signature: "At low rates the friction falls with rising rate: the loop hunts and slips, the rotor leaves rest with a jerk.",
        experiment: "Creep through zero with a slow ramp, several times.",
        similar: "Coulomb friction alone (it takes the mean of both levels); presliding.",
        reference: "Stribeck, VDI-Z 46 (1902); Armstrong-Hélouvry et al. (1994), §2.2",
    },
};

/// The law of `stribeck`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct Stribeck;

impl<S: Scalar> Law<S> for Stribeck {
    fn contribute(&self, p: &[S], x: &Point<S>, a: &mut Contributions<S>) {
        let q = x.omega / p[1];
        a.coulomb_torque += p[0] * (-(q * q)).exp();
    }
}
