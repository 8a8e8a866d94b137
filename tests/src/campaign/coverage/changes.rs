//! Two runs of the coverage campaign.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

use super::rows::{Chance, CoverageRecord};

/// What two runs differ in.
#[derive(Debug, Default)]
pub struct Changes {
    /// Lines whose counts or errors changed.
    pub changed: Vec<String>,
    /// Those of them that chance allowed before and does not allow now.
    pub worse: Vec<String>,
    /// Conditions whose simulated inputs, or number of measurements, are others; they are not compared.
    pub other_inputs: Vec<String>,
    /// Quantities that one run reports alone.
    pub only_in_one: Vec<String>,
    /// The whole as text.
    pub text: String,
}

impl Changes {
    /// Nothing has changed, and all conditions were compared.
    pub fn is_empty(&self) -> bool {
        [&self.changed, &self.other_inputs, &self.only_in_one].into_iter().all(Vec::is_empty)
    }
}

/// Compares the lines `after` with those `before`. Conditions that `after` does not have are left out.
pub fn changes(before: &[CoverageRecord], after: &[CoverageRecord]) -> Changes {
    let old: BTreeMap<_, _> = before.iter().map(|row| (row.key(), row)).collect();
    let new: BTreeMap<_, _> = after.iter().map(|row| (row.key(), row)).collect();
    let condition = |row: &CoverageRecord| (row.analysis.clone(), row.condition.clone());
    let is_run: BTreeSet<_> = after.iter().map(condition).collect();
    let inputs = |rows: &[CoverageRecord]| -> BTreeMap<_, _> { rows.iter().map(|row| (condition(row), row.inputs.clone())).collect() };
    let (inputs_before, inputs_after) = (inputs(before), inputs(after));
    let is_other = |key: &(String, String)| inputs_before.get(key).is_some_and(|old| inputs_after.get(key) != Some(old));
    let other_inputs = is_run.iter().filter(|key| is_other(key)).map(|(analysis, condition)| format!("{analysis}/{condition}")).collect();
    let mut c = Changes { other_inputs, ..Changes::default() };
    for (key, row) in &new {
        let name = format!("{}/{} {}", key.0, key.1, key.2);
        match old.get(key) {
            _ if is_other(&condition(row)) => {}
            None => c.only_in_one.push(format!("{name}: new")),
            Some(was) if was == row => {}
            Some(was) => {
                let line = format!("{name}: {} → {}", short(was), short(row));
                if was.chance() == Chance::Within && row.chance() != Chance::Within {
                    c.worse.push(line.clone());
                }
                c.changed.push(line);
            }
        }
    }
    let gone = old.iter().filter(|(key, row)| !new.contains_key(*key) && is_run.contains(&condition(row)) && !is_other(&condition(row)));
    c.only_in_one.extend(gone.map(|(key, _)| format!("{}/{} {}: not reported any more", key.0, key.1, key.2)));
    let compared = is_run.iter().filter(|key| inputs_before.contains_key(*key) && !is_other(key)).count();
    let _ = writeln!(c.text, "{compared} conditions compared");
    for (title, lines) in [
        ("outside the range of chance now, within it before", &c.worse),
        ("changed", &c.changed),
        ("other inputs, or another number of measurements: not compared", &c.other_inputs),
        ("in one run alone", &c.only_in_one),
    ] {
        let _ = writeln!(c.text, "\n{title}: {}", lines.len());
        lines.iter().for_each(|line| {
            let _ = writeln!(c.text, "  {line}");
        });
    }
    c
}

fn short(row: &CoverageRecord) -> String {
    let error = row.mean_error_sigma.map_or(String::new(), |mean| format!(", mean {mean:+.2} u"));
    let refused = if row.refused == 0 { String::new() } else { format!(", {} refused", row.refused) };
    format!("{} of {} cover ({}{error}{refused})", row.covered, row.intervals, row.chance().words())
}

#[cfg(test)]
mod tests {
    use super::super::Interval;
    use super::*;

    fn row(quantity: &str, covered: usize, inputs: &str) -> CoverageRecord {
        let interval = |k| Interval { quantity: quantity.to_owned(), error_sigma: Some(1.0), covers: k < covered };
        let intervals: Vec<Interval> = (0..40).map(interval).collect();
        CoverageRecord::counted(("drift", "steady", quantity), 40, 0, &intervals, inputs)
    }

    #[test]
    fn equal_runs_have_no_changes() {
        let rows = [row("own_drift", 38, "1")];
        assert!(changes(&rows, &rows).is_empty());
    }

    #[test]
    fn a_line_that_leaves_the_range_of_chance_is_worse() {
        let c = changes(&[row("own_drift", 38, "1"), row("azimuth", 38, "1")], &[row("own_drift", 30, "1"), row("azimuth", 39, "1")]);
        assert_eq!((c.changed.len(), c.worse.len()), (2, 1), "{c:?}");
        assert!(c.worse[0].contains("own_drift") && c.text.contains("30 of 40"), "{}", c.text);
    }

    #[test]
    fn other_inputs_are_reported_and_not_compared() {
        let c = changes(&[row("own_drift", 38, "1")], &[row("own_drift", 20, "2")]);
        assert_eq!(c.other_inputs, ["drift/steady"]);
        assert!(c.changed.is_empty() && !c.is_empty(), "{c:?}");
    }

    #[test]
    fn a_quantity_that_is_not_reported_any_more_is_found() {
        let c = changes(&[row("own_drift", 38, "1"), row("azimuth", 38, "1")], &[row("own_drift", 38, "1")]);
        assert_eq!(c.only_in_one.len(), 1, "{c:?}");
        assert!(!c.is_empty());
    }
}
