//! The next experiment. Priority: an experiment that distinguishes rivals, then one that determines the effect better, then one that covers a
//! range of operation without which the verdict is uncertain.

use drive_model::{Card, Rival, StandRun};

use super::answer::{Candidate, Verdict};
use super::coverage::Coverage;
use super::experiment::{NextExperiment, Purpose};

/// The next experiment; `None` where nothing is open.
pub fn next_experiment(candidates: &[Candidate], missing: &[String], verdict: Verdict, coverage: &Coverage) -> Option<NextExperiment> {
    let ambiguous = candidates.iter().find(|c| missing.contains(&c.effect) && !c.ambiguous_with.is_empty());
    if let Some(candidate) = ambiguous {
        return distinguish(candidate);
    }
    if !coverage.both_ways {
        return Some(NextExperiment { purpose: Purpose::BothDirections, run: StandRun::LOW_RATES });
    }
    match verdict {
        Verdict::EffectFound => {
            let card = card(missing.first()?)?;
            Some(NextExperiment { purpose: Purpose::Determine { effect: card.id }, run: card.next_run })
        }
        Verdict::UnknownStructure => Some(NextExperiment { purpose: Purpose::Repeat, run: StandRun::STEPS }),
        Verdict::Adequate if !coverage.slow_turns => Some(NextExperiment { purpose: Purpose::SlowTurns, run: StandRun::LOW_RATES }),
        Verdict::Adequate => None,
    }
}

/// The experiment that distinguishes a candidate from a rival: from the first that a card knows how to separate, otherwise from the first.
fn distinguish(candidate: &Candidate) -> Option<NextExperiment> {
    let one = card(&candidate.effect)?;
    let known = candidate.ambiguous_with.iter().find_map(|other| Some((other, Rival::between(one, card(other)?)?)));
    let (rival, difference, run) = match known {
        Some((rival, found)) => (rival, Some(found.separation), found.run),
        None => (candidate.ambiguous_with.first()?, None, one.next_run),
    };
    Some(NextExperiment { purpose: Purpose::Distinguish { effect: candidate.effect.clone(), rival: rival.clone(), difference }, run })
}

/// The card of an effect's name in the model, e.g. `cogging#2`.
fn card(name: &str) -> Option<&'static Card> {
    drive_model::card(name.split('#').next().unwrap_or(name))
}
