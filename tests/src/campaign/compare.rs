//! Two runs of a set: which answers changed, which of them to the worse, and what a set says as a whole.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt::Write;

use super::case::group;
use super::judge::{Judgement, covered, groups, judge, mcnemar, upper_limit, visible};
use super::record::{AnswerRecord, LogRecord};

/// Change of a parameter that is more than rounding, σ.
const MIN_PARAMETER_CHANGE_SIGMAS: f64 = 0.02;

/// What two runs differ in.
#[derive(Debug, Default)]
pub struct Difference {
    /// Lines on answers with another verdict or other names: `id: before → after`.
    pub answers: Vec<String>,
    /// Those of them that are judged worse.
    pub worse: Vec<String>,
    /// Those of them that are judged better.
    pub better: Vec<String>,
    /// Lines on parameters that moved, where the answer is the same.
    pub parameters: Vec<String>,
    /// Logs whose effort changed by more than a tenth.
    pub effort: Vec<String>,
    /// Logs that the generator makes differently now; they are not compared.
    pub other_logs: Vec<String>,
    /// Logs that one run has alone.
    pub only_in_one: Vec<String>,
    /// The whole as text.
    pub text: String,
}

impl Difference {
    /// No answer, parameter or effort has changed, and all logs were compared.
    pub fn is_empty(&self) -> bool {
        let changes = [&self.answers, &self.parameters, &self.effort, &self.other_logs, &self.only_in_one];
        changes.into_iter().all(Vec::is_empty)
    }
}

/// Compares the answers `after` with those `before`, judged by what the generator made.
pub fn difference(logs: &[LogRecord], before: &[AnswerRecord], after: &[AnswerRecord]) -> Difference {
    let logs: BTreeMap<&str, &LogRecord> = logs.iter().map(|log| (log.id.as_str(), log)).collect();
    let old: BTreeMap<&str, &AnswerRecord> = before.iter().map(|a| (a.id.as_str(), a)).collect();
    let new: BTreeMap<&str, &AnswerRecord> = after.iter().map(|a| (a.id.as_str(), a)).collect();
    let mut d = Difference::default();
    d.only_in_one.extend(new.keys().filter(|id| !old.contains_key(*id)).map(|id| format!("{id}: new")));
    let (mut right_before, mut right_after, mut alone) = (0, 0, (0, 0));
    let mut compared: Vec<(&AnswerRecord, &AnswerRecord)> = Vec::new();
    for (id, new) in &new {
        let (Some(old), Some(log)) = (old.get(id), logs.get(id)) else { continue };
        if old.sha256 != new.sha256 || log.sha256 != new.sha256 {
            d.other_logs.push((*id).to_owned());
            continue;
        }
        compared.push((old, new));
        let (was, is) = (judge(log, old), judge(log, new));
        let (was_right, is_right) = (was == Judgement::Right, is == Judgement::Right);
        right_before += usize::from(was_right);
        right_after += usize::from(is_right);
        alone = (alone.0 + usize::from(was_right && !is_right), alone.1 + usize::from(!was_right && is_right));
        if old.verdict != new.verdict || old.missing != new.missing || old.alike != new.alike {
            let line = format!("{id} ({}): {} → {}; {was:?} → {is:?}", log.hidden.0.join(" "), short(old), short(new));
            match is.cmp(&was) {
                Ordering::Greater => d.worse.push(line.clone()),
                Ordering::Less => d.better.push(line.clone()),
                Ordering::Equal => {}
            }
            d.answers.push(line);
        } else if let Some(moved) = moved(old, new) {
            d.parameters.push(format!("{id}: {moved}"));
        }
        let ratio = new.effort as f64 / old.effort.max(1) as f64;
        if !(0.9..1.1).contains(&ratio) {
            d.effort.push(format!("{id}: {} → {} passes ({ratio:.2} ×)", old.effort, new.effort));
        }
    }
    let total = |of: fn(&(&AnswerRecord, &AnswerRecord)) -> u64| compared.iter().map(of).sum::<u64>();
    let (cover_before, cover_after) = (covered(compared.iter().map(|(old, _)| *old)), covered(compared.iter().map(|(_, new)| *new)));
    let text = &mut d.text;
    let _ = writeln!(
        text,
        "{} logs compared; {} not compared, because their SHA-256 differs; {} in one run alone",
        compared.len(),
        d.other_logs.len(),
        d.only_in_one.len()
    );
    let _ = writeln!(
        text,
        "right: {right_before} before, {right_after} after; right in one run alone: {} before, {} after; McNemar's p = {:.2}",
        alone.0,
        alone.1,
        mcnemar(alone.0, alone.1)
    );
    let _ = writeln!(
        text,
        "95 % intervals that cover: {} of {} before, {} of {} after",
        cover_before.0, cover_before.1, cover_after.0, cover_after.1
    );
    let _ = writeln!(text, "effort, passes: {} before, {} after", total(|(old, _)| old.effort), total(|(_, new)| new.effort));
    for (title, lines) in [
        ("answers to the worse", &d.worse),
        ("answers to the better", &d.better),
        ("changed answers", &d.answers),
        ("the same answer, other parameters", &d.parameters),
        ("effort changed by more than a tenth", &d.effort),
        ("not compared: the SHA-256 of log and model differs", &d.other_logs),
        ("in one run alone", &d.only_in_one),
    ] {
        let _ = writeln!(text, "\n{title}: {}", lines.len());
        lines.iter().for_each(|line| {
            let _ = writeln!(text, "  {line}");
        });
    }
    d
}

fn short(answer: &AnswerRecord) -> String {
    let alike = if answer.alike.0.is_empty() { String::new() } else { format!(" (or {})", answer.alike.0.join(" ")) };
    format!("{} [{}{alike}]", answer.verdict, answer.missing.0.join(" "))
}

/// The parameter that moved most, if by more than rounding.
fn moved(old: &AnswerRecord, new: &AnswerRecord) -> Option<String> {
    let values = |answer: &AnswerRecord| -> BTreeMap<String, (f64, f64)> {
        let of = |entry: &String| {
            let (name, rest) = entry.split_once('=')?;
            let (value, sigma) = rest.split_once('±')?;
            Some((name.to_owned(), (value.parse().ok()?, sigma.parse().ok()?)))
        };
        answer.parameters.0.iter().filter_map(of).collect()
    };
    let (before, after) = (values(old), values(new));
    if before.keys().ne(after.keys()) {
        return Some("other parameters are free".to_owned());
    }
    let changes = before.iter().map(|(name, (value, sigma))| {
        let (now, sigma_now) = after[name];
        let scale = sigma.max(1e-9 * value.abs()).max(f64::MIN_POSITIVE);
        (name, (now - value).abs().max((sigma_now - sigma).abs()) / scale)
    });
    let (name, change) = changes.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (change > MIN_PARAMETER_CHANGE_SIGMAS).then(|| format!("{name} {change:.3} σ"))
}

/// A table of a run: one line for each group, and the logs that are not right.
pub fn table(logs: &[LogRecord], answers: &[AnswerRecord]) -> String {
    let by_id: BTreeMap<&str, &AnswerRecord> = answers.iter().map(|a| (a.id.as_str(), a)).collect();
    let mut text = "| logs | number | right | a false name | upper 95 % limit | false structure | missed | not finished | 95 % intervals that cover | passes, median |\n|---|---|---|---|---|---|---|---|---|---|\n".to_owned();
    let mut wrong = String::new();
    for of in groups(logs.iter()) {
        let pairs: Vec<(&LogRecord, &AnswerRecord)> =
            logs.iter().filter(|log| group(&log.id) == of).filter_map(|log| Some((log, *by_id.get(log.id.as_str())?))).collect();
        let count = |what: &[Judgement]| pairs.iter().filter(|(log, answer)| what.contains(&judge(log, answer))).count();
        let named = count(&[Judgement::FalseName, Judgement::FalseBeside]);
        let (inside, intervals) = covered(pairs.iter().map(|(_, answer)| *answer));
        let mut passes: Vec<u64> = pairs.iter().map(|(_, answer)| answer.effort).collect();
        passes.sort_unstable();
        let _ = writeln!(
            text,
            "| {of} | {} | {} | {named} | {:.1} % | {} | {} | {} | {inside} of {intervals} | {} |",
            pairs.len(),
            count(&[Judgement::Right]),
            100.0 * upper_limit(named, pairs.len()),
            count(&[Judgement::FalseStructure]),
            count(&[Judgement::Missed]),
            count(&[Judgement::NotFinished]),
            passes.get(passes.len() / 2).copied().unwrap_or(0)
        );
        for (log, answer) in pairs.iter().filter(|(log, answer)| judge(log, answer) != Judgement::Right) {
            let _ = writeln!(wrong, "- `{}` ({}): {}: {:?}", log.id, log.expected_gain.0.join(" "), short(answer), judge(log, answer));
        }
    }
    let unseen: Vec<String> = logs
        .iter()
        .filter(|log| visible(log).len() < log.expected_gain.0.len())
        .map(|log| format!("`{}` ({})", log.id, log.expected_gain.0.join(" ")))
        .collect();
    format!(
        "{text}\nNot right:\n\n{wrong}\nHidden effects that are not visible (expected 2 Δ ln L below 50), in {} logs: {}.\n",
        unseen.len(),
        unseen.join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::super::record::List;
    use super::*;

    fn list(text: &str) -> List {
        List(text.split_whitespace().map(str::to_owned).collect())
    }

    /// Logs with hidden cogging.
    fn logs(count: usize) -> Vec<LogRecord> {
        let log =
            |k| LogRecord { id: format!("own/{k}"), sha256: "1".to_owned(), hidden: list("cogging"), expected_gain: list("cogging=900") };
        (0..count).map(log).collect()
    }

    /// Right answers, and from `first_missed` on adequate ones, which miss the cogging.
    fn answers(count: usize, first_missed: usize) -> Vec<AnswerRecord> {
        let answer = |k| {
            let (verdict, missing) = if k < first_missed { ("effect-found", list("cogging")) } else { ("adequate", List::default()) };
            let parameters = list("inertia_kg_m2=2.5e-4±1e-7");
            AnswerRecord {
                id: format!("own/{k}"),
                sha256: "1".to_owned(),
                verdict: verdict.to_owned(),
                missing,
                parameters,
                effort: 100,
                ..AnswerRecord::default()
            }
        };
        (0..count).map(answer).collect()
    }

    #[test]
    fn equal_runs_do_not_differ() {
        let d = difference(&logs(3), &answers(3, 3), &answers(3, 3));
        assert!(d.is_empty() && d.text.starts_with("3 logs compared"), "{}", d.text);
    }

    /// Six of ten logs are missed now: p = 2 / 2⁶ = 0.03.
    #[test]
    fn changed_answers_are_worse_or_better_with_mcnemars_p() {
        let d = difference(&logs(10), &answers(10, 10), &answers(10, 4));
        assert_eq!((d.answers.len(), d.worse.len(), d.better.len()), (6, 6, 0));
        assert!(d.text.contains("right: 10 before, 4 after") && d.text.contains("McNemar's p = 0.03"), "{}", d.text);
        assert!(d.worse[0].contains("effect-found [cogging] → adequate []; Right → Missed"), "{}", d.worse[0]);
        let back = difference(&logs(10), &answers(10, 4), &answers(10, 10));
        assert_eq!((back.answers.len(), back.worse.len(), back.better.len()), (6, 0, 6));
        assert!(!d.is_empty() && !back.is_empty());
    }

    #[test]
    fn an_answer_to_another_log_is_reported_and_not_compared() {
        let mut after = answers(2, 0);
        after[1].sha256 = "2".to_owned();
        let d = difference(&logs(2), &answers(2, 2), &after);
        assert_eq!(d.other_logs, ["own/1"]);
        assert_eq!((d.answers.len(), d.worse.len()), (1, 1), "the other log alone is compared");
        assert!(d.text.starts_with("1 logs compared; 1 not compared"), "{}", d.text);
        // Also where both runs are of a log that the generator did not make.
        let d = difference(&logs(2), &after, &after);
        assert_eq!(d.other_logs, ["own/1"]);
    }

    #[test]
    fn moved_parameters_and_effort_are_reported() {
        let mut after = answers(2, 2);
        after[0].parameters = list("inertia_kg_m2=2.501e-4±1e-7");
        after[1].effort = 120;
        let d = difference(&logs(2), &answers(2, 2), &after);
        assert_eq!((d.answers.len(), d.parameters.len(), d.effort.len()), (0, 1, 1));
        assert!(d.parameters[0].ends_with("inertia_kg_m2 1.000 σ") && d.effort[0].contains("1.20 ×"), "{d:?}");
    }

    #[test]
    fn held_parameter_without_a_standard_error_has_not_moved() {
        let mut before = answers(1, 1);
        before[0].parameters = list("cogging_N_m=2.9e-3±7.4e-7 cogging_order=1.2e1±0.000e0");
        let mut after = before.clone();
        assert!(difference(&logs(1), &before, &after).parameters.is_empty());
        after[0].parameters = list("cogging_N_m=2.9e-3±7.4e-7 cogging_order=1.3e1±0.000e0");
        assert_eq!(difference(&logs(1), &before, &after).parameters.len(), 1);
        after[0].parameters = list("cogging_N_m=2.9e-3±1.48e-6 cogging_order=1.2e1±0.000e0");
        assert!(difference(&logs(1), &before, &after).parameters[0].ends_with("cogging_N_m 1.000 σ"));
    }
}
