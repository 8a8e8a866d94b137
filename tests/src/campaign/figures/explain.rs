//! Results of `explain`: kinds of logs, effects, logs of another simulator, what is not reached.

use std::collections::BTreeMap;

use drive_model::{Domain, cards};

use super::super::case::group;
use super::super::coverage::rows::Chance;
use super::super::judge::{Judgement, covered, is_outsider, judge, upper_limit, visible};
use super::super::record::{AnswerRecord, LogRecord};
use super::super::visible::MIN_GAIN;
use super::{grouped, spread, table};
use crate::draw::MAX_PARAMETER_ERROR;

/// A log with its answer.
type Answered<'a> = (&'a LogRecord, &'a AnswerRecord);

/// Kinds of logs: title, and the groups of names that belong to it.
const KINDS: [(&str, &[&str]); 15] = [
    ("one effect", &["own"]),
    ("nothing", &["nulls"]),
    ("nothing; one more known effect", &["known"]),
    ("nothing; jittered time stamps", &["jitter:nulls", "jitter:known"]),
    ("nothing; outliers", &["outliers:nulls", "outliers:known"]),
    ("nothing; coloured noise", &["coloured:nulls", "coloured:known"]),
    ("nothing; 200 Hz, voltage at the instant", &["slow-instant:nulls", "slow-instant:known"]),
    ("nothing; 200 Hz, mean voltage", &["slow-mean:nulls", "slow-mean:known"]),
    ("nothing; encoder of 1000 counts", &["counts:nulls", "counts:known"]),
    ("a disturbance outside the catalogue", &["outsiders"]),
    ("two effects", &["pairs"]),
    ("three effects", &["triples"]),
    ("all effects: model without effects", &["empty:own"]),
    ("the same beside a disturbance outside the catalogue", &["empty:outsiders"]),
    ("logs of another simulator", &["foreign"]),
];

/// The logs that have an answer.
fn answered<'a>(logs: &'a [LogRecord], answers: &'a [AnswerRecord]) -> Vec<Answered<'a>> {
    let by_id: BTreeMap<&str, &AnswerRecord> = answers.iter().map(|a| (a.id.as_str(), a)).collect();
    logs.iter().filter_map(|log| Some((log, *by_id.get(log.id.as_str())?))).collect()
}

/// The sections on `explain`.
pub fn section(logs: &[LogRecord], answers: &[AnswerRecord]) -> String {
    let all = answered(logs, answers);
    [introduction(&all), by_kind(&all), by_effect(&all), outsiders(&all), foreign(&all), not_reached(&all), excluded(&all)].join("\n")
}

fn introduction(all: &[Answered]) -> String {
    let own = all.iter().filter(|(log, _)| group(&log.id) != "foreign").count();
    format!(
        "\
## Named effects

[`stand explain`](explaining.md) gets a log and a model, and names the effects that the model lacks. {own} logs are of this project's simulator: the firmware's own sessions of 30 s at 1 kHz, in voltage mode and under the speed loop, with three profiles of motion. The values of the user's model are wrong by up to {:.0} %.
{} logs of 30 or 40 s are of another simulator, which shares no code with this one. They are not part of this repository; `STAND_DATA` names their folder.

Definitions:

- **Verdict**: `adequate` (nothing is missing), `effect-found`, `partly-explained` (named effects, and something else is left), `unknown-structure` (something is missing that no effect of the catalogue explains), `not-finished`, `bad-log` ([explaining.md](explaining.md#verdicts)).
- **Visible**: the log can show the hidden effect. The log is simulated again without noise. The true model, and the model without the effect, are fitted to it, all other parameters and the initial states anew, with the noise of the readings as weights. The effect is visible if the difference of the two χ² is at least {MIN_GAIN}.
  That difference is the expected value of 2 Δ ln L, twice the gain in log-likelihood. Visibility does not depend on the answer.
- **Right**: all visible effects are named and no other. A named effect counts as the hidden one if both are of one family of similar effects, or if the answer states that this log does not distinguish the two. Where nothing is hidden, `adequate` is right; where the hidden disturbance is outside the catalogue, `unknown-structure`.
- **False name**: an effect is named that is not in the log. The limit is the upper 95 % confidence limit of its probability (Clopper and Pearson). **Missed**: a visible effect has no name. **False structure**: `unknown-structure` though nothing unknown is there.
- **Intervals that cover**: of the 95 % intervals of all fitted parameters, those that contain the true value, in logs whose added effects are the hidden ones. Counts outside the range that chance allows around 95 % (binomial, 99 %) are marked *too few* or *too many*. Parameters of one log are correlated, so chance allows somewhat more.
- **Pass**: unit of effort, one simulation of all rows for the values or for one derivative; the same on every machine ([explaining.md](explaining.md#effort)).
",
        100.0 * MAX_PARAMETER_ERROR,
        all.len() - own
    )
}

/// Passes of few logs one by one, of more as median / 90 % / maximum.
fn effort(of: &[Answered]) -> String {
    let passes: Vec<u64> = of.iter().map(|(_, answer)| answer.effort).collect();
    if passes.len() <= 3 { passes.into_iter().map(grouped).collect::<Vec<_>>().join(", ") } else { spread(passes).join(" / ") }
}

fn intervals(of: &[Answered]) -> String {
    let (inside, all) = covered(of.iter().map(|(_, answer)| *answer));
    if all == 0 {
        return "–".to_owned();
    }
    let mark = match Chance::of(inside, all) {
        Chance::Within => "",
        outside => &format!(", {}", outside.words()),
    };
    // A percentage of a dozen is no figure.
    let percent = if all < 100 { String::new() } else { format!(" ({:.1} %)", 100.0 * inside as f64 / all as f64) };
    format!("{inside} of {all}{percent}{mark}")
}

fn count(of: &[Answered], what: &[Judgement]) -> usize {
    of.iter().filter(|(log, answer)| what.contains(&judge(log, answer))).count()
}

fn by_kind(all: &[Answered]) -> String {
    let row = |title: &str, of: &[Answered]| {
        let named = count(of, &[Judgement::FalseName, Judgement::FalseBeside]);
        vec![
            title.to_owned(),
            of.len().to_string(),
            count(of, &[Judgement::Right]).to_string(),
            format!("{named} (< {:.0} %)", (100.0 * upper_limit(named, of.len())).ceil()),
            count(of, &[Judgement::Missed]).to_string(),
            count(of, &[Judgement::FalseStructure]).to_string(),
            count(of, &[Judgement::NotFinished]).to_string(),
            intervals(of),
            effort(of),
        ]
    };
    let of_kind = |groups: &[&str]| -> Vec<Answered> { all.iter().filter(|(log, _)| groups.contains(&group(&log.id))).copied().collect() };
    let kinds = KINDS.iter().map(|(title, groups)| (*title, of_kind(groups))).filter(|(_, of)| !of.is_empty());
    let mut rows: Vec<Vec<String>> = kinds.map(|(title, of)| row(title, &of)).collect();
    rows.push(row("**all**", all));
    let header = [
        "hidden",
        "logs",
        "right",
        "false name (limit)",
        "missed",
        "false structure",
        "not finished",
        "95 % intervals that cover",
        "passes: median / 90 % / maximum",
    ];
    format!("### By kind of log\n\n{}", table(&header, &rows))
}

/// Verdicts with their counts.
fn verdicts(of: &[Answered]) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    of.iter().for_each(|(_, answer)| *counts.entry(&answer.verdict).or_default() += 1);
    counts.iter().map(|(verdict, n)| format!("{n} `{verdict}`")).collect::<Vec<_>>().join(", ")
}

/// The logs whose only hidden effect is this one, of the clean logs of our own simulator.
fn hiding<'a>(all: &[Answered<'a>], kind: &str, effect: &str) -> Vec<Answered<'a>> {
    all.iter().filter(|(log, _)| group(&log.id) == kind && log.hidden.0 == [effect]).copied().collect()
}

fn by_effect(all: &[Answered]) -> String {
    let row = |title: String, family: &str, of: &[Answered]| {
        let seen = of.iter().filter(|(log, _)| !visible(log).is_empty()).count();
        let right = of.iter().filter(|(log, answer)| !visible(log).is_empty() && judge(log, answer) == Judgement::Right).count();
        vec![title, family.to_owned(), of.len().to_string(), seen.to_string(), right.to_string(), verdicts(of), intervals(of), effort(of)]
    };
    let mut rows = Vec::new();
    for domain in [Domain::Torque, Domain::Electrical, Domain::Measurement] {
        let mut together = Vec::new();
        for card in cards().iter().filter(|card| card.domain == domain) {
            let of = hiding(all, "own", card.id);
            if !of.is_empty() {
                rows.push(row(format!("`{}`", card.id), card.family, &of));
            }
            together.extend(of);
        }
        rows.push(row(format!("**{}**", domain.title()), "", &together));
    }
    let header = ["effect", "family", "logs", "visible", "of these right", "verdicts", "95 % intervals that cover", "passes"];
    format!(
        "### By hidden effect\n\nOne effect hidden, clean logs of this project's simulator ([effects.md](effects.md) describes the effects). Effects with the same word in the column *family* are similar. Passes of each log; in the sums median / 90 % / maximum.\n\n{}",
        table(&header, &rows)
    )
}

fn outsiders(all: &[Answered]) -> String {
    let mut by_name: BTreeMap<&str, Vec<Answered>> = BTreeMap::new();
    for one in all.iter().filter(|(log, _)| group(&log.id) == "outsiders") {
        by_name.entry(one.0.hidden.0.last().map_or("", String::as_str)).or_default().push(*one);
    }
    let beside = |of: &[Answered]| of.iter().flat_map(|(_, answer)| answer.missing.0.clone()).collect::<Vec<_>>().join(", ");
    let rows: Vec<Vec<String>> = by_name.iter().map(|(name, of)| vec![format!("`{name}`"), verdicts(of), beside(of), effort(of)]).collect();
    let header = ["disturbance", "verdicts", "named beside", "passes"];
    format!(
        "### Outside the catalogue\n\nDisturbances that no effect of the catalogue describes (`hal-sim/src/plant/outsiders`). An effect that is named beside `unknown-structure` explains a part, and the answer warns that it may stand in for something else.\n\n{}",
        table(&header, &rows)
    )
}

/// Logs of another simulator, those with the same outcome in one line.
fn foreign(all: &[Answered]) -> String {
    let mut by_outcome: BTreeMap<[String; 3], Vec<&str>> = BTreeMap::new();
    for (log, answer) in all.iter().filter(|(log, _)| group(&log.id) == "foreign") {
        let is_hidden = answer.missing == log.hidden && answer.alike.0.is_empty();
        let alike = if answer.alike.0.is_empty() { String::new() } else { format!(" (or {})", answer.alike.0.join(", ")) };
        let named = match (is_hidden, answer.missing.0.is_empty()) {
            (_, true) => "nothing".to_owned(),
            (true, _) => "the hidden effect".to_owned(),
            _ => format!("{}{alike}", answer.missing.0.join(", ")),
        };
        let is_right = if judge(log, answer) == Judgement::Right { "yes" } else { "**no**" };
        by_outcome
            .entry([format!("`{}`", answer.verdict), named, is_right.to_owned()])
            .or_default()
            .push(log.id.trim_start_matches("foreign/"));
    }
    let row = |(outcome, names): (&[String; 3], &Vec<&str>)| {
        [names.join(", "), outcome[0].clone(), outcome[1].clone(), outcome[2].clone()].to_vec()
    };
    let rows: Vec<Vec<String>> = by_outcome.iter().map(row).collect();
    format!(
        "### Logs of another simulator\n\nThe name of a log states what is hidden in it.\n\n{}",
        table(&["logs", "verdict", "named (not distinguishable)", "right"], &rows)
    )
}

fn not_reached(all: &[Answered]) -> String {
    let wrong = all.iter().filter(|(log, answer)| judge(log, answer) != Judgement::Right);
    let rows: Vec<Vec<String>> = wrong
        .map(|(log, answer)| {
            let hidden = if is_outsider(log) { log.hidden.0.join(", ") } else { visible(log).join(", ") };
            vec![
                format!("`{}`", log.id),
                hidden,
                format!("`{}`", answer.verdict),
                answer.missing.0.join(", "),
                judge(log, answer).words().to_owned(),
            ]
        })
        .collect();
    format!(
        "### Not reached\n\nEach log with a wrong answer.\n\n{}",
        table(&["log", "visible effects", "verdict", "named", "error"], &rows)
    )
}

fn excluded(all: &[Answered]) -> String {
    let mut lines = String::new();
    for (log, _) in all.iter().filter(|(log, _)| visible(log).len() < log.expected_gain.0.len()) {
        let unseen: Vec<String> = log
            .expected_gain
            .numbers()
            .filter(|(_, gain)| *gain < MIN_GAIN)
            .map(|(name, gain)| format!("`{name}` ({:.0})", gain + 0.0))
            .collect();
        lines += &format!("- `{}`: {}\n", log.id, unseen.join(", "));
    }
    format!(
        "### Excluded\n\nHidden effects that their log cannot show; in brackets the expected 2 Δ ln L. Not to name them is no error.\n\n{lines}"
    )
}
