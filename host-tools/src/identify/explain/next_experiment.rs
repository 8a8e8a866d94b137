//! The next experiment: the one that distinguishes rivals, otherwise the one that determines the effect better, otherwise the one that the
//! logs lack for a sure verdict.

use super::answer::{Candidate, Verdict};
use super::coverage::Coverage;

/// An experiment to do next.
#[derive(Debug, Clone, PartialEq)]
pub struct NextExperiment {
    /// Its purpose.
    pub purpose: Purpose,
    /// The session.
    pub run: Run,
}

/// Purpose of an experiment. Effects are identifiers of cards where not stated otherwise.
#[derive(Debug, Clone, PartialEq)]
pub enum Purpose {
    /// Distinguish two effects.
    Distinguish {
        /// Name of the effect in the model.
        effect: String,
        /// Name of its rival in the model.
        rival: String,
        /// How they differ; `None`: the experiments of both cards are proposed.
        difference: Option<&'static str>,
    },
    /// Rotate in both directions.
    BothDirections,
    /// Determine an effect better.
    Determine {
        /// The effect.
        effect: &'static str,
    },
    /// See which of the remainder repeats.
    Repeat,
    /// Rotate slowly through whole turns.
    SlowTurns,
}

/// A session of `stand sim`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// `rate` or `voltage`.
    pub mode: &'static str,
    /// The profile.
    pub profile: &'static str,
    /// Its amplitude, rad/s or V.
    pub amplitude: f64,
    /// Its duration, s.
    pub duration_s: f64,
}

impl Run {
    const fn rate(profile: &'static str, amplitude_rad_s: f64, duration_s: f64) -> Run {
        Run { mode: "rate", profile, amplitude: amplitude_rad_s, duration_s }
    }

    const fn voltage(profile: &'static str, amplitude_V: f64, duration_s: f64) -> Run {
        Run { mode: "voltage", profile, amplitude: amplitude_V, duration_s }
    }
}

/// Slow steps of the rate through zero, in both directions: whole turns at a few rad/s.
pub const SLOW: Run = Run::rate("staircase", 4.0, 60.0);
/// Steps of the rate up to the range of the rate sensor.
pub const FAST: Run = Run::rate("staircase", 30.0, 40.0);
/// Small steps of the voltage, at which the rotor sticks and breaks loose.
pub const STICKING: Run = Run::voltage("staircase", 0.4, 60.0);
/// Many frequencies at once up to 20 Hz, open loop.
pub const BROADBAND: Run = Run::voltage("multisine", 0.7, 30.0);
/// Sharp steps, open loop.
pub const SHARP: Run = Run::voltage("prbs", 0.7, 30.0);
/// The same angles and rates at small and at large currents.
pub const LOADED: Run = Run::rate("sweep", 15.0, 60.0);
/// Reversals without a pause: large currents that warm the winding.
pub const WARMING: Run = Run::rate("prbs", 15.0, 120.0);
/// All kinds of rates with rests between them.
pub const STEPS: Run = Run::rate("multi-step", 15.0, 60.0);

/// Every run that can be proposed.
pub const RUNS: [Run; 8] = [SLOW, FAST, STICKING, BROADBAND, SHARP, LOADED, WARMING, STEPS];

/// The run that shows an effect best.
pub fn run_for(id: &str) -> Run {
    match id {
        "cogging" | "unbalance" | "rate-g-sensitivity" | "stribeck" => SLOW,
        "coulomb" | "presliding" | "brush-drop" | "dead-time" => STICKING,
        "viscous"
        | "quadratic-drag"
        | "asymmetric-friction"
        | "load"
        | "cable-spring"
        | "rate-scale"
        | "rate-scale-nonlinearity"
        | "encoder-eccentricity" => FAST,
        "torque-ripple" | "magnetic-saturation" | "current-scale" | "supply-droop" => LOADED,
        "viscous-temperature" | "resistance-temperature" | "rate-bias-temperature" => WARMING,
        "compliance" | "sensor-lag" | "time-skew" => BROADBAND,
        "backlash" | "inductance" => SHARP,
        _ => STEPS,
    }
}

/// How two effects differ, and the run that shows it; `None` where only their cards state their best experiments.
pub fn difference(one: &str, other: &str) -> Option<(&'static str, Run)> {
    let pair = |a: &str, b: &str| (one == a && other == b) || (one == b && other == a);
    let either = |a: &str| one == a || other == a;
    let friction = ["viscous", "coulomb", "asymmetric-friction", "load", "stribeck", "quadratic-drag"];
    Some(if pair("brush-drop", "dead-time") {
        (
            "Both lose a constant part of the voltage, the brushes in the motor and the dead time in the bridge. Measure the voltage at the motor's terminals and log it as u_V with the note `u_V: terminal`: the brush drop stays, the dead time does not. The run passes slowly through the dead zone, where the loss is largest relative to the voltage",
            STICKING,
        )
    } else if pair("load", "asymmetric-friction") {
        (
            "A load is the same torque at every rate. Direction-dependent friction also grows with the rate. Hold low and high rates in both directions. If only the constant part is visible even then, the two are the same torque, and only an inspection of the stand decides",
            FAST,
        )
    } else if pair("unbalance", "rate-g-sensitivity") {
        (
            "An unbalance is visible in the angle too, most at low rates. The g-sensitivity of the rate sensor is visible in the rate channel alone, at every rate. Log the encoder's angle and rotate slowly",
            SLOW,
        )
    } else if either("encoder-eccentricity") && (either("unbalance") || either("cogging") || either("rate-g-sensitivity")) {
        (
            "Compare slow and fast turns. The effect of a torque on the rate falls as the rate grows; the effect of an eccentric encoder grows with the rate",
            FAST,
        )
    } else if pair("sensor-lag", "time-skew") {
        ("A slow sensor attenuates high frequencies; a delayed channel only shifts them. Excite many frequencies at once", BROADBAND)
    } else if pair("coulomb", "brush-drop") || pair("coulomb", "dead-time") {
        (
            "Log the current besides the voltage (i_A): friction needs a torque and therefore a current, a lost voltage does not. Use small voltages, at which the rotor sticks",
            STICKING,
        )
    } else if pair("cogging", "torque-ripple") {
        ("Cogging does not depend on the current, torque ripple grows with it. Pass the same angles at small and at large currents", LOADED)
    } else if pair("compliance", "backlash") {
        ("A compliant shaft oscillates after every step, backlash only where the torque reverses. Use sharp steps of both kinds", SHARP)
    } else if pair("quadratic-drag", "magnetic-saturation") {
        ("Drag depends on the rate, saturation on the current. Accelerate strongly at low rates, and hold high rates", LOADED)
    } else if pair("viscous-temperature", "resistance-temperature") || pair("resistance-temperature", "supply-droop") {
        (
            "Warm the winding by large currents and log its temperature and the supply voltage. An effect of the temperature remains when the current falls",
            WARMING,
        )
    } else if pair("load-step", "cable-spring") || pair("load-step", "viscous-temperature") || pair("load-step", "resistance-temperature") {
        ("Repeat the same profile. A load that set in once does not set in at the same second again", STEPS)
    } else if friction.contains(&one) && friction.contains(&other) {
        (
            "Contributions to friction differ in how they depend on the rate and its sign. Pass through zero slowly, several times, in both directions",
            SLOW,
        )
    } else {
        return None;
    })
}

/// The next experiment; `None` where nothing is open.
pub fn next_experiment(candidates: &[Candidate], missing: &[String], verdict: Verdict, coverage: &Coverage) -> Option<NextExperiment> {
    let ambiguous = candidates.iter().find(|c| missing.contains(&c.effect) && !c.ambiguous_with.is_empty());
    if let Some(candidate) = ambiguous {
        return distinguish(candidate);
    }
    if !coverage.both_ways {
        return Some(NextExperiment { purpose: Purpose::BothDirections, run: SLOW });
    }
    match verdict {
        Verdict::EffectFound => {
            let effect = drive_model::card(card_id(missing.first()?))?.id;
            Some(NextExperiment { purpose: Purpose::Determine { effect }, run: run_for(effect) })
        }
        Verdict::UnknownStructure => Some(NextExperiment { purpose: Purpose::Repeat, run: STEPS }),
        Verdict::Adequate if !coverage.slow_turns => Some(NextExperiment { purpose: Purpose::SlowTurns, run: SLOW }),
        Verdict::Adequate => None,
    }
}

/// The experiment that distinguishes a candidate from a rival: from the first with a known difference, otherwise from the first.
fn distinguish(candidate: &Candidate) -> Option<NextExperiment> {
    let one = card_id(&candidate.effect);
    let known = candidate.ambiguous_with.iter().find_map(|other| difference(one, card_id(other)).map(|found| (other, found)));
    let (rival, difference, run) = match known {
        Some((rival, (text, run))) => (rival, Some(text), run),
        None => (candidate.ambiguous_with.first()?, None, run_for(one)),
    };
    Some(NextExperiment { purpose: Purpose::Distinguish { effect: candidate.effect.clone(), rival: rival.clone(), difference }, run })
}

/// Identifier of the card: `cogging` of `cogging#2`.
pub fn card_id(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}
