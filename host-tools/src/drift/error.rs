//! Why there is no drift to tell, in one line.

/// What is wrong with the input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum DriftError {
    /// A number that makes no sense.
    #[error("{name} = {value}: must be {range}")]
    Number {
        /// Its name, as a person gave it.
        name: String,
        /// What was given.
        value: f64,
        /// What it may be.
        range: String,
    },
    /// The azimuth has no meaning at the poles.
    #[error("--latitude {0}: at a pole the Earth's rotation has no horizontal part, so there is no azimuth to be found")]
    Pole(f64),
    /// A column is missing.
    #[error("{log}: no column `{column}`: the drift needs the angle sensor's voltage and the torquer's current")]
    Column {
        /// The log.
        log: String,
        /// The column.
        column: String,
    },
    /// A note is missing, and no option says it.
    #[error("{log}: no note `{note}`, and no {option} says it")]
    Note {
        /// The log.
        log: String,
        /// The note.
        note: &'static str,
        /// The option.
        option: &'static str,
    },
    /// A note is no number.
    #[error("{log}: note `{note}`: `{text}` is no number")]
    NoteText {
        /// The log.
        log: String,
        /// The note.
        note: String,
        /// What it says.
        text: String,
    },
    /// No cycles in it.
    #[error("{log}: no cycle of two pulses of {pulse_s} s is in it{why}")]
    NoCycle {
        /// The log.
        log: String,
        /// The pulses' duration.
        pulse_s: f64,
        /// What may be the reason.
        why: String,
    },
    /// Every cycle is bad.
    #[error("{log}: none of the {count} cycles is good: {reason}")]
    AllBad {
        /// The log.
        log: String,
        /// How many.
        count: usize,
        /// Of the first.
        reason: String,
    },
    /// All in one position.
    #[error(
        "no turn: all good cycles are in one position ({position}), and own and apparent drift are told apart by a second one, 180° from it"
    )]
    NoTurn {
        /// Which.
        position: String,
    },
    /// These positions do not tell all that is asked apart.
    #[error("these positions do not tell {what} apart: {hint}")]
    Positions {
        /// What.
        what: String,
        /// What to do.
        hint: String,
    },
    /// A log too short for what is asked.
    #[error("{log}: {says}")]
    Log {
        /// The log.
        log: String,
        /// What is wrong.
        says: String,
    },
}

/// A number within its range.
pub fn within(name: &str, value: f64, least: f64, most: f64) -> Result<f64, DriftError> {
    if value.is_finite() && (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(DriftError::Number { name: name.to_owned(), value, range: format!("a number from {least} to {most}") })
    }
}
