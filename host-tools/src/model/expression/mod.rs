//! Expressions of the user's own effects, as they stand in the model file: `-a * tanh(omega / w0) * (1 + m * sin(theta))`.
//!
//! In: text, and the names of the effect's own parameters. Out: an [`Expression`], parsed once, evaluated for any [`Scalar`]: `f64`, or a
//! dual number whose first derivatives are exact. It knows `t theta omega i u T pi`, the operators `+ - * / ^`, the comparisons
//! `< <= > >=` (1 or 0), and the functions of [`functions`]. Evaluation allocates nothing and never panics; where a derivative is
//! infinite or has no direction (sqrt and pow at zero) it is taken as zero, so that a fit at rest stays finite.
//!
//! Not exmex: an expression of it is parsed for one number type, which must itself be readable from text; dual numbers are not.

mod error;
mod eval;
mod node;
mod parse;
mod print;

use drive_model::Scalar;

pub use error::ExpressionError;
use node::{Node, Variable};

/// The values that an expression sees at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variables<S> {
    /// `t`: time, s.
    pub t: S,
    /// `theta`: platform angle, rad.
    pub theta: S,
    /// `omega`: rate, rad/s.
    pub omega: S,
    /// `i`: motor current, A.
    pub i: S,
    /// `u`: voltage asked for, V.
    pub u: S,
    /// `T`: winding temperature, °C.
    pub temp_C: S,
}

/// An expression, ready to be evaluated. Its text, printed, reads back as the same expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Children before parents; the last is the whole.
    nodes: Vec<Node>,
    parameters: Vec<String>,
}

impl Expression {
    /// Reads `text`; `parameters` are the names that it may use besides the variables.
    ///
    /// # Errors
    /// One line with the column and the word; for a name that is unknown, the nearest that is known.
    pub fn parse(text: &str, parameters: &[String]) -> Result<Expression, ExpressionError> {
        Ok(Expression { nodes: parse::parse(text, parameters)?, parameters: parameters.to_vec() })
    }

    /// The value at `env`; `parameters` in the order given to [`Expression::parse`] (a missing one counts as zero).
    #[inline]
    pub fn eval<S: Scalar>(&self, env: &Variables<S>, parameters: &[S]) -> S {
        eval::eval(&self.nodes, env, parameters)
    }

    /// Names of the parameters, in the order in which [`Expression::eval`] takes them.
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// The parameter of that index occurs.
    pub fn uses_parameter(&self, index: usize) -> bool {
        self.nodes.iter().any(|n| matches!(n, Node::Parameter(k) if usize::from(*k) == index))
    }

    /// `t` occurs.
    pub fn uses_t(&self) -> bool {
        self.uses(Variable::Time)
    }

    /// `theta` occurs.
    pub fn uses_theta(&self) -> bool {
        self.uses(Variable::Theta)
    }

    /// `omega` occurs.
    pub fn uses_omega(&self) -> bool {
        self.uses(Variable::Omega)
    }

    /// `i` occurs.
    pub fn uses_i(&self) -> bool {
        self.uses(Variable::Current)
    }

    /// `u` occurs.
    pub fn uses_u(&self) -> bool {
        self.uses(Variable::Voltage)
    }

    /// `T` occurs.
    pub fn uses_temp(&self) -> bool {
        self.uses(Variable::Temperature)
    }

    fn uses(&self, variable: Variable) -> bool {
        self.nodes.contains(&Node::Variable(variable))
    }
}

impl std::fmt::Display for Expression {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&print::text(&self.nodes, &self.parameters))
    }
}

/// Names of the functions that an expression knows, with the number of their arguments.
pub fn functions() -> impl Iterator<Item = (&'static str, usize)> {
    let one = node::Function::ALL.iter().map(|f| (f.name(), 1));
    one.chain(node::Pair::FUNCTIONS.iter().map(|f| (f.name(), 2))).chain([("if", 3)])
}

/// The name means something in every expression, so that no parameter may bear it.
pub fn is_reserved(name: &str) -> bool {
    name == "pi" || Variable::of(name).is_some() || functions().any(|(f, _)| f == name)
}

/// The name can stand in an expression: a letter or underscore, then letters, digits, underscores.
pub fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_') && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests;
