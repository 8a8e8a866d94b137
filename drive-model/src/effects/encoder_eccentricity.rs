//! Encoder eccentricity: angle reading θ + e sin(nθ + φ); a rate derived from this encoder contains the derivative.

use crate::{Abscissa, Card, Coordinate, Demonstration, Description, Domain, HarmonicSource, Law, Motion, Parameter, ParameterKind, Point, Reading, Requirement, Rival, Scalar, Screening, Output, StandRun};

/// Separates a torque from an error of the encoder.
const TORQUE_OR_ENCODER: &str = "Compare slow and fast turns: the rate ripple of a torque falls with the rate, the ripple of an eccentric encoder grows with it";

/// The card of `encoder-eccentricity`.
pub const CARD: Card = Card {
    id: "encoder-eccentricity",
    title: "Encoder eccentricity",
    equation: "angle reading θ + e sin(nθ + φ); a rate derived from this encoder contains the derivative",
    domain: Domain::Measurement,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "eccentricity_rad",
            unit: "rad",
            description: "amplitude e",
            range: (0.0, 0.5),
            start: 0.002,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.003, 0.01),
        },
        Parameter {
            name: "eccentricity_order",
            unit: "1/turn",
            description: "harmonic order n: 1 eccentric, 2 oval",
            range: (1.0, 8.0),
            start: 1.0,
            kind: ParameterKind::HarmonicOrder,
            simulated_range: (1.0, 2.0),
        },
        Parameter::phase("eccentricity_phase_rad"),
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::Angle, Requirement::AngleReading, Requirement::Turns { min: 1.5, rival: None }],
    uses_rate_source: true,
    screening: Screening::Harmonics(HarmonicSource::Encoder),
    family: "order-one",
    rivals: &[
        Rival { effect: "unbalance", separation: TORQUE_OR_ENCODER, run: StandRun::HIGH_RATES, change_of_stand: None },
        Rival { effect: "cogging", separation: TORQUE_OR_ENCODER, run: StandRun::HIGH_RATES, change_of_stand: None },
        Rival { effect: "rate-g-sensitivity", separation: TORQUE_OR_ENCODER, run: StandRun::HIGH_RATES, change_of_stand: None },
    ],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(20.0),
        duration_s: 1.0,
        output: Output::EncoderRate,
        abscissa: Abscissa::Coordinate(Coordinate::Theta),
        added: &[],
    }),
    law: &EncoderEccentricity,
    description: Description {
        summary: "The code disc is mounted off the axis (harmonic order 1) or is oval (harmonic order 2).",
        signature: "A ripple of the angle and of the rate derived from it, proportional to the rate; no torque causes it.",
        experiment: "Run two constant rates, one high and one low: a torque has most effect at the low rate, the encoder at the high rate.",
        similar: "Unbalance and cogging, whose rate ripple falls with the rate. With the angle as a known motion: a rate sensor with an error per turn, which no log of one encoder tells from this.",
        reference: "Heidenhain, Rotary Encoders (eccentricity error)",
    },
    ..Card::DEFAULT
};

/// The law of `encoder-eccentricity`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct EncoderEccentricity;

impl<S: Scalar> Law<S> for EncoderEccentricity {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        let shown = x.theta * p[1] + p[2];
        let mut phase = shown;
        if x.theta_measured {
            // The error depends on the true angle, not on the reading: otherwise n e²/2 would remain at the harmonic order 2n. Each
            // iteration reduces the remaining error by the factor n e.
            for _ in 0..2 {
                phase = shown - p[0] * p[1] * phase.portable_sin();
            }
        }
        let (s, c) = phase.portable_sin_cos();
        y.theta += p[0] * s;
        let slope = p[0] * p[1] * c;
        if x.reference_angle {
            // x.omega contains the error, (1 + slope) times the true rate.
            y.omega -= slope / (slope + 1.0) * x.omega;
        } else if x.rate_from_encoder {
            y.omega += slope * x.omega;
        }
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
