//! Cogging: torque a sin(nθ + φ), independent of the current.

use crate::{Card, Compensation, Contributions, Coordinate, Description, Domain, HarmonicSource, Law, Parameter, Point, Requirement, Rival, Scalar, Screening, StandRun};

/// The card of `cogging`.
pub const CARD: Card = Card {
    id: "cogging",
    title: "Cogging",
    equation: "torque a sin(nθ + φ), independent of the current",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter::torque_amplitude("cogging_N_m", (0.001, 0.003)),
        Parameter::harmonic_order("cogging_order"),
        Parameter::phase("cogging_phase_rad"),
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::Angle],
    screening: Screening::Harmonics(HarmonicSource::Torque),
    rivals: &[Rival {
        effect: "torque-ripple",
        separation: "Cogging does not depend on the current, torque ripple grows with it. Turn through the same angles at small and at large currents",
        run: StandRun::VARYING_CURRENT,
        change_of_stand: None,
    }],
    next_run: StandRun::LOW_RATES,
    compensation: Some(Compensation::Harmonic),
    law: &Cogging,
    description: Description {
        summary: "The magnets pull the iron teeth of the armature towards the nearest pole, with or without current.",
        signature: "The rate ripples at a fixed number of periods per turn, most at low rates; at rest the rotor moves from tooth to tooth.",
        experiment: "Turn slowly through several whole turns.",
        similar: "Torque ripple, which grows with the current; encoder eccentricity, whose ripple grows with the rate; unbalance at harmonic order 1.",
        reference: "Hanselman, Brushless Permanent Magnet Motor Design (2006), ch. 4",
    },
    ..Card::DEFAULT
};

/// The law of `cogging`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Cogging;

impl<S: Scalar> Law<S> for Cogging {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque += p[0] * (x.theta * p[1] + p[2]).portable_sin();
    }
}
