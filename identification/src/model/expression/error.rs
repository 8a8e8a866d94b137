//! Errors of an expression: one line with its column.

/// An invalid expression. Columns count characters from 1.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// The text is empty.
    #[error("the expression is empty")]
    Empty,
    /// A name that is neither a variable nor a parameter.
    #[error(
        "unknown name '{name}' at column {column}{}",
        hint(near, "known names: t theta omega i u T pi and the parameters of the effect")
    )]
    UnknownName {
        /// The name.
        name: String,
        /// Its column.
        column: usize,
        /// The nearest known name.
        near: Option<String>,
    },
    /// A name with brackets that is not a function.
    #[error("unknown function '{name}' at column {column}{}", hint(near, "known functions: sin cos tan exp ln sqrt abs tanh and others"))]
    UnknownFunction {
        /// The name.
        name: String,
        /// Its column.
        column: usize,
        /// The nearest known function.
        near: Option<String>,
    },
    /// A function without its brackets.
    #[error("'{name}' at column {column} is a function: write {name}(…)")]
    NoArguments {
        /// The function.
        name: String,
        /// Its column.
        column: usize,
    },
    /// Too many or too few arguments.
    #[error("'{name}' at column {column} takes {wants} argument{}, not {has}", if *wants == 1 { "" } else { "s" })]
    Arguments {
        /// The function.
        name: String,
        /// Its column.
        column: usize,
        /// Arguments of the function.
        wants: usize,
        /// Arguments in the text.
        has: usize,
    },
    /// An unexpected token.
    #[error("unexpected '{word}' at column {column}; expected {wants}")]
    Unexpected {
        /// The token.
        word: String,
        /// Its column.
        column: usize,
        /// Expected tokens.
        wants: &'static str,
    },
    /// The text ends too early.
    #[error("the expression ends too early; expected {wants}")]
    Ends {
        /// Expected tokens.
        wants: &'static str,
    },
    /// An invalid number.
    #[error("'{word}' at column {column} is not a number")]
    Number {
        /// The token.
        word: String,
        /// Its column.
        column: usize,
    },
    /// Nesting or length above the limit.
    #[error("the expression is too deeply nested or too long at column {column}; split it into several effects")]
    TooDeep {
        /// Column at which the limit was exceeded.
        column: usize,
    },
}

fn hint(near: &Option<String>, otherwise: &str) -> String {
    match near {
        Some(near) => format!("; did you mean '{near}'?"),
        None => format!("; {otherwise}"),
    }
}
