//! What to measure next.
//!
//! In: what was found and what is still ambiguous. Out: one experiment as a command that runs: the one that separates rivals, else the one
//! that shows what was found better, else the one that the log lacked to be sure that nothing is missing.

use hal_sim::plant::Stand;

use super::coverage::Coverage;
use super::{Candidate, NextExperiment, Verdict};
use crate::log::Log;
use crate::model::Model;

/// A session as `stand sim` runs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// `rate` or `voltage`.
    pub mode: &'static str,
    /// The profile.
    pub profile: &'static str,
    /// Its amplitude, rad/s or V.
    pub amplitude: f64,
    /// Its length, s.
    pub seconds: f64,
}

impl Run {
    const fn rate(profile: &'static str, amplitude: f64, seconds: f64) -> Run {
        Run { mode: "rate", profile, amplitude, seconds }
    }

    const fn voltage(profile: &'static str, amplitude: f64, seconds: f64) -> Run {
        Run { mode: "voltage", profile, amplitude, seconds }
    }

    /// The command.
    pub fn command(&self) -> String {
        let Run { mode, profile, amplitude, seconds } = self;
        format!("stand sim --out next.parquet --mode {mode} --profile {profile} --amplitude {amplitude} --seconds {seconds}")
    }
}

/// Slow stairs through zero, both ways: whole turns at a few rad/s.
pub const SLOW: Run = Run::rate("staircase", 4.0, 60.0);
/// Stairs up to what the rate sensor can follow.
pub const FAST: Run = Run::rate("staircase", 30.0, 40.0);
/// Small steps of the voltage, at which the rotor sticks and breaks loose.
pub const STICKING: Run = Run::voltage("staircase", 0.4, 60.0);
/// Many frequencies at once, up to 20 Hz, without the loop.
pub const QUICK: Run = Run::voltage("multisine", 0.7, 30.0);
/// Sharp steps without the loop.
pub const SHARP: Run = Run::voltage("prbs", 0.7, 30.0);
/// The same angles and rates at small and at large currents.
pub const LOADED: Run = Run::rate("sweep", 15.0, 60.0);
/// Reversals without a pause: large currents that warm the winding.
pub const WARMING: Run = Run::rate("prbs", 15.0, 120.0);
/// All kinds of rates with rests between them.
pub const STEPS: Run = Run::rate("multi-step", 15.0, 60.0);

/// Every run that can be proposed.
pub const RUNS: [Run; 8] = [SLOW, FAST, STICKING, QUICK, SHARP, LOADED, WARMING, STEPS];

/// The run that shows an effect best, of those that the stand can make by itself.
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
        "compliance" | "sensor-lag" | "time-skew" => QUICK,
        "backlash" | "inductance" => SHARP,
        _ => STEPS,
    }
}

/// What separates two effects, in words, and the run; `None` where only their cards can say.
pub fn between(one: &str, other: &str) -> Option<(&'static str, Run)> {
    let pair = |a: &str, b: &str| (one == a && other == b) || (one == b && other == a);
    let either = |a: &str| one == a || other == a;
    let friction = ["viscous", "coulomb", "asymmetric-friction", "load", "stribeck", "quadratic-drag"];
    Some(if pair("brush-drop", "dead-time") {
        (
            "Both eat a constant part of the voltage; only the place differs. Measure the voltage at the motor's terminals, log it as u_V with the note `u_V: terminal`, and see whether the drop stays (the brushes) or goes (the bridge). The run passes slowly through the dead zone, where the drop is largest against the rest",
            STICKING,
        )
    } else if pair("load", "asymmetric-friction") {
        (
            "A load is the same torque at every rate; friction that differs by direction also grows with the rate. Hold low and high rates, both ways; if only the constant part shows even then, the two are the same torque, and a look at the stand decides",
            FAST,
        )
    } else if pair("unbalance", "rate-g-sensitivity") {
        (
            "A pull of gravity shows in the angle too, most at low rates; an error of the rate sensor shows in that channel alone, at every rate. Keep the encoder's angle in the log and turn slowly",
            SLOW,
        )
    } else if either("encoder-eccentricity") && (either("unbalance") || either("cogging") || either("rate-g-sensitivity")) {
        (
            "Compare slow and fast turns: what a torque does to the rate falls as the rate grows, what an eccentric encoder does grows with it",
            FAST,
        )
    } else if pair("sensor-lag", "time-skew") {
        ("A slow sensor rounds sharp corners and weakens what is fast; a late channel only shifts it. Run many frequencies at once", QUICK)
    } else if pair("coulomb", "brush-drop") || pair("coulomb", "dead-time") {
        (
            "Log the current beside the voltage (i_A): friction needs a torque and so a current, a lost voltage needs none. Run small voltages, at which the rotor sticks",
            STICKING,
        )
    } else if pair("cogging", "torque-ripple") {
        ("Cogging is there without current, ripple grows with it. Turn through the same angles at small and at large currents", LOADED)
    } else if pair("compliance", "backlash") {
        ("A soft shaft rings after every step, a play only where the torque reverses. Run sharp steps of both kinds", SHARP)
    } else if pair("quadratic-drag", "magnetic-saturation") {
        ("Drag goes with the rate, saturation with the current: accelerate hard at low rates, and hold high rates", LOADED)
    } else if pair("viscous-temperature", "resistance-temperature") || pair("resistance-temperature", "supply-droop") {
        (
            "Warm the winding by large currents and log its temperature and the supply: what goes with the heat stays when the current falls",
            WARMING,
        )
    } else if pair("load-step", "cable-spring") || pair("load-step", "viscous-temperature") || pair("load-step", "resistance-temperature") {
        ("Repeat the same profile: what set in once does not set in at the same second again", STEPS)
    } else if friction.contains(&one) && friction.contains(&other) {
        ("Parts of the friction differ in how they go with the rate and its sign: pass through zero slowly, several times, both ways", SLOW)
    } else {
        return None;
    })
}

/// What to measure next; `None` where nothing is open.
pub fn next(_model: &Model, candidates: &[Candidate], missing: &[String], verdict: Verdict, log: &Log) -> Option<NextExperiment> {
    let (says, run) = wanted(candidates, missing, verdict, log)?;
    let here = log.note("stand").is_some_and(|s| s == Stand::default().name);
    let where_run = if here {
        "If an effect was hidden or a stand file used, give the command the same --hidden or --stand."
    } else {
        "On your stand, record this profile with the voltage and rates that suit it; the command runs it on the simulated one."
    };
    Some(NextExperiment { says: format!("{}. {where_run}", says.trim_end_matches('.')), command: run.command() })
}

fn wanted(candidates: &[Candidate], missing: &[String], verdict: Verdict, log: &Log) -> Option<(String, Run)> {
    let coverage = Coverage::of(log);
    let open = candidates.iter().find(|c| missing.contains(&c.effect) && !c.ambiguous_with.is_empty());
    if let Some(open) = open {
        let one = stem(&open.effect);
        let separates = open.ambiguous_with.iter().find_map(|other| between(one, stem(other)).map(|found| (other, found)));
        let (other, says, run) = match separates {
            Some((other, (says, run))) => (other, says.to_owned(), run),
            None => {
                let other = open.ambiguous_with.first()?;
                let best = |id: &str| drive_model::card(id).map_or(String::new(), |c| lower(c.description.experiment));
                let says = format!("{one} shows best by this: {} And {}: {}", best(one), stem(other), best(stem(other)));
                (other, says, run_for(one))
            }
        };
        return Some((format!("This log cannot tell {} from {other}. {says}", open.effect), run));
    }
    if !coverage.both_ways() {
        return Some((
            "The log turns one way only, so that friction, a load and what depends on the direction are one; pass through zero, both ways"
                .to_owned(),
            SLOW,
        ));
    }
    match verdict {
        Verdict::EffectFound => {
            let first = stem(missing.first()?);
            let card = drive_model::card(first)?;
            Some((format!("To see {first} better, and its numbers to more digits: {}", lower(card.description.experiment)), run_for(first)))
        }
        Verdict::UnknownStructure => Some((
            "Repeat it with other rates: what belongs to the stand comes again over the same angle, rate or current; what happened once does not".to_owned(),
            STEPS,
        )),
        Verdict::Adequate if !coverage.slow_turns() => {
            Some(("The log hardly has slow whole turns, where what depends on the angle shows most; turn slowly to be sure".to_owned(), SLOW))
        }
        Verdict::Adequate => None,
    }
}

/// The effect of `cogging#2`.
fn stem(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

/// A sentence within another.
fn lower(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_lowercase().to_string()).unwrap_or_default();
    first + letters.as_str()
}
