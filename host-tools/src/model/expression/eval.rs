//! Evaluation of an expression, for numbers with or without derivatives.
//!
//! `log` is the natural logarithm, like `ln`. Powers are real: a negative base needs an integer exponent.

use drive_model::Scalar;

use super::Variables;
use super::node::{Function, Node, Pair, Variable};

/// The value of the root node.
#[inline]
pub(super) fn eval<S: Scalar>(nodes: &[Node], env: &Variables<S>, parameters: &[S]) -> S {
    Evaluator { nodes, env, parameters }.value(nodes.len().wrapping_sub(1))
}

struct Evaluator<'a, S> {
    nodes: &'a [Node],
    env: &'a Variables<S>,
    parameters: &'a [S],
}

impl<S: Scalar> Evaluator<'_, S> {
    fn at(&self, node: u16) -> S {
        self.value(usize::from(node))
    }

    fn value(&self, node: usize) -> S {
        match self.nodes.get(node) {
            None => S::from(0.0),
            Some(Node::Constant(c)) => S::from(*c),
            Some(Node::Pi) => S::from(std::f64::consts::PI),
            Some(Node::Variable(variable)) => match variable {
                Variable::Time => self.env.t,
                Variable::Theta => self.env.theta,
                Variable::Omega => self.env.omega,
                Variable::Current => self.env.i,
                Variable::Voltage => self.env.u,
                Variable::Temperature => self.env.temp_C,
            },
            Some(Node::Parameter(k)) => self.parameters.get(usize::from(*k)).copied().unwrap_or(S::from(0.0)),
            Some(Node::Negative(a)) => -self.at(*a),
            Some(Node::Call(function, a)) => call(*function, self.at(*a)),
            Some(Node::Power(a, power)) => whole_power(self.at(*a), *power),
            Some(Node::Pair(pair, a, b)) => join(*pair, self.at(*a), self.at(*b)),
            // Only the selected branch: the other one may be undefined here.
            Some(Node::If(condition, yes, no)) => self.at(if self.at(*condition).re() != 0.0 { *yes } else { *no }),
        }
    }
}

/// `value` with the derivative `slope` of `a`; a slope that is not finite counts as zero.
#[inline]
fn chain<S: Scalar>(value: f64, a: S, slope: f64) -> S {
    if slope.is_finite() { (a - S::from(a.re())) * slope + value } else { S::from(value) }
}

fn call<S: Scalar>(function: Function, a: S) -> S {
    let x = a.re();
    match function {
        Function::Sin => a.sin(),
        Function::Cos => a.cos(),
        Function::Tan => a.tan(),
        Function::Asin => chain(x.asin(), a, (1.0 - x * x).sqrt().recip()),
        Function::Acos => chain(x.acos(), a, -(1.0 - x * x).sqrt().recip()),
        Function::Atan => chain(x.atan(), a, (1.0 + x * x).recip()),
        Function::Sinh => chain(x.sinh(), a, x.cosh()),
        Function::Cosh => chain(x.cosh(), a, x.sinh()),
        // The quotient of sinh and cosh would overflow at high rates.
        Function::Tanh => {
            let value = x.tanh();
            chain(value, a, 1.0 - value * value)
        }
        Function::Exp => a.exp(),
        Function::Ln | Function::Log => a.ln(),
        Function::Log10 => a.log10(),
        Function::Sqrt => chain(x.sqrt(), a, 0.5 / x.sqrt()),
        Function::Abs => {
            if x > 0.0 {
                a
            } else if x < 0.0 {
                -a
            } else {
                S::from(x.abs())
            }
        }
        Function::Sign => S::from(if x == 0.0 { 0.0 } else { x.signum() }),
        Function::Floor => S::from(x.floor()),
    }
}

fn join<S: Scalar>(pair: Pair, a: S, b: S) -> S {
    let truth = |holds: bool| S::from(f64::from(u8::from(holds)));
    match pair {
        Pair::Add => a + b,
        Pair::Subtract => a - b,
        Pair::Multiply => a * b,
        Pair::Divide => a / b,
        Pair::Power | Pair::Pow => power(a, b),
        Pair::Less => truth(a.re() < b.re()),
        Pair::LessOrEqual => truth(a.re() <= b.re()),
        Pair::More => truth(a.re() > b.re()),
        Pair::MoreOrEqual => truth(a.re() >= b.re()),
        Pair::Atan2 => {
            let (y, x) = (a.re(), b.re());
            let square = x * x + y * y;
            chain(y.atan2(x), a, x / square) + chain(0.0, b, -y / square)
        }
        Pair::Min => {
            if b.re() < a.re() {
                b
            } else {
                a
            }
        }
        Pair::Max => {
            if b.re() > a.re() {
                b
            } else {
                a
            }
        }
    }
}

fn whole_power<S: Scalar>(a: S, power: i8) -> S {
    match power {
        0 => S::from(1.0),
        1 => a,
        2 => a * a,
        3 => a * a * a,
        _ => {
            let x = a.re();
            let n = i32::from(power);
            chain(x.powi(n), a, f64::from(n) * x.powi(n - 1))
        }
    }
}

fn power<S: Scalar>(a: S, b: S) -> S {
    let (x, n) = (a.re(), b.re());
    let value = x.powf(n);
    let by_base = if n == 0.0 { 0.0 } else { n * x.powf(n - 1.0) };
    let by_exponent = if x > 0.0 { value * x.ln() } else { 0.0 };
    chain(value, a, by_base) + chain(0.0, b, by_exponent)
}
