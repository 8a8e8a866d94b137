//! Unbalance: torque a sin(θ + φ): a mass off the axis of a tilted stand.

use crate::{Card, Compensation, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, StandRun};

/// The card of `unbalance`.
pub const CARD: Card = Card {
    id: "unbalance",
    title: "Unbalance",
    equation: "torque a sin(θ + φ): a mass off the axis of a tilted stand",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "unbalance_N_m",
            unit: "N m",
            description: "amplitude a = m g r sin(tilt)",
            range: (0.0, f64::INFINITY),
            start: 0.0005,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.001, 0.004),
        },
        Parameter::phase("unbalance_phase_rad"),
    ],
    polar: true,
    requires: &[Requirement::Angle, Requirement::Turns { min: 0.25, rival: Some("cable-spring") }],
    family: "order-one",
    rivals: &[Rival {
        effect: "rate-g-sensitivity",
        separation: "Gravity acts on the motion and appears in the angle too, most at low rates; an error of the rate sensor appears in that channel alone, at every rate. Record the encoder angle and turn slowly",
        run: StandRun::LOW_RATES,
        change_of_stand: None,
    }],
    next_run: StandRun::LOW_RATES,
    compensation: Some(Compensation::FirstHarmonic),
    law: &Unbalance,
    description: Description {
        summary: "The centre of mass is off the axis and the axis is not vertical: gravity applies a torque with one period per turn.",
        signature: "A ripple of harmonic order 1, strongest at low rates; the platform always comes to rest at the same angle.",
        experiment: "Turn slowly through whole turns; then change the tilt and compare the amplitude.",
        similar: "Encoder eccentricity (grows with the rate); a g-sensitive rate sensor, if only that sensor measures the rate.",
        reference: "ISO 21940",
    },
    ..Card::DEFAULT
};

/// The law of `unbalance`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct Unbalance;

impl<S: Scalar> Law<S> for Unbalance {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque += p[0] * (x.theta + p[1]).portable_sin();
    }
}
