//! Coverage of the intervals of `fit`, `calibrate`, `drift` and `allan`.

use super::super::coverage::rows::{Chance, CoverageRecord};
use super::table;

/// What a condition is, in words.
const CONDITIONS: [(&str, &str, &str); 27] = [
    ("fit", "voltage-clean", "voltage mode"),
    ("fit", "voltage-jitter", "voltage mode, jittered time stamps"),
    ("fit", "voltage-outliers", "voltage mode, outliers"),
    ("fit", "voltage-coloured", "voltage mode, coloured noise"),
    ("fit", "voltage-slow-instant", "voltage mode, 200 Hz, voltage at the instant"),
    ("fit", "voltage-slow-mean", "voltage mode, 200 Hz, mean voltage"),
    ("fit", "voltage-counts", "voltage mode, encoder of 1000 counts"),
    ("fit", "rate-clean", "speed loop"),
    ("fit", "rate-coloured", "speed loop, coloured noise"),
    ("fit", "rate-slow-instant", "speed loop, 200 Hz, voltage at the instant"),
    ("fit", "rate-slow-mean", "speed loop, 200 Hz, mean voltage"),
    ("fit", "rate-counts", "speed loop, encoder of 1000 counts"),
    ("fit", "rate-shaft", "speed loop, soft shaft"),
    ("fit", "rate-play", "speed loop, play"),
    ("calibrate", "gyro", "gyroscopes"),
    ("calibrate", "accel", "accelerometers"),
    ("calibrate", "drive", "drives"),
    ("drift", "steady", "steady drift"),
    ("drift", "walk", "random walk of the drift"),
    ("drift", "ramp", "drift that rises steadily"),
    ("drift", "walk-four-positions", "random walk, four positions"),
    ("drift", "visit-offsets", "level changes with each turn"),
    ("allan", "mixture", "white noise, flicker noise, random walk"),
    ("allan", "warm-up", "the same with a decaying exponential"),
    ("allan", "wild-rows", "the same with 5 to 30 wild rows"),
    ("allan", "periodic", "the same with a sinusoid, 1.5 to 500 periods"),
    ("allan", "rounded", "the same, rounded to 0.3 to 4 σ of a row"),
];

fn words(row: &CoverageRecord) -> &str {
    let of = |(analysis, condition, _): &&(&str, &str, &str)| *analysis == row.analysis && *condition == row.condition;
    CONDITIONS.iter().find(of).map_or(row.condition.as_str(), |(.., words)| words)
}

/// The section on coverage.
pub fn section(rows: &[CoverageRecord]) -> String {
    format!("{}\n{}", by_condition(rows), outside(rows))
}

fn by_condition(rows: &[CoverageRecord]) -> String {
    let mut lines: Vec<Vec<String>> = Vec::new();
    for of in rows.chunk_by(|a, b| (&a.analysis, &a.condition) == (&b.analysis, &b.condition)) {
        let Some(first) = of.first() else { continue };
        let sum = |field: fn(&CoverageRecord) -> usize| of.iter().map(field).sum::<usize>();
        let (intervals, covered) = (sum(|r| r.intervals), sum(|r| r.covered));
        let is = |chance: Chance| of.iter().filter(|row| row.chance() == chance).count().to_string();
        lines.push(vec![
            format!("`{}`", first.analysis),
            words(first).to_owned(),
            first.cases.to_string(),
            first.refused.to_string(),
            of.len().to_string(),
            intervals.to_string(),
            format!("{:.1} %", 100.0 * covered as f64 / intervals.max(1) as f64),
            is(Chance::TooFew),
            is(Chance::TooMany),
        ]);
    }
    let header = [
        "analysis",
        "condition",
        "measurements",
        "refused",
        "quantities",
        "95 % intervals",
        "that cover",
        "quantities with too few",
        "with too many",
    ];
    format!(
        "\
## Coverage of the uncertainties

How many of the reported 95 % intervals contain the true value? Whole measurements are simulated with random devices, drifts or noise, and evaluated as the commands do. A quantity has *too few* or *too many* intervals that cover if the count is outside the range that chance allows around 95 % (binomial, 99 %): its
uncertainty is then too small, or larger than needed. One quantity in a hundred is expected outside by chance. `tests/baselines/coverage.csv` has each quantity, with the mean error in standard uncertainties; `campaign coverage --cases N` runs more measurements.

{}",
        table(&header, &lines)
    )
}

fn outside(rows: &[CoverageRecord]) -> String {
    let mut lines: Vec<Vec<String>> = Vec::new();
    for chance in [Chance::TooFew, Chance::TooMany] {
        let flagged: Vec<&CoverageRecord> = rows.iter().filter(|row| row.chance() == chance).collect();
        for of in flagged.chunk_by(|a, b| (&a.analysis, &a.condition) == (&b.analysis, &b.condition)) {
            let quantities: Vec<String> = of.iter().map(|row| quantity(row)).collect();
            let first = of.first().map_or(String::new(), |row| format!("`{}`, {}", row.analysis, words(row)));
            lines.push(vec![chance.words().to_owned(), first, quantities.join("; ")]);
        }
    }
    let count = rows.iter().filter(|row| row.chance() != Chance::Within).count();
    format!(
        "{count} of {} quantities are outside the range of chance. In brackets the mean error and the root mean square (rms) error, in standard uncertainties; an rms error of 1 is expected.\n\n{}",
        rows.len(),
        table(&["cover", "condition", "quantities"], &lines)
    )
}

fn quantity(row: &CoverageRecord) -> String {
    let errors = row.mean_error_sigma.zip(row.rms_error_sigma).map_or(String::new(), |(mean, rms)| format!(" ({mean:+.1}, rms {rms:.1})"));
    format!("`{}` {} of {}{errors}", row.quantity, row.covered, row.intervals)
}

#[cfg(test)]
mod tests {
    use super::super::super::coverage::ids;
    use super::*;

    #[test]
    fn each_condition_has_words() {
        for id in ids(Some(1)) {
            let parts: Vec<&str> = id.split('/').collect();
            assert!(CONDITIONS.iter().any(|(analysis, condition, _)| [*analysis, *condition] == parts[..2]), "{id}");
        }
    }
}
