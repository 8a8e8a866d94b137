//! Plausibility before physics (interfaces.md): is this log what its columns say, before any model is fitted?
//!
//! In: a [`Log`] and the column that drives the model. Out: [`Finding`]s in words, none where the log is sound. Looked at: whether
//! anything moved and the input changed; whether columns lost their decimals; the slope between dθ/dt and ω (sign, unit, swapped
//! columns); whether voltage and current drive the rotor the way it turns. Physics of the catalogue — a late, bent or biased rate
//! channel, an encoder off its centre, friction, cogging — is no finding: a verdict `bad-log` must be beyond doubt.

mod drive;
mod regress;
mod slope;
mod still;
mod windows;

use crate::log::Log;

/// What is wrong with a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Code {
    /// The model's input is no column of the log.
    MissingInput,
    /// The input never changes.
    ConstantInput,
    /// A measured channel never changes while others do.
    ConstantChannel,
    /// Nothing turns.
    NoMotion,
    /// A measured channel has whole numbers only.
    WholeNumbers,
    /// Two channels disagree in sign.
    WrongSign,
    /// Two channels differ by a factor that belongs to a unit.
    WrongUnit,
    /// dθ/dt and ω differ by another factor, or do not belong together.
    RateDisagrees,
    /// Two columns seem to be exchanged.
    Swapped,
    /// Voltage or current drives backwards.
    NegativeMotorConstant,
}

impl Code {
    /// Name in the answers.
    pub fn name(self) -> &'static str {
        match self {
            Code::MissingInput => "missing-input",
            Code::ConstantInput => "constant-input",
            Code::ConstantChannel => "constant-channel",
            Code::NoMotion => "no-motion",
            Code::WholeNumbers => "whole-numbers",
            Code::WrongSign => "wrong-sign",
            Code::WrongUnit => "wrong-unit",
            Code::RateDisagrees => "rate-disagrees",
            Code::Swapped => "swapped",
            Code::NegativeMotorConstant => "negative-motor-constant",
        }
    }
}

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What kind.
    pub code: Code,
    /// One sentence for the person: what is seen, and what it may be.
    pub says: String,
    /// The columns that it is about.
    pub columns: Vec<&'static str>,
}

impl Finding {
    fn new(code: Code, columns: &[&'static str], says: impl Into<String>) -> Self {
        Finding { code, says: says.into(), columns: columns.to_vec() }
    }
}

/// The fault that ended a log before its time, by its note: `overspeed at 0.2 s`. A stand's own words are number, name and what to do.
pub fn fault_that_ended(log: &Log) -> Option<String> {
    let note = log.note("fault")?;
    let note = note.strip_suffix("; the rows end there").unwrap_or(note);
    let (says, at) = note.rsplit_once(" at ").map_or((note, String::new()), |(says, at)| (says, format!(" at {at}")));
    let mut words = says.splitn(3, ',');
    let name = match (words.next(), words.next()) {
        (Some(number), Some(name)) if number.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => says,
    };
    (!name.is_empty()).then(|| format!("{name}{at}"))
}

/// What is wrong with `log` as the record of a drive whose input is the column `input`; most basic first, empty where it is sound.
///
/// Work is one pass per test over the rows; memory is a few numbers per tenth of a second.
pub fn check(log: &Log, input: &str) -> Vec<Finding> {
    let findings = still::check(log, input);
    // Of a log that does not move the rest would be nonsense.
    if findings.iter().any(|f| f.code != Code::WholeNumbers) {
        return findings;
    }
    let signs = slope::check(log).or_else(|| drive::check(log));
    match signs {
        // A voltage of whole steps under the current's name.
        Some(swapped) if swapped.code == Code::Swapped => vec![swapped],
        signs if findings.is_empty() => signs.into_iter().collect(),
        _ => findings,
    }
}

#[cfg(test)]
mod tests;
