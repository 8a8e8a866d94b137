//! What can be wrong with an expression, in one line with its column.

/// An expression that cannot be read. Columns count characters from 1.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// Nothing in it.
    #[error("the expression is empty")]
    Empty,
    /// A name that is neither variable nor parameter.
    #[error("unknown name '{name}' at column {column}{}", hint(near, "known are t theta omega i u T pi and the effect's own parameters"))]
    UnknownName {
        /// The name.
        name: String,
        /// Where it begins.
        column: usize,
        /// The nearest known name.
        near: Option<String>,
    },
    /// A name with brackets that is no function.
    #[error("unknown function '{name}' at column {column}{}", hint(near, "known are sin cos tan exp ln sqrt abs tanh and the like"))]
    UnknownFunction {
        /// The name.
        name: String,
        /// Where it begins.
        column: usize,
        /// The nearest known function.
        near: Option<String>,
    },
    /// A function without its brackets.
    #[error("'{name}' at column {column} is a function: write {name}(…)")]
    NoArguments {
        /// The function.
        name: String,
        /// Where it begins.
        column: usize,
    },
    /// Too many or too few arguments.
    #[error("'{name}' at column {column} takes {wants} argument{}, not {has}", if *wants == 1 { "" } else { "s" })]
    Arguments {
        /// The function.
        name: String,
        /// Where it begins.
        column: usize,
        /// Arguments it takes.
        wants: usize,
        /// Arguments found.
        has: usize,
    },
    /// Something else stands where a value or an operator should.
    #[error("'{word}' at column {column} where {wants} should be")]
    Unexpected {
        /// What stands there.
        word: String,
        /// Where.
        column: usize,
        /// What should stand there.
        wants: &'static str,
    },
    /// The text ends too early.
    #[error("the expression ends where {wants} should be")]
    Ends {
        /// What should follow.
        wants: &'static str,
    },
    /// A number that is none.
    #[error("'{word}' at column {column} is not a number")]
    Number {
        /// The word.
        word: String,
        /// Where.
        column: usize,
    },
    /// Too many brackets in each other, or too long.
    #[error("the expression is nested too deeply at column {column}: write it as the sum of several effects")]
    TooDeep {
        /// Where it became too much.
        column: usize,
    },
}

fn hint(near: &Option<String>, otherwise: &str) -> String {
    match near {
        Some(near) => format!("; did you mean '{near}'?"),
        None => format!("; {otherwise}"),
    }
}
