//! The logs of the campaigns are frozen: their SHA-256 is committed, and a changed log is reported, not compared.

use identification::log::Log;
use stand_tests::campaign::case::Case;
use stand_tests::campaign::compare::difference;
use stand_tests::campaign::record::{AnswerRecord, LogRecord, baselines, read};

fn committed<R: serde::de::DeserializeOwned>(name: &str) -> Vec<R> {
    read(&baselines().join(name)).expect("a committed file")
}

/// A log of each kind that the simulator makes. After a change of the simulator: `campaign logs`, then `campaign explain` with the old and
/// the new program.
#[test]
fn simulator_makes_the_frozen_logs() {
    let logs: Vec<LogRecord> = committed("explain-daily-logs.csv");
    for kind in [
        "own/",
        "nulls/",
        "known/",
        "jitter:",
        "outliers:",
        "coloured:",
        "slow-instant:",
        "slow-mean:",
        "counts:",
        "outsiders/",
        "several/2",
        "several/3",
        "empty:",
    ] {
        let log = logs.iter().find(|log| log.id.starts_with(kind)).expect("a log of each kind");
        let case = Case::by_name(&log.id, None).expect("the name of a log");
        assert_eq!(case.sha256(), log.sha256, "{}: the simulator makes another log, or the model is another one", log.id);
    }
}

#[test]
fn a_changed_log_is_reported_and_not_compared() {
    let (logs, answers): (Vec<LogRecord>, Vec<AnswerRecord>) = (committed("explain-daily-logs.csv"), committed("explain-daily.csv"));
    let id = &logs[0].id;
    let accepted = answers.iter().find(|answer| answer.id == *id).expect("an accepted answer").clone();
    let mut case = Case::by_name(id, None).expect("the name of a log");
    let answer_of = |case: &Case| AnswerRecord { sha256: case.sha256(), verdict: "adequate".to_owned(), ..accepted.clone() };
    let d = difference(&logs, &answers, &[answer_of(&case)]);
    assert_eq!((d.other_logs.len(), d.answers.len()), (0, 1), "{}", d.text);
    // One value by the least that it can change.
    let mut columns = case.log.columns().to_vec();
    let value = columns.last_mut().and_then(|column| column.values.last_mut()).expect("a value");
    *value = f64::from_bits(value.to_bits() ^ 1);
    case.log = Log::new(case.log.path(), columns, case.log.notes().clone()).expect("a log");
    let d = difference(&logs, &answers, &[answer_of(&case)]);
    assert_eq!((d.other_logs.as_slice(), d.answers.len()), ([id.clone()].as_slice(), 0), "{}", d.text);
    assert!(!d.is_empty());
}
