//! The next experiment. What separates two effects is computed ([`design`]) where the drive can be simulated; otherwise the cards of the
//! effects state it. Priority: an experiment that distinguishes rivals; motion in both directions; one that determines the effect better, or
//! the same again where a structure has no name; slow turns where nothing is missing. Where the cards state the run, it is not one that the
//! log is already.

pub mod design;
pub mod detection;

use drive_model::{Card, Rival, StandRun};

use crate::identify::explain::answer::coverage::Coverage;
use crate::identify::explain::answer::experiment::{NextExperiment, Purpose, Repeated, Separation};
use crate::identify::explain::answer::{Candidate, Verdict};
use crate::identify::explain::context::Context;
use crate::identify::explain::verdict::outcome::Outcome;
use crate::log::Log;
use crate::statistics::Extremes;

/// The next experiment after a search on logs of this `coverage`; `None` where nothing is open, or
/// the search was not finished.
pub fn experiment_after(outcome: &Outcome, coverage: &Coverage) -> Option<NextExperiment> {
    let (search, verdict) = (&outcome.search, outcome.verdict);
    let (candidates, missing) = (&search.candidates, search.names(0));
    let Context { log, criteria, .. } = search.models.given().context;
    if verdict == Verdict::NotFinished {
        return None;
    }
    let ambiguous = candidates.iter().find(|c| missing.contains(&c.effect) && !c.ambiguous_with.is_empty());
    if let Some(candidate) = ambiguous {
        let next = distinguish(candidate, log)?;
        let separations = search.doubt.as_ref().map_or_else(Vec::new, |doubt| design::separations(search.models.given(), doubt));
        return Some(by_expectation(next, &separations, criteria.evidence.min_bic_difference));
    }
    if !coverage.both_ways {
        return Some(NextExperiment { purpose: Purpose::BothDirections, run: StandRun::LOW_RATES, expected: Vec::new() });
    }
    match verdict {
        Verdict::EffectFound | Verdict::PartlyExplained => {
            let card = card(missing.first()?)?;
            Some(NextExperiment { purpose: Purpose::Determine { effect: card.id }, run: card.next_run, expected: Vec::new() })
        }
        Verdict::UnknownStructure => Some(NextExperiment { purpose: Purpose::Repeat, run: StandRun::STEPS, expected: Vec::new() }),
        Verdict::Adequate if !coverage.slow_turns => {
            Some(NextExperiment { purpose: Purpose::SlowTurns, run: StandRun::LOW_RATES, expected: Vec::new() })
        }
        Verdict::Adequate | Verdict::NotFinished => None,
    }
}

/// The experiment with the first of the `separations`, which has the highest expected ΔBIC. Where none is expected to reach `min_bic_difference`, what the card says
/// stays: it may change the stand, which no simulated run does.
fn by_expectation(next: NextExperiment, separations: &[Separation], min_bic_difference: f64) -> NextExperiment {
    let expected = separations.to_vec();
    match (separations.first(), next.purpose) {
        (Some(best), Purpose::Distinguish { effect, rival, difference, .. }) if best.expected_delta_bic >= min_bic_difference => {
            NextExperiment { purpose: Purpose::Distinguish { effect, rival, difference, repeated: None }, run: best.run, expected }
        }
        (_, purpose) => NextExperiment { purpose, run: next.run, expected },
    }
}

/// The experiment that distinguishes a candidate from a rival, by their cards: from the first that a card knows how to separate, otherwise
/// from the first.
fn distinguish(candidate: &Candidate, log: &Log) -> Option<NextExperiment> {
    let one = card(&candidate.effect)?;
    let known = candidate.ambiguous_with.iter().find_map(|other| Some((other, Rival::between(one, card(other)?)?)));
    let (rival, found) =
        known.map_or_else(|| Some((candidate.ambiguous_with.first()?, None)), |(rival, found)| Some((rival, Some(found))))?;
    let best = found.map_or(one.next_run, |found| found.run);
    let change_of_stand = found.and_then(|found| found.change_of_stand);
    let other_run = || [one.next_run].into_iter().chain(card(rival).map(|c| c.next_run)).chain(OTHER_RUNS).find(|run| !is_run(log, run));
    let (run, repeated) = match (is_run(log, &best), change_of_stand) {
        (false, _) => (best, None),
        (true, Some(change)) => (best, Some(Repeated::ChangeOfStand(change))),
        (true, None) => (other_run().unwrap_or(best), Some(Repeated::OtherRun)),
    };
    let difference = found.map(|found| found.separation);
    let purpose = Purpose::Distinguish { effect: candidate.effect.clone(), rival: rival.clone(), difference, repeated };
    Some(NextExperiment { purpose, run, expected: Vec::new() })
}

/// Runs of different excitation, for rivals whose own runs the log contains already.
const OTHER_RUNS: [StandRun; 4] = [StandRun::LOW_RATES, StandRun::HIGH_RATES, StandRun::MULTISINE, StandRun::VARYING_CURRENT];
/// Fraction of a run's amplitude and duration from which a log of the same profile counts as the run.
const MIN_RUN_FRACTION: f64 = 0.5;

/// The log is already such a run, by its notes, its largest rate or voltage, and its duration.
fn is_run(log: &Log, run: &StandRun) -> bool {
    let column = if run.mode == "rate" { "omega_rad_s" } else { "u_V" };
    let largest = log.column(column).map_or(0.0, |values| values.iter().copied().max_abs());
    let noted = log.note("profile") == Some(run.profile) && log.note("mode") == Some(run.mode);
    noted && largest >= MIN_RUN_FRACTION * run.amplitude && log.duration_s() >= MIN_RUN_FRACTION * run.duration_s
}

/// The card of an effect's name in the model, e.g. `cogging#2`.
fn card(name: &str) -> Option<&'static Card> {
    drive_model::card(name.split('#').next().unwrap_or(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Column;

    fn log(profile: &str, amplitude: f64, seconds: usize) -> Log {
        let t_s: Vec<f64> = (0..seconds * 10).map(|k| k as f64 * 0.1).collect();
        let omega_rad_s = t_s.iter().map(|t| amplitude * t.sin()).collect();
        let columns = vec![Column { name: "t_s".into(), values: t_s }, Column { name: "omega_rad_s".into(), values: omega_rad_s }];
        Log::new("run.csv", columns, vec![("profile".to_owned(), profile.to_owned()), ("mode".to_owned(), "rate".to_owned())]).unwrap()
    }

    fn ambiguous(effect: &str, rival: &str) -> Candidate {
        Candidate {
            effect: effect.to_owned(),
            parameters: Vec::new(),
            refitted: true,
            outputs: Vec::new(),
            delta_bic: Some(-100.0),
            p_value: 0.0,
            log10_p: -20.0,
            ambiguous_with: vec![rival.to_owned()],
            refused: None,
            not_visible: None,
        }
    }

    #[test]
    fn proposed_run_is_not_the_one_that_did_not_distinguish() {
        let next = |effect, rival, log: &Log| distinguish(&ambiguous(effect, rival), log).unwrap();
        let repeated = |next: &NextExperiment| match &next.purpose {
            Purpose::Distinguish { repeated, .. } => *repeated,
            other => panic!("{other:?}"),
        };
        let first = next("cogging", "torque-ripple", &log("multi-step", 15.0, 60));
        assert_eq!((first.run, repeated(&first)), (StandRun::VARYING_CURRENT, None));
        let second = next("cogging", "torque-ripple", &log("sweep", 15.0, 60));
        assert_ne!(second.run, StandRun::VARYING_CURRENT);
        assert_eq!(repeated(&second), Some(Repeated::OtherRun));
        // A short or slow log of the profile is not the run.
        assert_eq!(next("cogging", "torque-ripple", &log("sweep", 15.0, 6)).run, StandRun::VARYING_CURRENT);
        assert_eq!(next("cogging", "torque-ripple", &log("sweep", 3.0, 60)).run, StandRun::VARYING_CURRENT);
    }

    #[test]
    fn equal_torques_need_a_change_of_the_stand() {
        let next = distinguish(&ambiguous("asymmetric-friction", "load"), &log("staircase", 30.0, 40)).unwrap();
        assert!(matches!(next.purpose, Purpose::Distinguish { repeated: Some(Repeated::ChangeOfStand(_)), .. }), "{next:?}");
    }
}
