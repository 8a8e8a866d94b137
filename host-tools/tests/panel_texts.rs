//! The words of the page: one table of keys, each in both languages; every key of the page is in it and every key in it is used.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;
use std::path::Path;

fn read(name: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("panel").join(name)).unwrap()
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
    // `getContext("` is no `text("`.
    let is_word = |at: usize| at > 0 && source.as_bytes()[at - 1].is_ascii_alphabetic();
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
        assert!(!english.is_empty() && !ukrainian.is_empty() && english.chars().all(|c| c.is_ascii() || "Δ±".contains(c)), "{key}");
        let is_symbol = key == "evidence";
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
        "plot-group.js",
        "import.js",
        "compensate.js",
        "measure.js",
        "fields.js",
        "plot.js",
        "connection.js",
    ]
    .map(read)
    .concat();
    let mut asked: BTreeSet<String> = quoted(&read("index.html"), "data-text=\"").into_iter().collect();
    for before in ["text(\"", "field(\"", "button(\"", "entry(\"", "typed(\"setpoint\", \"", "fill(\"log-choice\", session.logs, log, \""] {
        asked.extend(quoted(&modules, before));
    }
    let missing: Vec<&String> = asked.iter().filter(|key| !keys.contains(*key)).collect();
    assert!(missing.is_empty(), "not in text.js: {missing:?}");
    let unused: Vec<&String> = keys.iter().filter(|key| !asked.contains(*key) && !modules.contains(&format!("\"{key}\""))).collect();
    assert!(unused.is_empty(), "not used: {unused:?}");
}
