//! Lost counts of the encoder: the angle reading jumps at a time; a rate derived from this encoder shows the jump as a spike.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, Law, Motion, Output, Parameter, ParameterKind, Point, Reading, Requirement, Rival, Scalar, Screening, StandRun, Structure};

/// The card of `lost-counts`.
pub const CARD: Card = Card {
    id: "lost-counts",
    title: "Lost counts of the encoder",
    equation: "angle reading θ + δ from a time t0 on; a rate derived from this encoder contains the spike",
    domain: Domain::Measurement,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "lost_counts_rad",
            unit: "rad",
            description: "jump δ: number of lost counts times the angle of a count",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.01,
            kind: ParameterKind::Signed,
            simulated_range: (0.006, 0.02),
        },
        Parameter {
            name: "lost_at_s",
            unit: "s",
            description: "time t0",
            range: (f64::NEG_INFINITY, f64::INFINITY),
            start: 0.0,
            kind: ParameterKind::EventTime,
            simulated_range: (5.0, 25.0),
        },
    ],
    repeatable: true,
    requires: &[Requirement::Angle, Requirement::ComparedAngle],
    screening: Screening::AngleJumps(2),
    rivals: &[Rival {
        effect: "backlash",
        separation: "Lost counts do not come back at the next reversal. Turn forward and back over the same index",
        run: StandRun::LOW_RATES,
        change_of_stand: None,
    }],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(10.0),
        duration_s: 1.0,
        output: Output::EncoderRate,
        abscissa: Abscissa::Coordinate(Coordinate::Time),
        added: &[],
    }),
    law: &LostCounts,
    description: Description {
        summary: "Interference, a dirty disc or too high a rate makes the counter miss or add counts; the angle is off from then on.",
        signature: "The increments of the angle are off for one interval; everything else goes on undisturbed.",
        experiment: "Turn forward and back over the same index pulse and compare the count there.",
        similar: "A single wild reading, which comes back in the next row; a jolt, which rate and current show too.",
        reference: "Heidenhain, Rotary Encoders: counting errors by interference",
    },
    ..Card::DEFAULT
};

/// The law of `lost-counts`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct LostCounts;

impl<S: Scalar> Law<S> for LostCounts {
    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.angle_jumps = true;
    }
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        if p[1] <= x.from_s {
            y.theta += p[0];
            y.jumped += p[0];
        }
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
