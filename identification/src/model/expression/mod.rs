//! Expressions of user effects in the model file, e.g. `-a * tanh(omega / w0) * (1 + m * sin(theta))`.
//!
//! In: text, and the names of the effect's parameters. Out: an [`Expression`], parsed once, evaluated for any [`Scalar`]: `f64`, or a dual
//! number with exact first derivatives. The language has the variables `t theta omega i u T pi`, the operators `+ - * / ^`, the comparisons
//! `< <= > >=` (1 or 0), and the functions of [`functions`]. Evaluation does not allocate or panic. A derivative
//! that is infinite or undefined (sqrt and pow at zero) counts as zero, so that a fit at rest stays finite.
//!
//! The crate exmex does not fit: its expressions are parsed for one number type, which must be parsable from text; dual numbers are not.

mod error;
mod eval;
mod node;
mod parse;
mod print;

use drive_model::Scalar;

pub use error::ExpressionError;
use node::{Node, Variable};

/// Values of the variables.
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
    /// `u`: commanded voltage, V.
    pub u: S,
    /// `T`: winding temperature, °C.
    pub temp_C: S,
}

/// A parsed expression. Its printed text parses to the same expression.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Nodes, children before parents; the last is the root.
    nodes: Vec<Node>,
    parameters: Vec<String>,
}

impl Expression {
    /// Parses `text`; `parameters` are the valid names besides the variables.
    ///
    /// # Errors
    /// One line with column and token; for an unknown name also the nearest known name.
    pub fn parse(text: &str, parameters: &[String]) -> Result<Expression, ExpressionError> {
        Ok(Expression { nodes: parse::parse(text, parameters)?, parameters: parameters.to_vec() })
    }

    /// Value for these `variables`, with `parameters` in the order given to [`Expression::parse`] (a missing one counts as zero).
    #[inline]
    pub fn eval<S: Scalar>(&self, variables: &Variables<S>, parameters: &[S]) -> S {
        eval::eval(&self.nodes, variables, parameters)
    }

    /// Names of the parameters, in the order of [`Expression::eval`].
    pub fn parameters(&self) -> &[String] {
        &self.parameters
    }

    /// Whether the parameter of that index occurs.
    pub fn uses_parameter(&self, index: usize) -> bool {
        self.nodes.iter().any(|n| matches!(n, Node::Parameter(k) if usize::from(*k) == index))
    }

    /// Whether `t` occurs.
    pub fn uses_t(&self) -> bool {
        self.uses(Variable::Time)
    }

    /// Whether `theta` occurs.
    pub fn uses_theta(&self) -> bool {
        self.uses(Variable::Theta)
    }

    /// Whether `omega` occurs.
    pub fn uses_omega(&self) -> bool {
        self.uses(Variable::Omega)
    }

    /// Whether `i` occurs.
    pub fn uses_i(&self) -> bool {
        self.uses(Variable::Current)
    }

    /// Whether `u` occurs.
    pub fn uses_u(&self) -> bool {
        self.uses(Variable::Voltage)
    }

    /// Whether `T` occurs.
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

/// Names of all functions, with the number of their arguments.
pub fn functions() -> impl Iterator<Item = (&'static str, usize)> {
    let one = node::Function::ALL.iter().map(|f| (f.name(), 1));
    one.chain(node::Binary::FUNCTIONS.iter().map(|f| (f.name(), 2))).chain([("if", 3)])
}

/// Whether the name is a variable, a constant or a function, and not available for a parameter.
pub fn is_reserved(name: &str) -> bool {
    name == "pi" || Variable::of(name).is_some() || functions().any(|(f, _)| f == name)
}

/// Whether the name is valid in an expression: a letter or underscore, then letters, digits, underscores.
pub fn is_name(name: &str) -> bool {
    let mut letters = name.chars();
    letters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_') && letters.all(|c| c.is_ascii_alphanumeric() || c == '_')
}

#[cfg(test)]
mod tests;
