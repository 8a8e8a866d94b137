//! Stribeck friction: the Coulomb torque increases by s exp(−(ω/v)²).

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Parameter, ParameterKind, Point, Rival, Scalar, Screening, Output, StandRun};

/// The card of `stribeck`.
pub const CARD: Card = Card {
    id: "stribeck",
    title: "Stribeck friction",
    equation: "the Coulomb torque increases by s exp(−(ω/v)²)",
    domain: Domain::Torque,
    coordinate: Coordinate::Omega,
    parameters: &[
        Parameter {
            name: "stribeck_N_m",
            unit: "N m",
            description: "increase s of the Coulomb torque at rest",
            range: (0.0, f64::INFINITY),
            start: 0.001,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.0015, 0.004),
        },
        Parameter {
            name: "stribeck_rate_rad_s",
            unit: "rad/s",
            description: "Stribeck rate v",
            range: (0.001, 100.0),
            start: 1.0,
            kind: ParameterKind::Positive,
            simulated_range: (0.5, 3.0),
        },
    ],
    rests_on: &["coulomb"],
    screening: Screening::RateFractions(&[0.005, 0.015, 0.05, 0.15, 0.4, 1.0]),
    rivals: &[Rival::by_rate_dependence("quadratic-drag")],
    next_run: StandRun::LOW_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Triangle(6.0, 8.0),
        duration_s: 8.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Omega),
        added: &[],
    }),
    limited_at_zero: &[0],
    dry_friction: Some(0),
    law: &Stribeck,
    description: Description {
        summary: "Breakaway takes more torque than sliding: the lubricant film builds up with the rate.",
        signature: "At low rates the friction falls with rising rate: the loop hunts (stick-slip) and the rotor leaves rest with a jerk.",
        experiment: "Pass through zero with a slow ramp, several times.",
        similar: "Coulomb friction alone (its torque becomes the mean of both levels); presliding.",
        reference: "Stribeck, VDI-Z 46 (1902); Armstrong-Hélouvry et al. (1994), §2.2",
    },
    ..Card::DEFAULT
};

/// The law of `stribeck`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Stribeck;

impl<S: Scalar> Law<S> for Stribeck {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let q = x.omega / p[1];
        out.coulomb_torque += p[0] * (-(q * q)).portable_exp();
    }
}
