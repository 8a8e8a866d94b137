//! Counts of each quantity under each condition, and what chance allows.

use std::collections::BTreeMap;
use std::fmt::Write;

use identification::statistics::distributions::binomial_interval;
use serde::{Deserialize, Serialize};

use super::{CaseRecord, Interval};
use crate::campaign::inputs::InputHash;

/// Coverage probability that the results state.
const STATED: f64 = 0.95;
/// Probability of the range that chance allows: 0.5 % beyond each end.
const CHANCE: f64 = 0.99;

/// One quantity under one condition: a line of the baseline.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CoverageRecord {
    /// `fit`, `calibrate`, `drift` or `allan`.
    pub analysis: String,
    /// Name of the condition.
    pub condition: String,
    /// Name of the quantity.
    pub quantity: String,
    /// Measurements.
    pub cases: usize,
    /// Measurements that the analysis refuses.
    pub refused: usize,
    /// Measurements that report an interval of this quantity.
    pub intervals: usize,
    /// Intervals that contain the truth.
    pub covered: usize,
    /// Their share of the intervals, %.
    pub share_percent: f64,
    /// Mean error in standard uncertainties; none of upper limits.
    pub mean_error_sigma: Option<f64>,
    /// Root mean square error in standard uncertainties; none of upper limits.
    pub rms_error_sigma: Option<f64>,
    /// Hash of the inputs of all measurements of the condition.
    pub inputs: String,
}

/// A count against what chance allows around 95 %.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chance {
    /// Fewer intervals cover than chance allows: the uncertainty is too small.
    TooFew,
    /// Within the range.
    Within,
    /// More intervals cover than chance allows: the uncertainty is larger than needed.
    TooMany,
}

impl Chance {
    /// `covered` of `intervals` against the 99 % range of the binomial distribution around 95 %.
    pub fn of(covered: usize, intervals: usize) -> Self {
        let (low, high) = binomial_interval(intervals as u64, STATED, CHANCE);
        match covered as f64 / intervals.max(1) as f64 {
            _ if intervals == 0 => Self::Within,
            share if share < low => Self::TooFew,
            share if share > high => Self::TooMany,
            _ => Self::Within,
        }
    }

    /// Words of a table.
    pub fn words(self) -> &'static str {
        match self {
            Self::TooFew => "**too few**",
            Self::Within => "within",
            Self::TooMany => "too many",
        }
    }
}

impl CoverageRecord {
    /// The line against chance.
    pub fn chance(&self) -> Chance {
        Chance::of(self.covered, self.intervals)
    }

    /// What a line is about.
    pub fn key(&self) -> (&str, &str, &str) {
        (&self.analysis, &self.condition, &self.quantity)
    }

    /// Counts of the intervals of one quantity.
    pub fn counted(key: (&str, &str, &str), cases: usize, refused: usize, intervals: &[Interval], inputs: &str) -> Self {
        let covered = intervals.iter().filter(|i| i.covers).count();
        let errors: Vec<f64> = intervals.iter().filter_map(|i| i.error_sigma).collect();
        let mean = |of: fn(f64) -> f64| (!errors.is_empty()).then(|| errors.iter().map(|e| of(*e)).sum::<f64>() / errors.len() as f64);
        Self {
            analysis: key.0.to_owned(),
            condition: key.1.to_owned(),
            quantity: key.2.to_owned(),
            cases,
            refused,
            intervals: intervals.len(),
            covered,
            share_percent: rounded(100.0 * covered as f64 / intervals.len().max(1) as f64, 1),
            mean_error_sigma: mean(|e| e).map(|mean| rounded(mean, 2)),
            rms_error_sigma: mean(|e| e * e).map(|mean| rounded(mean.sqrt(), 2)),
            inputs: inputs.to_owned(),
        }
    }
}

fn rounded(value: f64, digits: i32) -> f64 {
    let scale = 10_f64.powi(digits);
    // + 0.0: no minus sign of zero.
    (value * scale).round() / scale + 0.0
}

/// The lines of a run, in the order of its conditions; quantities by name.
pub fn rows(cases: &[CaseRecord]) -> Vec<CoverageRecord> {
    let mut conditions: Vec<(&str, &str)> = Vec::new();
    for condition in cases.iter().map(CaseRecord::condition) {
        if !conditions.contains(&condition) {
            conditions.push(condition);
        }
    }
    let mut rows = Vec::new();
    for (analysis, condition) in conditions {
        let mut of: Vec<&CaseRecord> = cases.iter().filter(|case| case.condition() == (analysis, condition)).collect();
        // A run keeps its measurements in the order in which they end.
        of.sort_by(|a, b| a.id.cmp(&b.id));
        let refused = of.iter().filter(|case| !case.refused.is_empty()).count();
        let inputs = of.iter().fold(InputHash::default(), |hash, case| hash.text(&case.inputs)).short();
        let mut by_quantity: BTreeMap<String, Vec<Interval>> = BTreeMap::new();
        for interval in of.iter().flat_map(|case| case.intervals()) {
            by_quantity.entry(interval.quantity.clone()).or_default().push(interval);
        }
        rows.extend(
            by_quantity.iter().map(|(quantity, intervals)| {
                CoverageRecord::counted((analysis, condition, quantity), of.len(), refused, intervals, &inputs)
            }),
        );
    }
    rows
}

/// The table of all lines.
pub fn table(rows: &[CoverageRecord]) -> String {
    let mut text = "| analysis | condition | quantity | measurements | refused | 95 % intervals | that cover | share | against chance (99 %) | mean error, u | rms error, u |\n|---|---|---|---|---|---|---|---|---|---|---|\n".to_owned();
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:+.2}"));
    for row in rows {
        let _ = writeln!(
            text,
            "| {} | {} | `{}` | {} | {} | {} | {} | {:.1} % | {} | {} | {} |",
            row.analysis,
            row.condition,
            row.quantity,
            row.cases,
            row.refused,
            row.intervals,
            row.covered,
            row.share_percent,
            row.chance().words(),
            number(row.mean_error_sigma),
            row.rms_error_sigma.map_or(String::new(), |rms| format!("{rms:.2}")),
        );
    }
    let outside = rows.iter().filter(|row| row.chance() != Chance::Within).count();
    let _ = writeln!(text, "\n{outside} of {} lines are outside the range of chance; one in a hundred is expected.", rows.len());
    text
}

#[cfg(test)]
mod tests {
    use super::super::super::record::List;
    use super::*;

    /// R: qbinom(c(0.005, 0.995), 100, 0.95) = 89, 99.
    #[test]
    fn counts_outside_the_binomial_range_are_flagged() {
        let of = |covered| Chance::of(covered, 100);
        assert_eq!([of(88), of(89), of(95), of(100)], [Chance::TooFew, Chance::Within, Chance::Within, Chance::Within]);
        assert_eq!((Chance::of(400, 400), Chance::of(0, 0)), (Chance::TooMany, Chance::Within));
    }

    #[test]
    fn a_line_counts_refusals_and_missing_intervals() {
        let case = |seed: u64, refused: &str, intervals: &str| CaseRecord {
            id: format!("fit/voltage-clean/{seed}"),
            inputs: seed.to_string(),
            refused: refused.to_owned(),
            intervals: List(intervals.split_whitespace().map(str::to_owned).collect()),
        };
        let cases = [case(1, "", "a=1.0;covers b=3.0;misses"), case(2, "no current", ""), case(3, "", "a=-2.5;misses limit=;covers")];
        let rows = rows(&cases);
        let [a, b, limit] = rows.as_slice() else { panic!("{rows:?}") };
        assert_eq!((a.cases, a.refused, a.intervals, a.covered, a.share_percent), (3, 1, 2, 1, 50.0));
        assert_eq!((a.mean_error_sigma, a.rms_error_sigma), (Some(-0.75), Some(1.9)));
        assert_eq!((b.intervals, b.covered, limit.mean_error_sigma), (1, 0, None));
        let mut in_other_order = cases.clone();
        in_other_order.reverse();
        assert_eq!(super::rows(&in_other_order), rows);
        let other = super::rows(&[case(1, "", "a=1.0;covers")]);
        assert_ne!(a.inputs, other[0].inputs);
    }
}
