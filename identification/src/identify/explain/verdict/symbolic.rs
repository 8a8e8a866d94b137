//! Search for an expression with few parameters that has the shape of a piecewise linear law.
//!
//! In: the heights of a law at its knots, with their confidence. Out: a few expressions for the model file, the best first. Sums of a
//! constant and one or two terms from a library of the coordinate are fitted to the heights by weighted least squares and ranked by BIC.
//! The heights of neighbouring knots are correlated, so that this only ranks: the caller fits the best expressions to the log and judges
//! them on held-out rows.

use std::f64::consts::TAU;

use drive_model::Coordinate;
use nalgebra::{Cholesky, DMatrix, DVector};

use super::piecewise_linear::PiecewiseLinear;
use crate::identify::explain::criteria::UnknownCriteria;
use crate::model::SummingPoint;
use crate::statistics::Extremes;
use crate::statistics::robust::median;

/// An expression for the model file, before it is fitted.
#[derive(Debug, Clone)]
pub struct Proposal {
    /// What it is added to.
    pub acts_on: SummingPoint,
    /// The expression.
    pub text: String,
    /// Names of its parameters with their start values.
    pub starts: Vec<(&'static str, f64)>,
}

/// Names of the coefficients; `c` and `h` are middle and half width of a sector, `f` is a frequency.
const COEFFICIENTS: [&str; 5] = ["a", "b", "d", "g", "k"];
/// Relative increase of the diagonal of the normal equations, so that their factorisation exists.
const RIDGE: f64 = 1e-9;

/// Functions of the coordinate that belong together, each with a coefficient of its own: the cosine and the sine of an order.
struct Term(Vec<Part>);

struct Part {
    text: String,
    at_knots: Vec<f64>,
}

/// Expressions with the shape of these heights, the best first, `count` at most.
pub fn proposals(criteria: &UnknownCriteria, law: &PiecewiseLinear, heights: &[f64], confidence: &[f64], count: usize) -> Vec<Proposal> {
    let usual = median(confidence.iter().copied().filter(|c| c.is_finite() && *c > 0.0)).unwrap_or(1.0);
    let weight = |c: &f64| if c.is_finite() && *c > 0.0 { (usual / c).powi(2).min(1.0) } else { 0.0 };
    let weights: Vec<f64> = confidence.iter().map(weight).collect();
    let terms = library(law);
    let mut ranked: Vec<(f64, Proposal)> = Vec::new();
    for (k, one) in terms.iter().enumerate() {
        ranked.extend(fitted(law, &[one], heights, &weights));
        for other in &terms[k + 1..] {
            ranked.extend(fitted(law, &[one, other], heights, &weights));
        }
    }
    if law.coordinate == Coordinate::Theta {
        let proposal = sector(law, heights, criteria.sector_steepness);
        let bic = bic(&errors_of_sector(&proposal, law, heights, criteria.sector_steepness), &weights, 4);
        ranked.push((bic, proposal));
    }
    ranked.retain(|(bic, _)| bic.is_finite());
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked.into_iter().map(|(_, proposal)| proposal).take(count).collect()
}

/// The terms of a coordinate.
fn library(law: &PiecewiseLinear) -> Vec<Term> {
    let knots = law.knots();
    let (low, high) = law.range;
    let largest = low.abs().max(high.abs());
    let single = |text: String, f: &dyn Fn(f64) -> f64| Term(vec![Part { text, at_knots: knots.iter().map(|x| f(*x)).collect() }]);
    let mut list = Vec::new();
    match law.coordinate {
        Coordinate::Theta => {
            for order in 1..=6 {
                let n = f64::from(order);
                let part = |text: String, f: fn(f64) -> f64| Part { text, at_knots: knots.iter().map(|x| f(n * x)).collect() };
                list.push(Term(vec![part(format!("cos({order} * theta)"), f64::cos), part(format!("sin({order} * theta)"), f64::sin)]));
            }
        }
        Coordinate::Omega | Coordinate::Current => {
            let v = if law.coordinate == Coordinate::Omega { "omega" } else { "i" };
            list.push(single(v.to_owned(), &|x| x));
            list.push(single(format!("abs({v})"), &f64::abs));
            list.push(single(format!("{v}^2"), &|x| x * x));
            list.push(single(format!("{v} * abs({v})"), &|x| x * x.abs()));
            list.push(single(format!("{v}^3"), &|x| x * x * x));
            for fraction in [0.02, 0.1, 0.3] {
                let s = fraction * largest;
                list.push(single(format!("tanh({v} / {s:.3e})"), &|x| (x / s).tanh()));
            }
            for fraction in [0.05, 0.15, 0.4] {
                let (s, sharp) = (fraction * largest, 0.02 * largest);
                list.push(single(format!("tanh({v} / {sharp:.3e}) * exp(-abs({v}) / {s:.3e})"), &|x| {
                    (x / sharp).tanh() * (-x.abs() / s).exp()
                }));
            }
        }
        Coordinate::Temperature => {
            list.push(single("(T - 25)".to_owned(), &|x| x - 25.0));
            list.push(single("(T - 25)^2".to_owned(), &|x| (x - 25.0).powi(2)));
            list.push(single("exp((25 - T) / 20)".to_owned(), &|x| ((25.0 - x) / 20.0).exp()));
        }
        Coordinate::Time => {
            list.push(single("t".to_owned(), &|x| x));
            list.push(single("t^2".to_owned(), &|x| x * x));
            for fraction in [0.1, 0.3] {
                let s = fraction * (high - low);
                list.push(single(format!("exp(-t / {s:.3e})"), &|x| (-x / s).exp()));
            }
            for pair in knots.windows(2).filter(|w| w[0] > low && w[1] < high) {
                let (middle, width) = (0.5 * (pair[0] + pair[1]), 0.1 * (pair[1] - pair[0]));
                list.push(single(format!("tanh((t - {middle:.3e}) / {width:.3e})"), &|x| ((x - middle) / width).tanh()));
            }
        }
        _ => {}
    }
    list
}

/// A constant and these terms, fitted to the heights: BIC and the expression; `None` where they are not independent.
fn fitted(law: &PiecewiseLinear, terms: &[&Term], heights: &[f64], weights: &[f64]) -> Option<(f64, Proposal)> {
    let parts: Vec<&Part> = terms.iter().flat_map(|term| &term.0).collect();
    let ones = vec![1.0; heights.len()];
    let columns: Vec<&[f64]> = parts.iter().map(|p| p.at_knots.as_slice()).chain([ones.as_slice()]).collect();
    let n = columns.len();
    if n > COEFFICIENTS.len() || n + 2 > weights.iter().filter(|w| **w > 0.0).count() {
        return None;
    }
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).zip(weights).map(|((a, b), w)| w * a * b).sum::<f64>();
    let mut matrix = DMatrix::from_fn(n, n, |i, j| product(columns[i], columns[j]));
    for k in 0..n {
        matrix[(k, k)] *= 1.0 + RIDGE;
    }
    let values = Cholesky::new(matrix)?.solve(&DVector::from_fn(n, |k, _| product(columns[k], heights)));
    let errors: Vec<f64> =
        (0..heights.len()).map(|k| heights[k] - columns.iter().zip(values.iter()).map(|(c, v)| c[k] * v).sum::<f64>()).collect();
    let mut text: Vec<String> = parts.iter().zip(COEFFICIENTS).map(|(p, name)| format!("{name} * {}", p.text)).collect();
    text.push(COEFFICIENTS[parts.len()].to_owned());
    let starts = COEFFICIENTS.into_iter().zip(values.iter().copied()).collect();
    Some((bic(&errors, weights, n), Proposal { acts_on: law.acts_on, text: text.join(" + "), starts }))
}

/// BIC of `parameters` parameters that leave these errors, apart from a constant.
fn bic(errors: &[f64], weights: &[f64], parameters: usize) -> f64 {
    let n = weights.iter().filter(|w| **w > 0.0).count() as f64;
    let sum: f64 = errors.iter().zip(weights).map(|(e, w)| w * e * e).sum();
    n * (sum / n).max(f64::MIN_POSITIVE).ln() + parameters as f64 * n.ln()
}

/// A sector of the turn: height `a` above the rest `b`, middle `c`, half width `h`.
fn sector(law: &PiecewiseLinear, heights: &[f64], steepness: f64) -> Proposal {
    let n = heights.len();
    let rest = median(heights.iter().copied()).unwrap_or(0.0);
    let (low, high) = heights.iter().copied().min_max();
    let sign = if high - rest >= rest - low { 1.0 } else { -1.0 };
    let top = if sign > 0.0 { high } else { low };
    let inside: Vec<usize> = (0..n).filter(|&k| (heights[k] - rest) * sign > 0.5 * (top - rest) * sign).collect();
    let (mut x, mut y) = (0.0, 0.0);
    for &k in &inside {
        let (s, c) = (TAU * k as f64 / n as f64).sin_cos();
        x += c * (heights[k] - rest).abs();
        y += s * (heights[k] - rest).abs();
    }
    let middle = y.atan2(x).rem_euclid(TAU);
    let half = (0.5 * TAU * inside.len() as f64 / n as f64).clamp(0.1, 3.0);
    let text = format!("a / (1 + exp({steepness} * (cos(h) - cos(theta - c))))");
    Proposal { acts_on: law.acts_on, text, starts: vec![("a", top - rest), ("c", middle), ("h", half)] }
}

/// What a sector leaves of the heights about their median.
fn errors_of_sector(proposal: &Proposal, law: &PiecewiseLinear, heights: &[f64], steepness: f64) -> Vec<f64> {
    let rest = median(heights.iter().copied()).unwrap_or(0.0);
    let [a, c, h] = [0, 1, 2].map(|k| proposal.starts[k].1);
    let value = |theta: f64| a / (1.0 + (steepness * (h.cos() - (theta - c).cos())).exp());
    law.knots().iter().zip(heights).map(|(theta, height)| height - rest - value(*theta)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn best(coordinate: Coordinate, range: (f64, f64), f: impl Fn(f64) -> f64) -> Proposal {
        let law = PiecewiseLinear { coordinate, acts_on: SummingPoint::Torque, range, count: 22 };
        // Errors of 1 % of the heights, by a fixed rule.
        let heights: Vec<f64> = law.knots().iter().enumerate().map(|(k, x)| f(*x) * (1.0 + 0.01 * (k as f64 * 2.4).sin())).collect();
        proposals(&UnknownCriteria::default(), &law, &heights, &[1e-3; 22], 3).swap_remove(0)
    }

    #[test]
    fn shapes_are_recognized() {
        let drag = best(Coordinate::Omega, (-20.0, 20.0), |w| 3e-3 * w * w.abs());
        assert_eq!(drag.text, "a * omega * abs(omega) + b");
        assert!((drag.starts[0].1 / 3e-3 - 1.0).abs() < 0.02, "{drag:?}");
        let crank = best(Coordinate::Theta, (0.0, TAU), |x| 0.2 * (3.0 * x + 1.0).cos());
        assert_eq!(crank.text, "a * cos(3 * theta) + b * sin(3 * theta) + d");
        let rub = best(Coordinate::Theta, (0.0, TAU), |x| if (x - 2.0).abs() < 0.6 { 0.3 } else { 0.0 });
        assert!(rub.text.starts_with("a / (1 + exp("), "{rub:?}");
        let step = best(Coordinate::Time, (0.0, 21.0), |t| if t > 9.4 { 0.5 } else { 0.1 });
        assert_eq!(step.text, "a * tanh((t - 9.500e0) / 1.000e-1) + b");
        let warm = best(Coordinate::Temperature, (20.0, 60.0), |c| 0.01 * (c - 25.0));
        assert_eq!(warm.text, "a * (T - 25) + b");
    }

    #[test]
    fn knots_without_confidence_do_not_count() {
        let law = PiecewiseLinear { coordinate: Coordinate::Omega, acts_on: SummingPoint::Torque, range: (-10.0, 10.0), count: 14 };
        let mut heights: Vec<f64> = law.knots().iter().map(|w| 2.0 * w).collect();
        let mut confidence = vec![0.1; 14];
        (heights[0], confidence[0]) = (1e6, f64::NAN);
        let found = proposals(&UnknownCriteria::default(), &law, &heights, &confidence, 1);
        assert_eq!(found[0].text, "a * omega + b");
    }
}
