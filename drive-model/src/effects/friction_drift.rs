//! Friction that drifts with time: Coulomb torque c (1 + a e^(−t/τ)), viscous coefficient b (1 + d e^(−t/τ)), t from the first row.

use crate::{Card, Contributions, Coordinate, Description, Domain, Law, Parameter, ParameterKind, Point, Requirement, Rival, Scalar, Screening, StandRun};

/// Separates a slow drift from an event and from an effect of the winding temperature.
const DRIFT_OR_OTHER: &str = "Repeat the same profile directly afterwards: friction that has run in stays low, an event does not recur, and the winding temperature can be measured";

/// The card of `friction-drift`.
pub const CARD: Card = Card {
    id: "friction-drift",
    title: "Friction that drifts with time",
    equation: "Coulomb torque c (1 + a exp(−t/τ)), viscous coefficient b (1 + d exp(−t/τ)), t since the first row",
    domain: Domain::Torque,
    coordinate: Coordinate::Time,
    parameters: &[
        Parameter {
            name: "coulomb_drift",
            unit: "1",
            description: "relative excess a of the Coulomb torque at the first row",
            range: (-1.0, 20.0),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.3, 0.9),
        },
        Parameter {
            name: "viscous_drift",
            unit: "1",
            description: "relative excess d of the viscous coefficient at the first row",
            range: (-1.0, 20.0),
            start: 0.0,
            kind: ParameterKind::Signed,
            simulated_range: (0.3, 0.9),
        },
        Parameter {
            name: "friction_drift_s",
            unit: "s",
            description: "time constant τ",
            range: (0.1, 1e6),
            start: 10.0,
            kind: ParameterKind::Positive,
            simulated_range: (5.0, 20.0),
        },
    ],
    rests_on: &["coulomb", "viscous"],
    inert_alone: true,
    requires: &[Requirement::SimulatedMotion],
    screening: Screening::LogFractions(&[0.05, 0.2, 0.6, 2.0]),
    rivals: &[
        Rival { effect: "load-step", separation: DRIFT_OR_OTHER, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "viscous-temperature", separation: DRIFT_OR_OTHER, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "resistance-temperature", separation: DRIFT_OR_OTHER, run: StandRun::STEPS, change_of_stand: None },
        Rival { effect: "cable-spring", separation: DRIFT_OR_OTHER, run: StandRun::STEPS, change_of_stand: None },
    ],
    law: &FrictionDrift,
    description: Description {
        summary: "Grease is distributed and warms, brushes run in: after a rest the friction is higher than in steady operation.",
        signature: "The residual looks like friction and its size changes over the log, most at the beginning.",
        experiment: "Repeat the same profile several times without a rest between.",
        similar: "Effects of the winding temperature, if it is not measured; a load step; a supply that recovers.",
        reference: "Armstrong-Hélouvry, Control of Machines with Friction (1991), §3: warm-up of the friction",
    },
    ..Card::DEFAULT
};

/// The law of `friction-drift`; its parameters in the order of the card.
#[derive(Debug, Clone, Copy)]
pub struct FrictionDrift;

impl<S: Scalar> Law<S> for FrictionDrift {
    fn contribute(&self, p: &[S], x: &Point<S>, out: &mut Contributions<S>) {
        let elapsed_s = 0.5 * (x.from_s + x.to_s) - x.start_s;
        let left = (-(p[2].recip() * elapsed_s)).portable_exp();
        // Friction does not drive.
        let factor = |excess: S| {
            let factor = excess * left + 1.0;
            if factor > 0.0 { factor } else { S::zero() }
        };
        out.coulomb_factor *= factor(p[0]);
        out.viscous_factor *= factor(p[1]);
    }
}
