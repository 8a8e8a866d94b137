//! docs/figures.md is what `campaign figures` prints from the committed results.
//!
//! With `STAND_DOCS=write` the test writes the page instead of comparing it.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use stand_tests::campaign::figures::{Sources, page};

/// Lines that a visitor reads.
const MAX_LINES: usize = 250;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn figures_page_equals_the_committed_results() {
    let path = root().join("docs/figures.md");
    let printed = page(&Sources::committed().unwrap()).unwrap();
    if std::env::var("STAND_DOCS").is_ok_and(|word| word == "write") {
        std::fs::write(path, printed).unwrap();
        return;
    }
    let written = std::fs::read_to_string(path).unwrap();
    for (n, (written, printed)) in written.lines().zip(printed.lines()).enumerate() {
        assert_eq!(written, printed, "line {}: `campaign figures > docs/figures.md`, or STAND_DOCS=write", n + 1);
    }
    assert_eq!(written.len(), printed.len(), "`campaign figures > docs/figures.md`, or STAND_DOCS=write");
    assert!(written.lines().count() <= MAX_LINES, "{} lines", written.lines().count());
}

/// The page has all committed results.
#[test]
fn figures_page_has_every_result() {
    let sources = Sources::committed().unwrap();
    let printed = page(&sources).unwrap();
    assert!(sources.logs.len() > 200 && sources.logs.len() == sources.answers.len());
    assert!(printed.contains(&format!("| **all** | {} |", sources.logs.len())), "a kind of log is left out");
    assert!(!sources.coverage.is_empty() && !sources.planted.is_empty());
    for log in sources.logs.iter().filter_map(|log| log.id.strip_prefix("foreign/")) {
        assert!(printed.contains(log), "{log}");
    }
    for card in drive_model::cards() {
        assert!(printed.contains(&format!("| `{}` |", card.id)), "{}", card.id);
    }
}

/// Programs that the page names exist.
#[test]
fn figures_page_names_existing_programs() {
    let page = std::fs::read_to_string(root().join("docs/figures.md")).unwrap();
    let commands: Vec<&str> = page
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next())
        .filter(|c| c.contains("cargo ") || c.starts_with("scripts/"))
        .collect();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        let word_after = |option: &str| command.split_whitespace().skip_while(|word| *word != option).nth(1);
        let package = word_after("-p").map(|package| if package == "stand-tests" { "tests" } else { package });
        let path = match (package, word_after("--bench"), word_after("--example"), word_after("--test")) {
            (Some(package), Some(bench), None, None) => format!("{package}/benches/{bench}.rs"),
            (Some(package), None, Some(example), None) => format!("{package}/examples/{example}.rs"),
            (Some(package), None, None, Some(test)) => format!("{package}/tests/{test}/main.rs"),
            _ => command.to_owned(),
        };
        assert!(root().join(&path).exists(), "{command}: no {path}");
    }
}
