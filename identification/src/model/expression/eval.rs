//! Evaluation of an expression, for numbers with or without derivatives.
//!
//! `log` is the natural logarithm, like `ln`. Powers are real: a negative base needs an integer exponent.

use drive_model::Scalar;

use super::Variables;
use super::node::{Binary, Function, Node, Variable};

/// The value of the root, the last of the `nodes`.
#[inline]
pub(super) fn eval<S: Scalar>(nodes: &[Node], variables: &Variables<S>, parameters: &[S]) -> S {
    Evaluator { nodes, variables, parameters }.value(nodes.len().wrapping_sub(1))
}

/// An expression with the values of its variables and parameters. A missing node or parameter counts as zero, so that evaluation cannot
/// fail; the parser makes no expression that lacks a node.
struct Evaluator<'a, S> {
    nodes: &'a [Node],
    variables: &'a Variables<S>,
    parameters: &'a [S],
}

impl<S: Scalar> Evaluator<'_, S> {
    fn child(&self, node: u16) -> S {
        self.value(usize::from(node))
    }

    fn value(&self, node: usize) -> S {
        match self.nodes.get(node) {
            None => S::from(0.0),
            Some(Node::Constant(c)) => S::from(*c),
            Some(Node::Pi) => S::from(std::f64::consts::PI),
            Some(Node::Variable(variable)) => match variable {
                Variable::Time => self.variables.t,
                Variable::Theta => self.variables.theta,
                Variable::Omega => self.variables.omega,
                Variable::Current => self.variables.i,
                Variable::Voltage => self.variables.u,
                Variable::Temperature => self.variables.temp_C,
            },
            Some(Node::Parameter(k)) => self.parameters.get(usize::from(*k)).copied().unwrap_or(S::from(0.0)),
            Some(Node::Negative(a)) => -self.child(*a),
            Some(Node::Call(function, a)) => call(*function, self.child(*a)),
            Some(Node::IntegerPower(a, power)) => integer_power(self.child(*a), *power),
            Some(Node::Binary(operator, a, b)) => binary(*operator, self.child(*a), self.child(*b)),
            // Only the selected branch: the other one may be undefined here.
            Some(Node::If(condition, yes, no)) => self.child(if self.child(*condition).re() != 0.0 { *yes } else { *no }),
        }
    }
}

/// f(a) by the chain rule, where `value` is f and `slope` is f′ at the number of `a`.
///
/// A slope that is not finite (√ at 0, asin at 1) counts as zero, so that a fit at rest stays finite.
#[inline]
fn chain_rule<S: Scalar>(value: f64, a: S, slope: f64) -> S {
    if slope.is_finite() { (a - S::from(a.re())) * slope + value } else { S::from(value) }
}

fn call<S: Scalar>(function: Function, a: S) -> S {
    let x = a.re();
    match function {
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Tan => a.tan(),
        Function::Asin => chain_rule(x.asin(), a, (1.0 - x * x).sqrt().recip()),
        Function::Acos => chain_rule(x.acos(), a, -(1.0 - x * x).sqrt().recip()),
        Function::Atan => chain_rule(x.atan(), a, (1.0 + x * x).recip()),
        Function::Sinh => chain_rule(x.sinh(), a, x.cosh()),
        Function::Cosh => chain_rule(x.cosh(), a, x.sinh()),
        // The quotient of sinh and cosh would overflow at high rates.
        Function::Tanh => {
            let value = x.tanh();
            chain_rule(value, a, 1.0 - value * value)
        }
        Function::Exp => a.exp(),
        Function::Ln | Function::Log => a.ln(),
        Function::Log10 => a.log10(),
        Function::Sqrt => chain_rule(x.sqrt(), a, 0.5 / x.sqrt()),
        Function::Abs => {
            if x > 0.0 {
                a
            } else if x < 0.0 {
                -a
            } else {
                // Zero, with the derivative zero; or NaN.
                S::from(x.abs())
            }
        }
        Function::Sign => S::from(if x == 0.0 { 0.0 } else { x.signum() }),
        Function::Floor => S::from(x.floor()),
    }
}

fn binary<S: Scalar>(operator: Binary, a: S, b: S) -> S {
    let truth = |holds: bool| S::from(f64::from(u8::from(holds)));
    match operator {
        Binary::Add => a + b,
        Binary::Subtract => a - b,
        Binary::Multiply => a * b,
        Binary::Divide => a / b,
        Binary::Power | Binary::Pow => power(a, b),
        Binary::Less => truth(a.re() < b.re()),
        Binary::LessOrEqual => truth(a.re() <= b.re()),
        Binary::Greater => truth(a.re() > b.re()),
        Binary::GreaterOrEqual => truth(a.re() >= b.re()),
        Binary::Atan2 => {
            let (y, x) = (a.re(), b.re());
            let radius_squared = x * x + y * y;
            chain_rule(y.atan2(x), a, x / radius_squared) + chain_rule(0.0, b, -y / radius_squared)
        }
        Binary::Min => {
            if b.re() < a.re() {
                b
            } else {
                a
            }
        }
        Binary::Max => {
            if b.re() > a.re() {
                b
            } else {
                a
            }
        }
    }
}

/// aⁿ for an integer literal n, with the derivative by a alone.
fn integer_power<S: Scalar>(a: S, power: i8) -> S {
    match power {
        0 => S::from(1.0),
        1 => a,
        2 => a * a,
        3 => a * a * a,
        _ => {
            let x = a.re();
            let n = i32::from(power);
            chain_rule(x.powi(n), a, f64::from(n) * x.powi(n - 1))
        }
    }
}

/// aᵇ by both arguments; for a ≤ 0 the derivative by the exponent counts as zero.
fn power<S: Scalar>(a: S, b: S) -> S {
    let (x, n) = (a.re(), b.re());
    let value = x.powf(n);
    let by_base = if n == 0.0 { 0.0 } else { n * x.powf(n - 1.0) };
    let by_exponent = if x > 0.0 { value * x.ln() } else { 0.0 };
    chain_rule(value, a, by_base) + chain_rule(0.0, b, by_exponent)
}
