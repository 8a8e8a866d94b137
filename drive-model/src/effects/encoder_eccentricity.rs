//! Encoder eccentricity: θ seen = θ + e sin(nθ + φ); a rate made from that encoder sees its derivative.

use crate::{Description, Card, Coordinate, ParameterKind, Law, Parameter, Point, Reading, Domain, Scalar, Screen};

/// The card of `encoder-eccentricity`.
pub const CARD: Card = Card {
    id: "encoder-eccentricity",
    title: "Encoder eccentricity",
    equation: "θ seen = θ + e sin(nθ + φ); a rate made from that encoder sees its derivative",
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
            description: "order n: 1 off-centre, 2 oval",
            range: (1.0, 8.0),
            start: 1.0,
            kind: ParameterKind::HarmonicOrder,
            simulated_range: (1.0, 2.0),
        },
        Parameter {
            name: "eccentricity_phase_rad",
            unit: "rad",
            description: "phase φ",
            range: (0.0, std::f64::consts::TAU),
            start: 0.0,
            kind: ParameterKind::Phase,
            simulated_range: (0.0, std::f64::consts::TAU),
        },
    ],
    polar: true,
    screen: Screen::Scan,
    family: "order-one",
    description: Description {
        summary: "The code disc sits off the axis (order one) or is oval (order two).",
        signature: "A ripple of angle and of the rate made from it, whose size grows with the rate; no torque is behind it.",
        experiment: "Two constant rates, one high, one low: a torque shows most at the low one, the encoder at the high one.",
        similar: "Unbalance and cogging, whose rate ripple falls with the rate.",
        reference: "Heidenhain, Rotary Encoders (eccentricity error)",
    },
};

/// The law of `encoder-eccentricity`; its parameters in the card's order.
#[derive(Debug, Clone, Copy)]
pub struct EncoderEccentricity;

impl<S: Scalar> Law<S> for EncoderEccentricity {
    fn measure(&self, p: &[S], x: &Point<S>, y: &mut Reading<S>) {
        let shown = x.theta * p[1] + p[2];
        let mut phase = shown;
        if x.theta_measured {
            // The disc errs by where it is, not by where it seems to be: else n e²/2 is left at the order 2n. Each turn of the loop leaves n e of
            // what the one before did.
            for _ in 0..2 {
                phase = shown - p[0] * p[1] * phase.sin();
            }
        }
        let (s, c) = phase.sin_cos();
        y.theta += p[0] * s;
        if x.rate_from_encoder {
            y.omega += p[0] * p[1] * c * x.omega;
        }
    }
    fn has_no_contribution(&self) -> bool {
        true
    }
}
