//! Inertia that varies with the angle: J(θ) = J (1 + a cos(nθ + φ)), with Lagrange's torque −½ J′(θ) ω².

use crate::{Abscissa, Card, Contributions, Coordinate, Demonstration, Description, Domain, HarmonicSource, Law, Motion, Output, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, Screening, StandRun, Structure};

/// The card of `inertia-variation`.
pub const CARD: Card = Card {
    id: "inertia-variation",
    title: "Inertia that varies with the angle",
    equation: "J(θ) = J (1 + a cos(nθ + φ)) in J(θ) ω’ + ½ J’(θ) ω² = torque",
    domain: Domain::Torque,
    coordinate: Coordinate::Theta,
    parameters: &[
        Parameter {
            name: "inertia_variation",
            unit: "1",
            description: "relative amplitude a",
            range: (0.0, 0.9),
            start: 0.1,
            kind: ParameterKind::NonNegative,
            simulated_range: (0.1, 0.3),
        },
        Parameter {
            name: "inertia_variation_order",
            unit: "1/turn",
            description: "harmonic order n: periods per turn; 2 for most of a crank",
            range: (1.0, 20.0),
            start: 2.0,
            kind: ParameterKind::HarmonicOrder,
            simulated_range: (1.0, 4.0),
        },
        Parameter::phase("inertia_variation_phase_rad"),
    ],
    polar: true,
    repeatable: true,
    requires: &[Requirement::Angle],
    screening: Screening::Harmonics(HarmonicSource::Inertia),
    rivals: &[
        Rival {
            effect: "cogging",
            separation: "The torque of a varying inertia grows with the square of the rate and with the acceleration; cogging is the same at every rate. Turn slowly and fast through the same angles",
            run: StandRun::HIGH_RATES,
            change_of_stand: None,
        },
        Rival {
            effect: "torque-ripple",
            separation: "At a constant high rate the current is small: torque ripple vanishes, the torque of a varying inertia does not",
            run: StandRun::HIGH_RATES,
            change_of_stand: None,
        },
        Rival {
            effect: "unbalance",
            separation: "Gravity is the same at every rate; the torque of a varying inertia grows with the square of the rate",
            run: StandRun::HIGH_RATES,
            change_of_stand: None,
        },
        Rival {
            effect: "encoder-eccentricity",
            separation: "A varying inertia needs a torque and appears in the current; an error of the encoder does not",
            run: StandRun::HIGH_RATES,
            change_of_stand: None,
        },
    ],
    next_run: StandRun::HIGH_RATES,
    demonstration: Some(Demonstration {
        motion: Motion::Constant(20.0),
        duration_s: 2.0,
        output: Output::Current,
        abscissa: Abscissa::Coordinate(Coordinate::Theta),
        added: &[],
    }),
    law: &InertiaVariation,
    description: Description {
        summary: "A crank, a cam or an unbalanced linkage is driven: its inertia, seen from the shaft, depends on the angle.",
        signature: "A ripple at a fixed harmonic order whose torque grows with the square of the rate and with the acceleration; a free rotor is fast where the inertia is small.",
        experiment: "Run several constant rates, then accelerate hard through whole turns.",
        similar: "Cogging and unbalance, whose torque does not depend on the rate; torque ripple, which grows with the current.",
        reference: "Lagrange's equation for T = ½ J(θ) ω²; Dresig, Holzweißig, Dynamics of Machinery (2010), §2.4",
    },
    ..Card::DEFAULT
};

/// The law of `inertia-variation`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct InertiaVariation;

impl<S: Scalar> Law<S> for InertiaVariation {
    fn configure(&self, _p: &[S], structure: &mut Structure<S>) {
        structure.varying_inertia = true;
    }
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let (variation, order, phase) = (p[0], p[1], p[2]);
        let (sin, cos) = (x.theta * order + phase).portable_sin_cos();
        out.inertia_variation += variation * cos;
        out.inertia_slope -= variation * order * sin;
    }
}
