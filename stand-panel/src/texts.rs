//! The words of the page: one table of keys, each in both languages; every key of the page is in it and every key in it is used. What the
//! program gives as a kind with numbers has a key for each kind, whose arguments are those that the program gives.
#![allow(clippy::unwrap_used)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use stand_report::kinds::{self, Kinds};

use super::stage::{Request, Stage, StopReason};

fn read(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("page").join(name)).unwrap()
}

/// The keys of the table with their texts.
fn table() -> Vec<(String, [String; 2])> {
    let text = read("text.js");
    let (_, table) = text.split_once("export const TEXT = {\n").unwrap();
    let (table, _) = table.split_once("\n};").unwrap();
    let entry = |line: &str| {
        let (key, texts) = line.trim().trim_end_matches(',').split_once(": ").unwrap();
        (key.to_owned(), serde_json::from_str(texts).unwrap_or_else(|e| panic!("{line}: {e}")))
    };
    table.lines().map(entry).collect()
}

/// The words behind `before` up to the next quotation mark.
fn quoted(source: &str, before: &str) -> Vec<String> {
    // `getContext("` is no `text("`, and `.fill(" "` is not of the table.
    let is_word = |at: usize| at > 0 && (source.as_bytes()[at - 1].is_ascii_alphabetic() || source.as_bytes()[at - 1] == b'.');
    source
        .match_indices(before)
        .filter(|(at, _)| !is_word(*at))
        .map(|(at, _)| source[at + before.len()..].split('"').next().unwrap().to_owned())
        .collect()
}

#[test]
fn every_key_has_both_languages_and_the_ukrainian_text_is_cyrillic() {
    let table = table();
    assert!(table.len() > 60);
    for (key, [english, ukrainian]) in table {
        assert!(!english.is_empty() && !ukrainian.is_empty() && english.chars().all(|c| c.is_ascii() || "Δ±°²√".contains(c)), "{key}");
        let is_symbol = ["evidence", "evidence_of"].contains(&key.as_str());
        assert!(
            is_symbol || ukrainian.to_lowercase().chars().any(|c| ('а'..='я').contains(&c) || "іїєґ".contains(c)),
            "{key}: {ukrainian}"
        );
    }
}

#[test]
fn page_uses_the_keys_of_the_table_and_no_others() {
    let keys: BTreeSet<String> = table().into_iter().map(|(key, _)| key).collect();
    let modules: String = [
        "main.js",
        "live.js",
        "drive.js",
        "identify.js",
        "residuals.js",
        "explanation.js",
        "signature.js",
        "plot-group.js",
        "import.js",
        "compensate.js",
        "measure.js",
        "laboratory.js",
        "fields.js",
        "plot.js",
        "connection.js",
    ]
    .map(read)
    .concat();
    let mut asked: BTreeSet<String> = quoted(&read("index.html"), "data-text=\"").into_iter().collect();
    for before in
        ["text(\"", "fill(\"", "field(\"", "button(\"", "entry(\"", "typed(\"setpoint\", \"", "offer(\"log-choice\", session.logs, log, \""]
    {
        asked.extend(quoted(&modules, before));
    }
    let missing: Vec<&String> = asked.iter().filter(|key| !keys.contains(*key)).collect();
    assert!(missing.is_empty(), "not in text.js: {missing:?}");
    let by_kind: BTreeSet<String> = keys_of_kinds().into_keys().collect();
    let is_used = |key: &String| asked.contains(key) || by_kind.contains(key) || modules.contains(&format!("\"{key}\""));
    let unused: Vec<&String> = keys.iter().filter(|key| !is_used(key)).collect();
    assert!(unused.is_empty(), "not used: {unused:?}");
}

/// The keys that the program's kinds need, with the arguments that the program gives. Kinds whose sentence the program itself has are left
/// out.
fn keys_of_kinds() -> Kinds {
    let of_panel = [("stage", kinds::of::<Stage>()), ("ask", kinds::of::<Request>()), ("stopped", kinds::of::<StopReason>())];
    let mut all = Kinds::new();
    for (family, kinds) in kinds::families().into_iter().chain(of_panel) {
        assert!(!kinds.is_empty(), "{family}");
        all.extend(kinds.into_iter().map(|(kind, fields)| (format!("{family}_{kind}"), fields)));
    }
    // A misfit that differs from log to log has a sentence of its own; warnings about a log are sentences of the program.
    ["with_log", "allan_note_log", "drift_log"].iter().for_each(|key| assert!(all.remove(*key).is_some(), "{key}"));
    all
}

/// The arguments of a text: `{name}`.
fn arguments(text: &str) -> BTreeSet<String> {
    text.split('{').skip(1).map(|part| part.split('}').next().unwrap().to_owned()).collect()
}

#[test]
fn each_kind_of_the_program_has_a_key_with_the_arguments_that_the_program_gives() {
    let table: BTreeMap<String, [String; 2]> = table().into_iter().collect();
    // The page adds these: the limit with its unit, the name of the coordinate in the language.
    let of_page = ["below", "unit", "coordinate"].map(str::to_owned);
    let kinds = keys_of_kinds();
    assert!(kinds.len() > 150 && kinds["form_torque_step"].contains("t_s") && kinds["stage_visit"].contains("visits"), "{kinds:?}");
    for (key, fields) in kinds {
        let texts = table.get(&key).unwrap_or_else(|| panic!("{key}: not in text.js"));
        for text in texts {
            let unknown: Vec<String> =
                arguments(text).into_iter().filter(|name| !fields.contains(name) && !of_page.contains(name)).collect();
            assert!(unknown.is_empty(), "{key}: {unknown:?} is not one of {fields:?}");
        }
    }
}

#[test]
fn both_languages_have_the_same_arguments() {
    for (key, [english, ukrainian]) in table() {
        assert_eq!(arguments(&english), arguments(&ukrainian), "{key}");
    }
}
