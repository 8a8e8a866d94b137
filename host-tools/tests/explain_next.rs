//! What `stand explain` proposes to measure next can be measured, and tells apart what it says.
#![allow(clippy::unwrap_used)]

mod common;

use common::stand;
use hal_sim::effects::CATALOGUE;
use host_tools::explain::next::{RUNS, between, run_for};
use host_tools::log::Log;

#[test]
fn every_proposed_run_runs_without_a_fault_and_moves_within_what_the_sensors_see() {
    let folder = tempfile::tempdir().unwrap();
    for run in RUNS {
        let command = run.command();
        let mut words: Vec<&str> = command.split_whitespace().collect();
        assert_eq!(words.remove(0), "stand");
        let seconds = words.iter().position(|w| *w == "--seconds").unwrap() + 1;
        // Long enough for the stairs to reach their top and come back through zero.
        words[seconds] = "12";
        stand(folder.path(), &words).well();
        let log = Log::read(folder.path().join("next.parquet")).unwrap();
        assert_eq!((log.len(), log.note("fault")), (12_000, None), "{command}");
        let largest = log.column("omega_rad_s").unwrap().iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        // The default rate sensor ends at 2000 °/s.
        assert!(largest > 0.5 && largest < 2000_f64.to_radians(), "{command}: {largest} rad/s");
    }
}

#[test]
fn every_effect_has_a_run_and_every_family_of_the_catalogue_a_word_on_how_to_separate_it() {
    for card in CATALOGUE {
        assert!(RUNS.contains(&run_for(card.id)), "{}", card.id);
        for other in CATALOGUE.iter().filter(|o| o.id != card.id && !card.family.is_empty() && o.family == card.family) {
            let (says, run) = between(card.id, other.id).unwrap_or_else(|| panic!("{} and {}", card.id, other.id));
            assert!(RUNS.contains(&run) && says.len() > 40, "{says}");
            assert_eq!(between(other.id, card.id), Some((says, run)), "whichever is named first");
        }
    }
}
