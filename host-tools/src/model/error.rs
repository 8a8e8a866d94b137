//! What can be wrong with a model, in one line: file, position, key, and what to do.

use std::fmt;
use std::ops::Range;

/// A model that cannot be used.
#[derive(Debug)]
pub struct ModelError {
    /// The file, as it was called.
    pub file: String,
    /// Line and column, counted from 1, where the text shows it.
    pub position: Option<(usize, usize)>,
    /// The key, e.g. `[parameters] cogging_N_m`; empty where the whole file is meant.
    pub key: String,
    /// What is wrong.
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
        // The TOML reader's own words, and keys of a broken file, may hold line breaks.
        write!(f, ": {}", self.kind.to_string().replace(['\n', '\r'], " "))
    }
}

impl std::error::Error for ModelError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.kind.source()
    }
}

/// What is wrong.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ModelErrorKind {
    /// The file cannot be opened or read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file cannot be written.
    #[error("cannot be written: {0}")]
    Write(#[source] std::io::Error),
    /// No TOML.
    #[error("this is not TOML: {0}")]
    Toml(String),
    /// No `[drive]`, or no `input`.
    #[error("{0} is missing; a model begins with: [drive] input = \"u_V\"")]
    Missing(&'static str),
    /// A value of the wrong kind.
    #[error("here should be {0}")]
    Wants(&'static str),
    /// A name that is unknown.
    #[error("unknown {what} '{name}'{}", did_you_mean(near, known))]
    Unknown {
        /// What kind of name.
        what: &'static str,
        /// The name.
        name: String,
        /// The nearest known one.
        near: Option<String>,
        /// Where the known ones are told.
        known: String,
    },
    /// An output that the input does not allow.
    #[error("'{output}' cannot be compared when the input is {input}; possible are {possible}")]
    Output {
        /// The output.
        output: &'static str,
        /// The input.
        input: &'static str,
        /// What could be compared.
        possible: String,
    },
    /// Something twice.
    #[error("{what} '{name}' stands here twice{hint}")]
    Twice {
        /// What kind of name.
        what: &'static str,
        /// The name.
        name: String,
        /// What to do.
        hint: String,
    },
    /// `cogging#1`, `cogging#x`.
    #[error("'{0}' is no name of an effect: a second one is written '{1}#2'")]
    Mark(String, String),
    /// A structural effect with a `#`.
    #[error("'{0}' changes the structure of the drive and cannot repeat")]
    NoRepeat(&'static str),
    /// Compliance with backlash.
    #[error("'{0}' and '{1}' are rivals, not a sequel: both are the shaft; keep one")]
    Rivals(&'static str, &'static str),
    /// A base parameter that the input needs.
    #[error("'{name}' is missing in [parameters], and with input {input} the model needs it; for instance {name} = {example}")]
    Needed {
        /// The parameter.
        name: &'static str,
        /// The input.
        input: &'static str,
        /// A value of the default stand.
        example: String,
    },
    /// A parameter that belongs to no listed effect.
    #[error("no listed effect has the parameter '{name}'{hint}")]
    Unused {
        /// The parameter.
        name: String,
        /// What to do.
        hint: String,
    },
    /// A value that physics does not have.
    #[error("{value} is outside the physical range {range}")]
    Range {
        /// The value.
        value: f64,
        /// The range with its unit.
        range: String,
    },
    /// An order that is not whole.
    #[error("{0} is no whole number: an order counts periods per turn")]
    NotWhole(f64),
    /// NaN or infinity.
    #[error("{0} is not a finite number")]
    NotFinite(f64),
    /// An own effect without expression, or with several.
    #[error(
        "an effect of your own has one of torque_N_m, dry_N_m, voltage_V, omega_rad_s, theta_rad, i_A = \"expression\"; this one has {0}"
    )]
    Expressions(usize),
    /// An expression that cannot be read.
    #[error("{0}")]
    Expression(#[source] crate::model::expression::ExpressionError),
    /// A parameter name that an expression cannot use.
    #[error("'{0}' cannot name a parameter: a letter, then letters, digits, underscores, and none of t theta omega i u T pi or a function")]
    ParameterName(String),
    /// A parameter of an own effect that its expression lacks.
    #[error("the expression does not use the parameter '{0}': a fit could not find it")]
    ParameterUnused(String),
    /// A catalogue name for an own effect.
    #[error("'{0}' is an effect of the catalogue: give your own another name, or list it in [drive] effects and give only parameters here")]
    Taken(String),
    /// An edit that does not fit.
    #[error("the model has no {what} '{name}'{}", did_you_mean(near, known))]
    Absent {
        /// What kind of name.
        what: &'static str,
        /// The name.
        name: String,
        /// The nearest that it has.
        near: Option<String>,
        /// What it has.
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
