//! How sure: the likelihood of whitened residuals, its probability by chance, and the price of parameters.
//!
//! Two models of one log are compared by n ln(RSS₀/RSS₁) per channel, the likelihood ratio where the noise's size is not known. Residuals
//! that remember are no independent witnesses, so both series first pass the same whitening filter, an autoregression fitted to the residuals
//! of the better model. Increments and rates made from an encoder overlap: of those only every m-th is a witness.

use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::function::gamma::ln_gamma;

use crate::fit::{self, Record};

/// Most coefficients of a whitening filter, and rows that each of them needs.
const MOST_COEFFICIENTS: usize = 20;
const ROWS_PER_COEFFICIENT: usize = 50;
/// Relative floor of a sum of squares, so that a perfect model has a likelihood.
const FLOOR: f64 = 1e-12;

/// A whitening filter per channel.
pub struct Whitener {
    channels: Vec<Channel>,
}

struct Channel {
    /// Every so many rows are one witness.
    stride: usize,
    coefficients: Vec<f64>,
}

/// Whitened sums of squares of one model.
#[derive(Debug, Clone)]
pub struct Squares {
    /// Per channel and log: (sum, witnesses) of the fitted rows.
    fitted: Vec<Vec<(f64, f64)>>,
    /// The same of the held-out rows.
    held_out: Vec<Vec<(f64, f64)>>,
}

impl Whitener {
    /// The filter that whitens these residuals (per channel, a value per row).
    pub fn of(record: &Record, residuals: &[&[f64]]) -> Self {
        let channels = residuals
            .iter()
            .enumerate()
            .map(|(c, residual)| {
                let stride = fit::differenced(record, c).max(1);
                let mut covariances = vec![0.0; MOST_COEFFICIENTS + 1];
                let mut n = 0usize;
                for run in runs(record, residual, stride) {
                    for (k, a) in run.iter().enumerate() {
                        n += 1;
                        for (lag, sum) in covariances.iter_mut().enumerate().take(k + 1) {
                            *sum += a * run[k - lag];
                        }
                    }
                }
                let most = MOST_COEFFICIENTS.min(n / ROWS_PER_COEFFICIENT);
                Channel { stride, coefficients: autoregression(&covariances[..=most], n) }
            })
            .collect();
        Whitener { channels }
    }

    /// Whitened sums of squares of a model's residuals; `logs` are the rows of each log.
    pub fn squares(&self, record: &Record, residuals: &[&[f64]], logs: &[std::ops::Range<usize>]) -> Squares {
        let per_channel = |held: bool| {
            residuals
                .iter()
                .zip(&self.channels)
                .map(|(residual, channel)| {
                    let mut sums = vec![(0.0, 0.0); logs.len()];
                    for rows in &record.segments {
                        let Some(log) = logs.iter().position(|l| l.contains(&rows.start)) else { continue };
                        let mut past: Vec<f64> = Vec::with_capacity(MOST_COEFFICIENTS);
                        for row in rows.clone().step_by(channel.stride) {
                            let r = residual[row];
                            if !r.is_finite() {
                                past.clear();
                                continue;
                            }
                            let p = channel.coefficients.len();
                            if past.len() >= p {
                                let predicted: f64 = channel.coefficients.iter().zip(past.iter().rev()).map(|(a, x)| a * x).sum();
                                if record.held_out(row) == held {
                                    let e = r - predicted;
                                    sums[log].0 += e * e;
                                    sums[log].1 += 1.0;
                                }
                            }
                            if p > 0 {
                                if past.len() == p {
                                    past.remove(0);
                                }
                                past.push(r);
                            }
                        }
                    }
                    sums
                })
                .collect()
        };
        Squares { fitted: per_channel(false), held_out: per_channel(true) }
    }
}

/// Runs of finite values, every `stride`-th row of a segment.
fn runs(record: &Record, residual: &[f64], stride: usize) -> Vec<Vec<f64>> {
    let mut list = Vec::new();
    for rows in &record.segments {
        let mut run = Vec::new();
        for row in rows.clone().step_by(stride) {
            if residual[row].is_finite() {
                run.push(residual[row]);
            } else if !run.is_empty() {
                list.push(std::mem::take(&mut run));
            }
        }
        list.push(run);
    }
    list
}

/// Levinson and Durbin's recursion on sums of products, at the order with the smallest BIC.
fn autoregression(covariances: &[f64], n: usize) -> Vec<f64> {
    let Some(&power) = covariances.first().filter(|p| **p > 0.0) else { return Vec::new() };
    let mut coefficients: Vec<f64> = Vec::new();
    let mut innovation = power;
    let mut best = (0.0, Vec::new());
    for lag in 1..covariances.len() {
        let predicted: f64 = coefficients.iter().enumerate().map(|(k, a)| a * covariances[lag - 1 - k]).sum();
        let reflection = (covariances[lag] - predicted) / innovation;
        if !reflection.is_finite() || reflection.abs() >= 1.0 {
            break;
        }
        let before = coefficients.clone();
        for k in 0..lag - 1 {
            coefficients[k] = before[k] - reflection * before[lag - 2 - k];
        }
        coefficients.push(reflection);
        innovation *= 1.0 - reflection * reflection;
        let bic = n as f64 * (innovation / power).ln() + lag as f64 * (n.max(2) as f64).ln();
        if bic < best.0 {
            best = (bic, coefficients.clone());
        }
    }
    best.1
}

fn likelihood(before: &[Vec<(f64, f64)>], after: &[Vec<(f64, f64)>], log: Option<usize>) -> f64 {
    before
        .iter()
        .zip(after)
        .map(|(b, a)| {
            let sum = |list: &[(f64, f64)]| {
                list.iter().enumerate().filter(|(k, _)| log.is_none_or(|l| l == *k)).fold((0.0, 0.0), |(s, n), (_, (q, m))| (s + q, n + m))
            };
            let ((b, n), (a, _)) = (sum(b), sum(a));
            let floor = FLOOR * b.max(a);
            if n > 0.0 && floor > 0.0 { n * (b.max(floor) / a.max(floor)).ln() } else { 0.0 }
        })
        .sum()
}

impl Squares {
    /// Twice the logarithm of the likelihood ratio of `after` to this one, over the fitted rows.
    pub fn gain(&self, after: &Squares) -> f64 {
        likelihood(&self.fitted, &after.fitted, None)
    }

    /// The same over the rows that no fit saw; 0 where nothing was held out.
    pub fn held_out_gain(&self, after: &Squares) -> f64 {
        likelihood(&self.held_out, &after.held_out, None)
    }

    /// The same on one log alone, fitted and held-out rows together.
    pub fn gain_on(&self, after: &Squares, log: usize) -> f64 {
        likelihood(&self.fitted, &after.fitted, Some(log)) + likelihood(&self.held_out, &after.held_out, Some(log))
    }

    /// Witnesses among the fitted rows.
    pub fn witnesses(&self) -> f64 {
        self.fitted.iter().flatten().map(|(_, n)| n).sum()
    }
}

/// BIC with `parameters` more, minus that without, at a likelihood gain.
pub fn delta_bic(gain: f64, parameters: usize, witnesses: f64) -> f64 {
    parameters as f64 * witnesses.max(2.0).ln() - gain
}

/// Natural logarithm of P(χ²_k > x), also where the probability is no number any more.
pub fn ln_chance(x: f64, k: usize) -> f64 {
    if x <= 0.0 || k == 0 {
        return 0.0;
    }
    let direct = ChiSquared::new(k as f64).map_or(1.0, |d| d.sf(x));
    if direct > 1e-280 {
        return direct.ln();
    }
    // Leading term of the incomplete gamma function's tail.
    let half = 0.5 * k as f64;
    -0.5 * x + (half - 1.0) * (0.5 * x).ln() - ln_gamma(half)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_autoregression_is_found_from_its_own_covariances() {
        // x_k = 0.6 x_{k−1} − 0.2 x_{k−2} + e: the Yule–Walker equations give the covariances.
        let rho1 = 0.6 / 1.2;
        let rho2 = 0.6 * rho1 - 0.2;
        let rho3 = 0.6 * rho2 - 0.2 * rho1;
        let found = autoregression(&[1.0, rho1, rho2, rho3], 100_000);
        assert_eq!(found.len(), 2);
        assert!((found[0] - 0.6).abs() < 1e-12 && (found[1] + 0.2).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn a_chance_goes_on_below_the_smallest_number() {
        // P(χ²_2 > x) is exp(−x/2) exactly.
        for x in [1.0, 40.0, 5000.0] {
            assert!((ln_chance(x, 2) + 0.5 * x).abs() < 1e-9 * x.max(1.0));
        }
    }
}
