//! Right or wrong, from an answer and what the generator made; exact limits and tests.

use drive_model::cards;
use statrs::distribution::{Beta, Binomial, ContinuousCDF, DiscreteCDF};

use super::case::group;
use super::record::{AnswerRecord, LogRecord};
use super::visible::MIN_GAIN;
use crate::TWO_SIDED_95;

/// How an answer is judged, the best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Judgement {
    /// All visible effects are named and no effect that is not there; nothing hidden: adequate; outside the catalogue: `unknown-structure`.
    Right,
    /// The search was not finished.
    NotFinished,
    /// A visible effect has no name.
    Missed,
    /// Structure is reported where there is none.
    FalseStructure,
    /// An effect that is not there is named beside right ones, or as `partly-explained`.
    FalseBeside,
    /// An effect that is not there is named, as `effect-found`.
    FalseName,
}

impl Judgement {
    /// Words of a table.
    pub fn words(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::NotFinished => "not finished",
            Self::Missed => "missed",
            Self::FalseStructure => "false structure",
            Self::FalseBeside => "false name beside",
            Self::FalseName => "false name",
        }
    }
}

/// `cogging` of `cogging#2`.
pub fn stem(name: &str) -> &str {
    name.split('#').next().unwrap_or(name)
}

/// True if both effects are of one family.
pub fn same_family(a: &str, b: &str) -> bool {
    let family = |id: &str| drive_model::card(stem(id)).map_or("", |c| c.family);
    stem(a) == stem(b) || (!family(a).is_empty() && family(a) == family(b))
}

/// A hidden effect stands for a named one: it is that effect, of its family, or not distinguishable from the first one in this log.
fn explains_name(hidden: &str, name: &str, k: usize, answer: &AnswerRecord) -> bool {
    same_family(hidden, name) || (k == 0 && answer.alike.0.iter().any(|alike| same_family(alike, hidden)))
}

/// Names that no hidden effect stands for.
pub fn false_names<'a>(log: &LogRecord, answer: &'a AnswerRecord) -> Vec<&'a str> {
    let is_false = |(k, name): &(usize, &String)| !log.hidden.0.iter().any(|hidden| explains_name(hidden, name, *k, answer));
    answer.missing.0.iter().enumerate().filter(is_false).map(|(_, name)| name.as_str()).collect()
}

/// The visible effects of a log, by the generator.
pub fn visible(log: &LogRecord) -> Vec<&str> {
    log.expected_gain.numbers().filter(|(_, gain)| *gain >= MIN_GAIN).map(|(name, _)| name).collect()
}

/// The hidden thing is not in the catalogue.
pub fn is_outsider(log: &LogRecord) -> bool {
    log.hidden.0.iter().any(|hidden| !cards().iter().any(|card| card.id == stem(hidden)))
}

/// Judges an answer.
pub fn judge(log: &LogRecord, answer: &AnswerRecord) -> Judgement {
    let found = answer.verdict == "effect-found";
    if is_outsider(log) {
        // Beside an outsider that hides in a model without effects, the effects of the stand are right names.
        return match (answer.verdict.as_str(), false_names(log, answer).is_empty()) {
            ("unknown-structure", _) => Judgement::Right,
            ("not-finished", _) => Judgement::NotFinished,
            ("adequate" | "bad-log" | "error", _) => Judgement::Missed,
            (_, false) if found => Judgement::FalseName,
            (_, false) => Judgement::FalseBeside,
            _ if found => Judgement::Missed,
            _ => Judgement::Right,
        };
    }
    let wrong = false_names(log, answer);
    let seen = visible(log);
    let missed = seen.iter().any(|hidden| !answer.missing.0.iter().enumerate().any(|(k, name)| explains_name(hidden, name, k, answer)));
    if !wrong.is_empty() {
        let all_wrong = wrong.len() == answer.missing.0.len();
        return if found && all_wrong { Judgement::FalseName } else { Judgement::FalseBeside };
    }
    match answer.verdict.as_str() {
        "not-finished" => Judgement::NotFinished,
        _ if missed => Judgement::Missed,
        "unknown-structure" | "bad-log" | "error" => Judgement::FalseStructure,
        _ => Judgement::Right,
    }
}

/// Parameters of added effects and of all, whose 95 % interval contains the truth, of how many.
pub fn covered<'a>(answers: impl Iterator<Item = &'a AnswerRecord>) -> (usize, usize) {
    let deviations: Vec<f64> = answers.flat_map(|a| a.deviations.numbers().map(|(_, off)| off).collect::<Vec<_>>()).collect();
    (deviations.iter().filter(|off| off.abs() < TWO_SIDED_95).count(), deviations.len())
}

/// Upper 95 % limit of a probability of which `count` of `of` cases occurred (Clopper and Pearson, Biometrika 26 (1934) 404).
pub fn upper_limit(count: usize, of: usize) -> f64 {
    if count >= of {
        return 1.0;
    }
    Beta::new(count as f64 + 1.0, (of - count) as f64).map_or(1.0, |beta| beta.inverse_cdf(0.95))
}

/// Two-sided exact p of McNemar's test (Psychometrika 12 (1947) 153): of the logs in which two programs differ, each is right in one half,
/// if they are equally good.
pub fn mcnemar(first_alone: usize, second_alone: usize) -> f64 {
    let (few, all) = (first_alone.min(second_alone) as u64, (first_alone + second_alone) as u64);
    Binomial::new(0.5, all).map_or(1.0, |half| (2.0 * half.cdf(few)).min(1.0))
}

/// The groups of a set in the order of its logs.
pub fn groups<'a>(logs: impl Iterator<Item = &'a LogRecord>) -> Vec<&'a str> {
    let mut groups = Vec::new();
    for log in logs {
        let group = group(&log.id);
        if !groups.contains(&group) {
            groups.push(group);
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::super::record::List;
    use super::*;

    fn list(text: &str) -> List {
        List(text.split_whitespace().map(str::to_owned).collect())
    }

    fn judged(hidden: &str, gains: &str, verdict: &str, missing: &str, alike: &str) -> Judgement {
        let log = LogRecord { id: "own/x".to_owned(), sha256: String::new(), hidden: list(hidden), expected_gain: list(gains) };
        let answer = AnswerRecord { verdict: verdict.to_owned(), missing: list(missing), alike: list(alike), ..AnswerRecord::default() };
        judge(&log, &answer)
    }

    #[test]
    fn nothing_hidden() {
        assert_eq!(judged("", "", "adequate", "", ""), Judgement::Right);
        assert_eq!(judged("", "", "unknown-structure", "", ""), Judgement::FalseStructure);
        assert_eq!(judged("", "", "effect-found", "cogging", ""), Judgement::FalseName);
        assert_eq!(judged("", "", "partly-explained", "cogging", ""), Judgement::FalseBeside);
        assert_eq!(judged("", "", "not-finished", "", ""), Judgement::NotFinished);
    }

    #[test]
    fn one_hidden() {
        assert_eq!(judged("cogging", "cogging=900", "effect-found", "cogging", ""), Judgement::Right);
        assert_eq!(judged("cogging", "cogging=900", "effect-found", "torque-ripple", "cogging"), Judgement::Right, "not distinguishable");
        assert_eq!(judged("cogging", "cogging=900", "adequate", "", ""), Judgement::Missed);
        assert_eq!(judged("cogging", "cogging=20", "adequate", "", ""), Judgement::Right);
        assert_eq!(judged("cogging", "cogging=900", "effect-found", "cogging load", ""), Judgement::FalseBeside);
        assert_eq!(judged("cogging", "cogging=900", "effect-found", "backlash", ""), Judgement::FalseName);
        assert_eq!(judged("cogging", "cogging=900", "unknown-structure", "", ""), Judgement::Missed);
    }

    #[test]
    fn outside_the_catalogue() {
        assert_eq!(judged("sector-rub", "", "unknown-structure", "", ""), Judgement::Right);
        assert_eq!(judged("sector-rub", "", "effect-found", "cogging", ""), Judgement::FalseName);
        assert_eq!(judged("sector-rub", "", "adequate", "", ""), Judgement::Missed);
        assert_eq!(judged("sector-rub", "", "bad-log", "", ""), Judgement::Missed);
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
