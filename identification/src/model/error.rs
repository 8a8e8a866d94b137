//! Errors of a model: one line with file, position, key, and remedy.

use std::fmt;
use std::ops::Range;

/// An invalid model.
#[derive(Debug)]
pub struct ModelError {
    /// Name of the file.
    pub file: String,
    /// Line and column, counted from 1, if the error has a position.
    pub position: Option<(usize, usize)>,
    /// The key, e.g. `[parameters] cogging_N_m`; empty for the whole file.
    pub key: String,
    /// The error.
    pub kind: Box<ModelErrorKind>,
}

impl ModelError {
    pub(super) fn file(file: &str, kind: ModelErrorKind) -> Self {
        ModelError { file: file.to_owned(), position: None, key: String::new(), kind: Box::new(kind) }
    }

    pub(super) fn at(file: &str, text: &str, span: Option<Range<usize>>, key: &str, kind: ModelErrorKind) -> Self {
        let position = span.and_then(|span| {
            let before = text.get(..span.start)?;
            let line_begin = before.rfind('\n').map_or(0, |k| k + 1);
            Some((before.matches('\n').count() + 1, before[line_begin..].chars().count() + 1))
        });
        ModelError { file: file.to_owned(), position, key: key.to_owned(), kind: Box::new(kind) }
    }
}

impl fmt::Display for ModelError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file)?;
        if let Some((line, column)) = self.position {
            write!(f, ": line {line}, column {column}")?;
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key.escape_debug())?;
        }
        // Messages of the TOML parser and keys of a damaged file may contain line breaks.
        write!(f, ": {}", self.kind.to_string().replace(['\n', '\r'], " "))
    }
}

impl std::error::Error for ModelError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.kind.source()
    }
}

/// Kind of a model error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelErrorKind {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file cannot be written.
    #[error("cannot be written: {0}")]
    Write(#[source] std::io::Error),
    /// The file is not TOML.
    #[error("not TOML: {0}")]
    Toml(String),
    /// No `[drive]`, or no `input`.
    #[error("{0} is missing; a model file begins with: [drive] input = \"u_V\"")]
    Missing(&'static str),
    /// A value of the wrong type.
    #[error("expected {0}")]
    Wants(&'static str),
    /// An unknown name.
    #[error("unknown {what} '{name}'{}", did_you_mean(near, known))]
    Unknown {
        /// Kind of the name.
        what: &'static str,
        /// The name.
        name: String,
        /// The nearest known name.
        near: Option<String>,
        /// The known names, or where they are listed.
        known: String,
    },
    /// An output that the input does not allow.
    #[error("'{output}' is not an output for the input {input}; valid outputs: {possible}")]
    Output {
        /// The output.
        output: &'static str,
        /// The input.
        input: &'static str,
        /// Valid outputs.
        possible: String,
    },
    /// A duplicate.
    #[error("{what} '{name}' is listed twice{hint}")]
    Twice {
        /// Kind of the name.
        what: &'static str,
        /// The name.
        name: String,
        /// Remedy.
        hint: String,
    },
    /// `cogging#1`, `cogging#x`.
    #[error("'{0}' is not the name of an effect; write '{1}#2' for a second instance")]
    Mark(String, String),
    /// A second instance of a structural effect.
    #[error("'{0}' changes the structure of the drive and cannot have a second instance")]
    NoRepeat(&'static str),
    /// Two effects that exclude each other.
    #[error("'{0}' and '{1}' exclude each other: both describe the shaft; keep one")]
    Rivals(&'static str, &'static str),
    /// A base parameter that the input needs.
    #[error("'{name}' is missing in [parameters]; a model with input {input} needs it, e.g. {name} = {example}")]
    Needed {
        /// The parameter.
        name: String,
        /// The input.
        input: &'static str,
        /// A value of the default stand.
        example: String,
    },
    /// A parameter of a rotary drive in the model of a linear one.
    #[error("'{name}' is a parameter of a rotary drive; this model has a linear axis: {linear}")]
    OtherAxis {
        /// The name.
        name: String,
        /// The name on a linear axis.
        linear: String,
    },
    /// A parameter that belongs to no listed effect.
    #[error("no effect of the model has the parameter '{name}'{hint}")]
    Unused {
        /// The parameter.
        name: String,
        /// Remedy.
        hint: String,
    },
    /// A value outside the physical range.
    #[error("{value} is outside the physical range {range}")]
    Range {
        /// The value.
        value: f64,
        /// The range with its unit.
        range: String,
    },
    /// A harmonic order that is not a whole number.
    #[error("{0} is not a whole number; a harmonic order is a number of periods per turn")]
    NotWhole(f64),
    /// NaN or infinity.
    #[error("{0} is not a finite number")]
    NotFinite(f64),
    /// A user effect without an expression, or with several.
    #[error(
        "a user effect needs exactly one of torque_N_m, dry_N_m, voltage_V, omega_rad_s, theta_rad, i_A = \"expression\"; this effect has {0}"
    )]
    Expressions(usize),
    /// An invalid expression.
    #[error("{0}")]
    Expression(#[source] crate::model::expression::ExpressionError),
    /// An invalid parameter name.
    #[error(
        "'{0}' is not a valid parameter name: use a letter, then letters, digits or underscores; t theta omega i u T pi and function names are reserved"
    )]
    ParameterName(String),
    /// A parameter of a user effect that its expression does not use.
    #[error("the expression does not use the parameter '{0}', so a fit cannot estimate it")]
    ParameterUnused(String),
    /// A user effect with a name of the catalogue.
    #[error("'{0}' is an effect of the catalogue; rename the user effect, or add '{0}' to [drive] effects and list only parameters here")]
    Taken(String),
    /// A name that the model does not have.
    #[error("the model has no {what} '{name}'{}", did_you_mean(near, known))]
    Absent {
        /// Kind of the name.
        what: &'static str,
        /// The name.
        name: String,
        /// The nearest name of the model.
        near: Option<String>,
        /// Names of the model.
        known: String,
    },
}

fn did_you_mean(near: &Option<String>, known: &str) -> String {
    match near {
        Some(near) => format!("; did you mean '{near}'?"),
        None if known.is_empty() => String::new(),
        None => format!("; {known}"),
    }
}
