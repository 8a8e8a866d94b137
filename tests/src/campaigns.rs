//! Answers of `explain` in the CSVs of campaigns ([`crate::tables::csv_record`]): pooled over the pieces of a campaign, and of the two engines on the same logs.
//!
//! In: the CSVs. Out: tables for docs/figures.md.

use std::collections::BTreeMap;

use drive_model::cards;
use host_tools::identify::explain::Engine;
use serde::Deserialize;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF};

use crate::tables::{Line, extra};
use crate::verdicts::Outcome;

/// Name of an engine in the CSV and on the command line.
pub fn name(engine: Engine) -> &'static str {
    match engine {
        Engine::Whitened => "whitened",
        Engine::PredictionError => "prediction-error",
    }
}

/// The fields of a record that are used.
#[derive(Deserialize)]
struct Record {
    group: String,
    engine: String,
    id: String,
    hidden: String,
    verdict: String,
    missing: String,
    ambiguous_with: String,
    visible: String,
    deviations_sigma: String,
    seconds: f64,
}

/// The answer of an engine to a log.
#[derive(Debug, Clone)]
pub struct Answer {
    group: String,
    engine: String,
    line: Line,
}

impl From<Record> for Answer {
    fn from(r: Record) -> Self {
        let list = |field: &str| -> Vec<String> { field.split("; ").filter(|name| !name.is_empty()).map(str::to_owned).collect() };
        let deviation = |text: String| text.rsplit_once(' ').and_then(|(name, off)| Some((name.to_owned(), off.parse().ok()?)));
        let outcome = Outcome {
            verdict: r.verdict,
            missing: list(&r.missing),
            ambiguous_with: list(&r.ambiguous_with),
            visible: list(&r.visible),
            deviations: list(&r.deviations_sigma).into_iter().filter_map(deviation).collect(),
            seconds: r.seconds,
            ..Outcome::default()
        };
        let line = Line { id: r.id, hidden: list(&r.hidden), description: String::new(), outcome };
        Answer { group: r.group, engine: r.engine, line }
    }
}

/// Answers of some campaigns.
///
/// # Errors
/// No file; or the file's name, and the row and field that are not those of a campaign.
pub fn read(paths: &[String]) -> Result<Vec<Answer>, String> {
    if paths.is_empty() {
        return Err("no CSV of a campaign is named".to_owned());
    }
    let mut answers = Vec::new();
    for path in paths {
        let file = csv::Reader::from_path(path).map_err(|e| format!("{path}: {e}"))?;
        for record in file.into_deserialize::<Record>() {
            answers.push(record.map_err(|e| format!("{path}: {e}"))?.into());
        }
    }
    Ok(answers)
}

/// Nothing hidden: adequate. Effects hidden: one of them, or one that this log does not distinguish from it, is named first. A disturbance outside the catalogue:
/// unknown structure. Unlike in [`crate::tables::is_right`] an effect need not be visible, because that depends on the rivals of an engine.
fn is_right(line: &Line) -> bool {
    let (hidden, verdict) = (&line.hidden, line.outcome.verdict.as_str());
    match hidden.first() {
        None => verdict == "adequate",
        Some(first) if cards().iter().any(|c| c.id == first) => hidden.iter().any(|h| line.outcome.names_family_first(h)),
        Some(_) => verdict == "unknown-structure",
    }
}

/// An effect is named that is not there.
fn has_phantom(line: &Line) -> bool {
    !extra(line).is_empty()
}

/// Two-sided exact p of McNemar's test (Psychometrika 12 (1947) 153): of the logs in which the engines differ, each is right in one half, if they are equally good.
fn mcnemar(only_old: u64, only_new: u64) -> f64 {
    let Ok(coin) = Binomial::new(0.5, only_old + only_new) else { return f64::NAN };
    (2.0 * coin.cdf(only_old.min(only_new))).min(1.0)
}

/// The log can be answered: nothing hidden, something outside the catalogue, or an effect that this log shows.
fn can_be_right(line: &Line) -> bool {
    let of_catalogue = line.hidden.iter().any(|h| cards().iter().any(|c| c.id == h));
    !of_catalogue || !line.outcome.visible.is_empty()
}

fn is_effect_found(line: &Line) -> bool {
    line.outcome.verdict == "effect-found"
}

fn is_unnamed(line: &Line) -> bool {
    line.outcome.missing.is_empty() && line.outcome.verdict == "unknown-structure"
}

fn is_refused(line: &Line) -> bool {
    line.outcome.verdict == "bad-log" || line.outcome.verdict == "error"
}

/// Upper limit of a probability by `count` events in `of` trials, 95 % (Clopper and Pearson, Biometrika 26 (1934) 404).
fn upper_limit(count: usize, of: usize) -> f64 {
    if count >= of { 1.0 } else { Beta::new(count as f64 + 1.0, (of - count) as f64).map_or(f64::NAN, |beta| beta.inverse_cdf(0.95)) }
}

/// One row per group of logs and engine, and the logs that are not right or in which an effect is named that is not there.
pub fn pooled(answers: &[Answer]) -> String {
    let mut groups: BTreeMap<(&str, &str), BTreeMap<&str, &Line>> = BTreeMap::new();
    for a in answers {
        groups.entry((&a.group, &a.engine)).or_default().insert(&a.line.id, &a.line);
    }
    let mut text = "| logs of | logs | can be right | right | not there, `effect-found` (upper 95 % limit) | not there, any verdict | no name, `unknown-structure` | refused | intervals that cover | seconds: median, 95 %, largest, sum |\n".to_owned();
    text += "|---|---|---|---|---|---|---|---|---|---|\n";
    let mut wrong = String::new();
    for ((group, engine), lines) in &groups {
        let lines: Vec<&Line> = lines.values().copied().collect();
        let count = |test: &dyn Fn(&Line) -> bool| lines.iter().filter(|line| test(line)).count();
        let found = count(&|line| is_effect_found(line) && has_phantom(line));
        let (answerable, right) = (count(&can_be_right), count(&|line| can_be_right(line) && is_right(line)));
        text += &format!(
            "| {group}, {engine} | {} | {answerable} | {right} ({:.1} %) | {found} ({:.1} %) | {} | {} | {} | {} | {} |\n",
            lines.len(),
            100.0 * right as f64 / answerable.max(1) as f64,
            100.0 * upper_limit(found, lines.len()),
            count(&has_phantom),
            count(&is_unnamed),
            count(&is_refused),
            coverage(&lines),
            seconds(&lines)
        );
        for line in lines.iter().filter(|line| (can_be_right(line) && !is_right(line)) || has_phantom(line)) {
            let answer = format!("{} {}", line.outcome.verdict, line.outcome.missing.join(", "));
            wrong += &format!("- {group}, {engine}: {}: {}\n", line.id, answer.trim_end());
        }
    }
    text + "\nNot right, or with an effect that is not there:\n\n" + &wrong
}

/// Covered intervals of an engine's rightly added effects.
fn coverage(lines: &[&Line]) -> String {
    let outcomes = || lines.iter().map(|line| &line.outcome);
    format!("{} of {}", outcomes().map(Outcome::covered).sum::<usize>(), outcomes().map(|o| o.deviations.len()).sum::<usize>())
}

/// Processor seconds of an engine.
fn seconds(lines: &[&Line]) -> String {
    let mut seconds: Vec<f64> = lines.iter().map(|line| line.outcome.seconds).collect();
    seconds.sort_by(f64::total_cmp);
    let at = |part: f64| seconds.get((seconds.len() as f64 * part) as usize).or(seconds.last()).copied().unwrap_or(f64::NAN);
    format!("{:.1}, {:.1}, {:.0}, {:.0}", at(0.5), at(0.95), at(1.0), seconds.iter().sum::<f64>())
}

/// The answers of both engines to the logs that both have: the engine on whitened residuals is the old one.
///
/// # Errors
/// No log has been answered by both.
pub fn engines(answers: &[Answer]) -> Result<String, String> {
    let of = |engine: Engine| answers.iter().filter(move |a| a.engine == name(engine)).map(|a| ((&a.group, &a.line.id), &a.line));
    let by_new: BTreeMap<_, _> = of(Engine::PredictionError).collect();
    let by_both: BTreeMap<_, _> = of(Engine::Whitened).filter_map(|(log, old)| Some((log, (old, *by_new.get(&log)?)))).collect();
    let (old, new): (Vec<&Line>, Vec<&Line>) = by_both.values().copied().unzip();
    if old.is_empty() {
        return Err("no log has been answered by both engines".to_owned());
    }
    let mut text =
        "| of the same logs | old | new | in the old alone | in the new alone | McNemar's p |\n|---|---|---|---|---|---|\n".to_owned();
    let mut row = |name: &str, test: &dyn Fn(&Line) -> bool| {
        let results: Vec<(bool, bool)> = old.iter().zip(&new).map(|(a, b)| (test(a), test(b))).collect();
        let count = |wanted: &dyn Fn(bool, bool) -> bool| results.iter().filter(|(a, b)| wanted(*a, *b)).count() as u64;
        let (only_old, only_new) = (count(&|a, b| a && !b), count(&|a, b| !a && b));
        let (by_old, by_new) = (count(&|a, _| a), count(&|_, b| b));
        text += &format!("| {name} | {by_old} | {by_new} | {only_old} | {only_new} | {:.2} |\n", mcnemar(only_old, only_new));
    };
    row("right: named first; or adequate, nothing hidden", &is_right);
    row("an effect that is not there, `effect-found`", &|line| is_effect_found(line) && has_phantom(line));
    row("an effect that is not there, any verdict", &has_phantom);
    row("nothing named, `unknown-structure`", &is_unnamed);
    row("an effect is hidden, `adequate`", &|line| !line.hidden.is_empty() && line.outcome.verdict == "adequate");
    row("refused", &is_refused);
    text += &format!("| 95 % intervals of rightly added effects that cover | {} | {} | | | |\n", coverage(&old), coverage(&new));
    text += &format!("| seconds on one core: median, 95 %, largest, sum | {} | {} | | | |\n", seconds(&old), seconds(&new));
    text += &format!("\n{} logs. Different answers:\n\n| log | old | new |\n|---|---|---|\n", old.len());
    for (a, b) in old.iter().zip(&new).filter(|(a, b)| is_right(a) != is_right(b) || has_phantom(a) != has_phantom(b)) {
        let answer = |line: &Line| format!("{} {}", line.outcome.verdict, line.outcome.missing.join(", "));
        text += &format!("| {} | {} | {} |\n", a.id, answer(a), answer(b));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answer(engine: &str, id: &str, hidden: &str, verdict: &str, missing: &str, ambiguous_with: &str) -> Answer {
        let [group, engine, id, hidden, verdict, missing, ambiguous_with, visible] =
            ["own", engine, id, hidden, verdict, missing, ambiguous_with, hidden].map(str::to_owned);
        let deviations_sigma = "coulomb_N_m -0.50; load_N_m +3.10".to_owned();
        Record { group, engine, id, hidden, verdict, missing, ambiguous_with, visible, deviations_sigma, seconds: 1.0 }.into()
    }

    #[test]
    fn right_and_wrong_answers() {
        let of = |hidden, verdict, missing, ambiguous_with| {
            let line = answer("whitened", "a", hidden, verdict, missing, ambiguous_with).line;
            (is_right(&line), has_phantom(&line))
        };
        assert_eq!(of("coulomb", "effect-found", "coulomb; cogging#2", ""), (true, true));
        assert_eq!(of("load", "effect-found", "asymmetric-friction", "load"), (true, false));
        assert_eq!(of("", "partly-explained", "cogging", ""), (false, true));
        assert_eq!(of("", "adequate", "", ""), (true, false));
        assert_eq!(of("cogging", "adequate", "", ""), (false, false));
        assert_eq!(of("sector-rub", "unknown-structure", "torque-ripple", ""), (true, true));
    }

    /// Only logs that both engines have are compared; a line per kind of answer, with the logs in which the engines differ.
    #[test]
    fn engines_are_compared_on_their_common_logs() {
        let answers = [
            answer("whitened", "a", "coulomb", "effect-found", "coulomb; cogging", ""),
            answer("prediction-error", "a", "coulomb", "effect-found", "coulomb", ""),
            answer("whitened", "b", "load", "effect-found", "load", ""),
            answer("prediction-error", "b", "load", "adequate", "", ""),
            answer("whitened", "c", "", "adequate", "", ""),
        ];
        let text = engines(&answers).expect("two common logs");
        assert!(text.contains("| right: named first; or adequate, nothing hidden | 2 | 1 | 1 | 0 | 1.00 |"), "{text}");
        assert!(text.contains("| an effect that is not there, `effect-found` | 1 | 0 | 1 | 0 | 1.00 |"), "{text}");
        assert!(text.contains("that cover | 2 of 4 | 2 of 4 |") && text.contains("\n2 logs."), "{text}");
        assert!(engines(&answers[4..]).is_err_and(|e| e.contains("both engines")));
    }

    /// Pieces of a campaign are one row; a log that two of them have counts once.
    #[test]
    fn pieces_are_pooled() {
        let answers = [
            answer("whitened", "a", "coulomb", "effect-found", "coulomb; cogging", ""),
            answer("whitened", "a", "coulomb", "effect-found", "coulomb; cogging", ""),
            answer("whitened", "b", "load", "unknown-structure", "", ""),
        ];
        let text = pooled(&answers);
        assert!(text.contains("| own, whitened | 2 | 2 | 1 (50.0 %) | 1 (97.5 %) | 1 | 1 | 0 | 2 of 4 | 1.0, 1.0, 1, 2 |"), "{text}");
        assert!(read(&[]).is_err_and(|e| e.contains("no CSV")));
        assert!(text.ends_with("- own, whitened: a: effect-found coulomb, cogging\n- own, whitened: b: unknown-structure\n"), "{text}");
    }

    /// None of 300: 1 − 0.05^(1/300); one of two: √0.95.
    #[test]
    fn exact_upper_limit() {
        assert!((upper_limit(0, 300) - 0.009936).abs() < 1e-5, "{}", upper_limit(0, 300));
        assert!((upper_limit(1, 2) - 0.974_679).abs() < 1e-5);
        assert_eq!(upper_limit(2, 2), 1.0);
    }

    /// 1 of 10: 2 · (1 + 10) / 1024.
    #[test]
    fn exact_mcnemar() {
        assert!((mcnemar(1, 9) - 22.0 / 1024.0).abs() < 1e-12);
        assert_eq!(mcnemar(0, 0), 1.0);
        assert_eq!(mcnemar(5, 5), 1.0);
    }
}
