//! Torque at a fixed frequency: a sin(2πft + φ), t from the first row.

use std::f64::consts::TAU;

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, PeriodOf, Point, Requirement, Rival, Scalar, Screening, StandRun};

/// Separates a torque from a cause that follows the motion or the drive.
const TIME_OR_MOTION: &str = "A timed torque keeps its frequency and its size when the rate or the voltage changes. Hold several constant rates, also zero";

/// The card of `timed-torque`.
pub const CARD: Card = Card {
    id: "timed-torque",
    title: "Torque at a fixed frequency",
    equation: "torque a sin(2πft + φ), t since the first row",
    domain: Domain::Torque,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter::torque_amplitude("timed_torque_N_m", (0.0005, 0.002)),
        Parameter {
            name: "timed_torque_Hz",
            unit: "Hz",
            description: "frequency f",
            range: (1e-4, 500.0),
            start: 1.0,
            kind: ParameterKind::Periodicity,
            simulated_range: (0.5, 8.0),
        },
        Parameter {
            name: "timed_torque_phase_rad",
            unit: "rad",
            description: "phase φ at the first row",
            range: (0.0, TAU),
            start: 0.0,
            kind: ParameterKind::Phase,
            simulated_range: (0.0, TAU),
        },
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::SimulatedMotion],
    screening: Screening::Periodicities(PeriodOf::Time),
    rivals: &[
        Rival { effect: "cogging", separation: TIME_OR_MOTION, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "load-step", separation: TIME_OR_MOTION, run: StandRun::STEPS, change_of_stand: None },
    ],
    law: &TimedTorque,
    description: Description {
        summary: "Something beside the drive acts with its own clock: a pump, a fan, a neighbouring machine, the mains.",
        signature: "The residual oscillates at one frequency, whatever the rate; also at rest, if the torque exceeds the friction.",
        experiment: "Hold several constant rates; the frequency stays.",
        similar: "Cogging or a gear ripple, if the rate is constant; an oscillating supply, whose torque grows with the voltage.",
        reference: "Fourier component of a torque that depends on the time alone",
    },
    ..Card::DEFAULT
};

/// The law of `timed-torque`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct TimedTorque;

impl<S: Scalar> Law<S> for TimedTorque {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let elapsed_s = 0.5 * (x.from_s + x.to_s) - x.start_s;
        out.torque += p[0] * (p[1] * (TAU * elapsed_s) + p[2]).portable_sin();
    }
}
