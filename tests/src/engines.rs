//! Two engines on the same logs: what each names, and whether the difference is significant.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use statrs::distribution::{Binomial, DiscreteCDF};

use crate::TWO_SIDED_95;
use crate::verdicts::stem;

/// A line of a campaign's CSV ([`crate::tables::csv_line`]).
#[derive(Debug, Clone, Deserialize)]
pub struct Answer {
    id: String,
    hidden: String,
    verdict: String,
    missing: String,
    ambiguous_with: String,
    deviations_sigma: String,
    seconds: f64,
}

/// Names of a field that lists several.
fn listed(field: &str) -> impl Iterator<Item = &str> {
    field.split("; ").filter(|name| !name.is_empty())
}

impl Answer {
    /// Nothing hidden: adequate. Otherwise a hidden effect, or one of its family that this log does not distinguish from it, is named first. Whether an
    /// effect is visible is not asked, because that depends on the rivals of an engine.
    fn is_right(&self) -> bool {
        let Some(first) = listed(&self.missing).next() else { return self.hidden.is_empty() && self.verdict == "adequate" };
        listed(&self.hidden).any(|h| stem(first) == h || listed(&self.ambiguous_with).any(|a| stem(a) == h))
    }

    /// An effect is named that is not there.
    fn has_phantom(&self) -> bool {
        listed(&self.missing).enumerate().any(|(k, name)| {
            let family = k == 0 && self.is_right();
            !family && !listed(&self.hidden).any(|h| stem(name) == h)
        })
    }

    /// The worst answer: an effect that is not there, and nothing is said to be left.
    fn is_wrongly_found(&self) -> bool {
        self.verdict == "effect-found" && self.has_phantom()
    }

    /// Deviations of the parameters of rightly added effects, σ.
    fn deviations(&self) -> impl Iterator<Item = f64> {
        listed(&self.deviations_sigma).filter_map(|d| d.rsplit(' ').next()?.parse().ok())
    }
}

/// Answers of a campaign.
///
/// # Errors
/// With the file's name and its row, if it is not a CSV of `confusion`.
pub fn read(path: &Path) -> Result<Vec<Answer>, String> {
    let mut file = csv::Reader::from_path(path).map_err(|e| format!("{}: {e}", path.display()))?;
    file.deserialize().collect::<Result<_, _>>().map_err(|e| format!("{}: {e}", path.display()))
}

/// Two-sided exact p of McNemar's test (Psychometrika 12 (1947) 153): of the logs in which the engines differ, each is right in one half, if they are equally good.
fn mcnemar(only_old: u64, only_new: u64) -> f64 {
    let Ok(coin) = Binomial::new(0.5, only_old + only_new) else { return f64::NAN };
    (2.0 * coin.cdf(only_old.min(only_new))).min(1.0)
}

/// Totals of one engine.
struct Side {
    covered: usize,
    intervals: usize,
    /// Sorted.
    seconds: Vec<f64>,
}

impl Side {
    fn of<'a>(answers: impl Iterator<Item = &'a Answer> + Clone) -> Self {
        let deviations: Vec<f64> = answers.clone().flat_map(Answer::deviations).collect();
        let mut seconds: Vec<f64> = answers.map(|a| a.seconds).collect();
        seconds.sort_by(f64::total_cmp);
        Side { covered: deviations.iter().filter(|d| d.abs() < TWO_SIDED_95).count(), intervals: deviations.len(), seconds }
    }

    fn seconds_at(&self, part: f64) -> f64 {
        self.seconds.get((self.seconds.len() as f64 * part) as usize).or(self.seconds.last()).copied().unwrap_or(f64::NAN)
    }
}

/// The answers of two engines to the logs that both have.
pub fn table(old: &[Answer], new: &[Answer]) -> String {
    let by_id: BTreeMap<&str, &Answer> = new.iter().map(|a| (a.id.as_str(), a)).collect();
    let pairs: Vec<(&Answer, &Answer)> = old.iter().filter_map(|a| Some((a, *by_id.get(a.id.as_str())?))).collect();
    let mut text =
        "| of the same logs | old | new | in the old alone | in the new alone | McNemar's p |\n|---|---|---|---|---|---|\n".to_owned();
    let mut row = |name: &str, test: &dyn Fn(&Answer) -> bool| {
        let count = |test: &dyn Fn(&(&Answer, &Answer)) -> bool| pairs.iter().filter(|pair| test(pair)).count() as u64;
        let (only_old, only_new) = (count(&|(a, b)| test(a) && !test(b)), count(&|(a, b)| !test(a) && test(b)));
        let (of_old, of_new) = (count(&|(a, _)| test(a)), count(&|(_, b)| test(b)));
        text += &format!("| {name} | {of_old} | {of_new} | {only_old} | {only_new} | {:.2} |\n", mcnemar(only_old, only_new));
    };
    row("right: named first; or adequate, nothing hidden", &Answer::is_right);
    row("an effect that is not there, `effect-found`", &Answer::is_wrongly_found);
    row("an effect that is not there, any verdict", &Answer::has_phantom);
    row("nothing named, `unknown-structure`", &|a| a.missing.is_empty() && a.verdict == "unknown-structure");
    row("an effect is hidden, `adequate`", &|a| !a.hidden.is_empty() && a.verdict == "adequate");
    row("refused", &|a| a.verdict == "bad-log" || a.verdict == "error");
    let sides = [Side::of(pairs.iter().map(|(a, _)| *a)), Side::of(pairs.iter().map(|(_, b)| *b))];
    let mut both = |name: &str, cell: &dyn Fn(&Side) -> String| {
        text += &format!("| {name} | {} | {} | | | |\n", cell(&sides[0]), cell(&sides[1]));
    };
    both("95 % intervals of rightly added effects that cover", &|side| format!("{} of {}", side.covered, side.intervals));
    both("seconds on one core: median, 95 %, largest", &|side| {
        format!("{:.1}, {:.1}, {:.1}", side.seconds_at(0.5), side.seconds_at(0.95), side.seconds_at(1.0))
    });
    text += &format!("\n{} logs. Different answers:\n\n| log | old | new |\n|---|---|---|\n", pairs.len());
    for (a, b) in pairs.iter().filter(|(a, b)| a.is_right() != b.is_right() || a.has_phantom() != b.has_phantom()) {
        text += &format!("| {} | {} {} | {} {} |\n", a.id, a.verdict, a.missing, b.verdict, b.missing);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(hidden: &str, verdict: &str, missing: &str, ambiguous_with: &str) -> Answer {
        Answer {
            id: String::new(),
            hidden: hidden.into(),
            verdict: verdict.into(),
            missing: missing.into(),
            ambiguous_with: ambiguous_with.into(),
            deviations_sigma: "coulomb_N_m -0.50; load_N_m +3.10".into(),
            seconds: 1.0,
        }
    }

    #[test]
    fn right_and_wrong_answers() {
        let right = answer("coulomb", "effect-found", "coulomb; cogging#2", "");
        assert!(right.is_right() && right.has_phantom() && right.is_wrongly_found());
        let family = answer("load", "effect-found", "asymmetric-friction", "load");
        assert!(family.is_right() && !family.has_phantom());
        let partly = answer("", "partly-explained", "cogging", "");
        assert!(!partly.is_right() && partly.has_phantom() && !partly.is_wrongly_found());
        assert!(answer("", "adequate", "", "").is_right() && !answer("cogging", "adequate", "", "").is_right());
        assert_eq!(right.deviations().collect::<Vec<_>>(), [-0.5, 3.1]);
    }

    /// 1 of 10: 2 · (1 + 10) / 1024.
    #[test]
    fn exact_mcnemar() {
        assert!((mcnemar(1, 9) - 22.0 / 1024.0).abs() < 1e-12);
        assert_eq!(mcnemar(0, 0), 1.0);
        assert_eq!(mcnemar(5, 5), 1.0);
    }
}
