//! The page docs/figures.md, printed from the committed results and from nothing else.
//!
//! * [`explain`]: kinds of logs, effects, logs of another simulator, what is not reached;
//! * [`coverage`]: intervals of `fit`, `calibrate`, `drift` and `allan`;
//! * [`other`]: planted effects, limits of the firmware, commands that measure the rest.

pub mod coverage;
pub mod explain;
pub mod other;

use std::fs;
use std::path::Path;

use super::coverage::rows::CoverageRecord;
use super::planted::PlantedRecord;
use super::record::{AnswerRecord, COVERAGE, LogRecord, PLANTED, baselines, read};
use super::sets::Set;

/// What the page is printed from.
pub struct Sources {
    /// What the generator made for the daily set.
    pub logs: Vec<LogRecord>,
    /// The answers of `explain` to it.
    pub answers: Vec<AnswerRecord>,
    /// Coverage of the other analyses.
    pub coverage: Vec<CoverageRecord>,
    /// Planted effects.
    pub planted: Vec<PlantedRecord>,
    /// Limits of the firmware: the file firmware/budget.toml.
    pub budget: toml::Table,
}

impl Sources {
    /// The committed files.
    ///
    /// # Errors
    /// The file that cannot be read.
    pub fn committed() -> Result<Sources, String> {
        let (folder, set) = (baselines(), Set::Daily.name());
        let budget = Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/budget.toml");
        let text = fs::read_to_string(&budget).map_err(|e| format!("{}: {e}", budget.display()))?;
        Ok(Sources {
            logs: read(&folder.join(format!("explain-{set}-logs.csv")))?,
            answers: read(&folder.join(format!("explain-{set}.csv")))?,
            coverage: read(&folder.join(COVERAGE))?,
            planted: read(&folder.join(PLANTED))?,
            budget: text.parse().map_err(|e| format!("{}: {e}", budget.display()))?,
        })
    }
}

const HEAD: &str = "\
# Measured figures

Results of the analyses on simulated measurements whose truth is known. This page is printed from the files in `tests/baselines` and a test compares it with them:

```
cargo run -p stand-tests --bin campaign -- figures > docs/figures.md     # or: just docs
```

| results | file | measured by |
|---|---|---|
| named effects | `explain-daily.csv` | `campaign explain` |
| coverage of uncertainties | `coverage.csv` | `campaign coverage` |
| effects at the detection limit | `planted.csv` | `campaign planted` |

`campaign` stands for `cargo run -p stand-tests --bin campaign --`. `campaign diff` compares a new run with the accepted results, `campaign accept` replaces them. `campaign write NAME FOLDER` writes a log with the user's model for `stand explain`. Each log is determined by its name; its SHA-256 is stored, so that a change
of the simulator is reported and not taken for a change of the analysis.
";

/// The page.
///
/// # Errors
/// A limit of the firmware has no description.
pub fn page(sources: &Sources) -> Result<String, String> {
    Ok(format!(
        "{HEAD}\n{}\n{}\n{}",
        explain::section(&sources.logs, &sources.answers),
        coverage::section(&sources.coverage),
        other::sections(sources)?
    ))
}

/// A table in Markdown.
fn table(header: &[&str], rows: &[Vec<String>]) -> String {
    let mut text = format!("| {} |\n|{}\n", header.join(" | "), "---|".repeat(header.len()));
    rows.iter().for_each(|row| text += &format!("| {} |\n", row.join(" | ")));
    text
}

/// Median, 90 % and maximum by nearest rank (of n sorted values the ⌈p n⌉th); blank without values.
fn spread(mut values: Vec<u64>) -> [String; 3] {
    values.sort_unstable();
    let rank = |p: f64| (p * values.len() as f64).ceil() as usize;
    [0.5, 0.9, 1.0].map(|p| values.get(rank(p).saturating_sub(1)).map_or(String::new(), |value| grouped(*value)))
}

/// Digits in groups of three.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|group| std::str::from_utf8(group).ok()).collect();
    groups.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_by_nearest_rank() {
        assert_eq!(spread((1..=10).collect()), ["5", "9", "10"]);
        assert_eq!(spread(vec![1_234_567]), ["1 234 567", "1 234 567", "1 234 567"]);
        assert_eq!(spread(Vec::new()), ["", "", ""]);
    }
}
