//! Ripple of a gear or belt: torque a sin(ρθ + φ), where the number of periods per turn ρ need not be whole.

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, Law, Motion, Output, Parameter, ParameterKind, PeriodOf, Point, Requirement, Rival, Scalar, Screening, StandRun};

/// The card of `gear-ripple`.
pub const CARD: Card = Card {
    id: "gear-ripple",
    title: "Ripple of a gear or belt",
    equation: "torque a sin(ρθ + φ); ρ need not be whole",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter::torque_amplitude("gear_ripple_N_m", (0.001, 0.003)),
        Parameter {
            name: "gear_ripple_order",
            unit: "1/turn",
            description: "periods ρ per turn of the platform",
            range: (0.01, 400.0),
            start: 4.37,
            kind: ParameterKind::Periodicity,
            simulated_range: (2.1, 14.9),
        },
        Parameter::phase("gear_ripple_phase_rad"),
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::Angle],
    reduces_to: Some("cogging"),
    screening: Screening::Periodicities(PeriodOf::Angle),
    rivals: &[
        Rival {
            effect: "cogging",
            separation: "Cogging of the disc's own shaft has a whole number of periods per turn. Turn slowly through many turns: the phase of another number moves from turn to turn",
            run: StandRun::LOW_RATES,
            change_of_stand: None,
        },
        Rival {
            effect: "timed-torque",
            separation: "A ripple of a gear follows the angle, a timed torque the clock. Turn at several rates",
            run: StandRun::LOW_RATES,
            change_of_stand: None,
        },
    ],
    next_run: StandRun::LOW_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(5.0),
        duration_s: 2.0,
        output: Output::Current,
        abscissa: Abscissa::TotalAngle,
        added: &[],
    }),
    law: &GearRipple,
    description: Description {
        summary: "A motor, a gear wheel or a belt before the platform turns at its own ratio; its cogging or eccentricity has a number of periods per turn of the platform that is not whole.",
        signature: "A ripple over the angle whose phase moves from turn to turn: it averages out over the angle within the turn.",
        experiment: "Turn slowly through many whole turns in one direction.",
        similar: "Cogging, whose number of periods per turn is whole; a torque at a fixed frequency, if the rate is constant.",
        reference: "Smith, Gear Noise and Vibration (2003), ch. 1: meshing and once-per-revolution frequencies of each shaft",
    },
    ..Card::DEFAULT
};

/// The law of `gear-ripple`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct GearRipple;

impl<S: Scalar> Law<S> for GearRipple {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        out.torque += p[0] * (x.theta * p[1] + p[2]).portable_sin();
    }
}
