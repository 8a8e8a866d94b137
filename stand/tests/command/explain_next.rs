//! The experiments proposed by `stand explain` can be run and distinguish their effects.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{MODEL, stand};
use drive_model::{Rival, StandRun, cards};
use identification::log::Log;
use serde_json::Value;
use stand_report::explanation::sentences::command;

#[test]
fn proposed_runs_end_without_fault_within_sensor_range() {
    let folder = tempfile::tempdir().unwrap();
    for run in StandRun::ALL {
        let command = command(&run);
        let mut words: Vec<&str> = command.split_whitespace().collect();
        assert_eq!(words.remove(0), "stand");
        let seconds = words.iter().position(|w| *w == "--seconds").unwrap() + 1;
        // Long enough for the staircase to reach its top and return through zero.
        words[seconds] = "12";
        words.push("--force");
        stand(folder.path(), &words).succeeded();
        let log = Log::read(folder.path().join("next.parquet")).unwrap();
        assert_eq!((log.len(), log.note("fault")), (12_000, None), "{command}");
        let largest = log.column("omega_rad_s").unwrap().iter().fold(0.0_f64, |m, w| m.max(w.abs()));
        // The default rate sensor's range is 2000 °/s.
        assert!(largest > 0.5 && largest < 2000_f64.to_radians(), "{command}: {largest} rad/s");
    }
}

#[test]
fn effects_have_runs_and_families_are_separable() {
    for card in cards() {
        assert!(StandRun::ALL.contains(&card.next_run), "{}", card.id);
        for other in cards().iter().filter(|o| o.id != card.id && !card.family.is_empty() && o.family == card.family) {
            let rival = Rival::between(card, other).unwrap_or_else(|| panic!("{} and {}", card.id, other.id));
            assert!(StandRun::ALL.contains(&rival.run) && rival.separation.len() > 40, "{}", rival.separation);
            let reverse = Rival::between(other, card).map(|r| r.separation);
            assert_eq!(reverse, Some(rival.separation), "the order of the two does not matter");
        }
    }
}

/// A stand with direction-dependent friction, partly proportional to the rate.
const STAND: &str = "name = \"rotary stand on a maxon RE 25\"\n[effects.coulomb]\ncoulomb_N_m = 9e-4\n[effects.viscous]\nviscous_N_m_s = 2e-5\n\
    [effects.inductance]\ninductance_H = 2.38e-4\n[effects.asymmetric-friction]\nasymmetry_N_m = 3e-4\nasymmetry_N_m_s = 5e-7\n";

#[test]
fn proposed_run_distinguishes_what_the_first_log_did_not() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    std::fs::write(path.join("stand.toml"), STAND).unwrap();
    let explained = |log: &str| stand(path, &["explain", log, "--model", "model.toml", "--json", "-"]).succeeded().json();
    let rivals = |answer: &Value| {
        let candidates = answer["candidates"].as_array().unwrap();
        let named = candidates.iter().find(|c| c["effect"] == "asymmetric-friction").unwrap();
        named["ambiguous_with"].as_array().unwrap().iter().map(|r| r.as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };

    // At 3 rad/s the part proportional to the rate is 1.5e-6 N m, 1/200 of the constant part.
    stand(path, &["sim", "--out", "slow.csv", "--seconds", "6", "--amplitude", "3", "--stand", "stand.toml"]).succeeded();
    let before = explained("slow.csv");
    assert_eq!(before["missing"], serde_json::json!(["asymmetric-friction"]), "the first of the family in the catalogue's order");
    assert_eq!(rivals(&before), ["load"]);
    let named = "Missing effect: asymmetric-friction or load (not distinguishable here).";
    assert!(before["says"].as_str().unwrap().starts_with(named), "{}", before["says"]);
    assert_eq!(before["not_distinguishable"], serde_json::json!({"asymmetric-friction": ["load"]}));
    let text = stand(path, &["explain", "slow.csv", "--model", "model.toml", "--html", "slow.html"]).succeeded().out;
    let page = std::fs::read_to_string(path.join("slow.html")).unwrap();
    assert!(text.replace('\n', " ").contains(named) && page.contains(named), "{text}");

    let command = before["next_experiment"]["command"].as_str().unwrap().to_owned();
    // The slow log determines only the constant part of the asymmetry, which is a load: no run separates these two, and the run is that of
    // the card.
    let expected = before["next_experiment"]["expected"].as_array().unwrap();
    let evidence: Vec<f64> = expected.iter().map(|e| e["delta_bic"].as_f64().unwrap()).collect();
    assert!(expected.len() == StandRun::ALL.len() && evidence[0] < 6.0 && evidence.is_sorted_by(|a, b| a >= b), "{evidence:?}");
    assert!(before["next_experiment"]["says"].as_str().unwrap().contains("With what this log shows of them"), "{before}");
    let mut words: Vec<&str> = command.split_whitespace().skip(1).chain(["--stand", "stand.toml"]).collect();
    // A quarter of the proposed duration is enough: the staircase has risen and fallen once.
    let seconds = words.iter().position(|w| *w == "--seconds").unwrap() + 1;
    words[seconds] = "14";
    stand(path, &words).succeeded();
    let after = explained("next.parquet");
    assert_eq!(after["missing"], before["missing"]);
    assert!(rivals(&after).is_empty(), "{:?}", rivals(&after));
    assert_eq!(after["not_distinguishable"], serde_json::json!({}));
}
