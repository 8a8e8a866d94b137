//! The stationary Kalman filter of a row model.
//!
//! In: a [`RowModel`], the density of the random torque, white noise of each channel. Out: a [`Predictor`]: gains, and the variance of each
//! channel's innovations. The covariance of the prediction solves the discrete algebraic Riccati equation, by the structure-preserving
//! doubling algorithm (Chu, Fan, Lin, Wang, Int. J. Control 77 (2004) 767), which converges quadratically also for a very small random
//! torque.

use nalgebra::{DMatrix, DVector};

use super::row_model::{RowModel, StateComponent};
use crate::recording::predictor::{Gain, Predictor};

/// Doublings of the Riccati equation at most: 2^60 rows.
const MAX_DOUBLINGS: usize = 60;
/// Relative change of the covariance at which the doubling ends.
const TOLERANCE: f64 = 1e-12;

/// The filter for a random torque of `density`, (N m)²/Hz two-sided; `None` where the equation has no solution.
pub fn stationary_filter(model: &RowModel, density: f64, white: &[f64]) -> Option<Predictor> {
    let p = prediction_covariance(&model.transition, &(&model.by_torque * density), &model.readings, white)?;
    gains(model, p, white)
}

/// Covariance of the predicted state: the solution of P = F (P⁻¹ + Cᵀ R⁻¹ C)⁻¹ Fᵀ + Q.
fn prediction_covariance(f: &DMatrix<f64>, q: &DMatrix<f64>, readings: &[DVector<f64>], white: &[f64]) -> Option<DMatrix<f64>> {
    let n = f.nrows();
    // States in units in which the best channel's white noise is 1: the doubling loses no digits.
    let information = |readings: &dyn Fn(usize) -> DVector<f64>| {
        let mut g = DMatrix::<f64>::zeros(n, n);
        for (c, white) in white.iter().enumerate() {
            let r = readings(c);
            g += &r * r.transpose() / (white * white);
        }
        g
    };
    let plain = information(&|c| readings[c].clone());
    let scale: Vec<f64> = (0..n).map(|k| if plain[(k, k)] > 0.0 { 1.0 / plain[(k, k)].sqrt() } else { 1.0 }).collect();
    let scaled = |m: &DMatrix<f64>, of: &dyn Fn(usize, usize) -> f64| DMatrix::from_fn(n, n, |i, j| m[(i, j)] * of(i, j));
    let mut a = scaled(f, &|i, j| scale[j] / scale[i]).transpose();
    let mut g = information(&|c| DVector::from_fn(n, |k, _| readings[c][k] * scale[k]));
    let mut h = scaled(q, &|i, j| 1.0 / (scale[i] * scale[j]));
    for _ in 0..MAX_DOUBLINGS {
        let w = (DMatrix::identity(n, n) + &g * &h).try_inverse()?;
        let next_a = &a * &w * &a;
        let next_g = &g + &a * &w * &g * a.transpose();
        let next_h = &h + a.transpose() * &h * &w * &a;
        let change = (&next_h - &h).amax();
        a = next_a;
        g = (&next_g + next_g.transpose()) * 0.5;
        h = (&next_h + next_h.transpose()) * 0.5;
        if !change.is_finite() {
            return None;
        }
        if change <= TOLERANCE * h.amax() {
            return Some(scaled(&h, &|i, j| scale[i] * scale[j]));
        }
    }
    None
}

/// Gains of the channels one after the other, from the covariance of the prediction.
fn gains(model: &RowModel, mut p: DMatrix<f64>, white: &[f64]) -> Option<Predictor> {
    let mut predictor = Predictor { gains: vec![Gain::default(); white.len()], innovation_variances: vec![0.0; white.len()] };
    // Those at the time of the row are used first.
    let order = (0..white.len()).filter(|&c| !model.over_row[c]).chain((0..white.len()).filter(|&c| model.over_row[c]));
    for c in order {
        let covariance = &p * &model.readings[c];
        let variance = model.readings[c].dot(&covariance) + white[c] * white[c];
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let gain = &covariance / variance;
        p -= &gain * covariance.transpose();
        // A mean over the row corrects the state at its end.
        let moved = if model.over_row[c] { &model.transition * &gain } else { gain };
        let of = |state: StateComponent| model.states.iter().position(|s| *s == state).map_or(0.0, |k| moved[k]);
        predictor.gains[c] = Gain {
            omega: of(StateComponent::Omega),
            theta: of(StateComponent::Theta),
            motor_omega: of(if model.states.contains(&StateComponent::MotorOmega) {
                StateComponent::MotorOmega
            } else {
                StateComponent::Omega
            }),
            twist: of(StateComponent::Twist),
        };
        predictor.innovation_variances[c] = variance;
    }
    Some(predictor)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rate with decay a, observed with white noise: P solves a scalar quadratic.
    #[test]
    fn scalar_filter_has_its_closed_form() {
        for (density, white) in [(1e-3, 0.1), (1e-12, 0.02), (10.0, 1e-3)] {
            let (a, b): (f64, f64) = (0.97, 2.0);
            let model = RowModel {
                states: vec![StateComponent::Omega],
                transition: DMatrix::from_element(1, 1, a),
                by_torque: DMatrix::from_element(1, 1, b),
                torque_response: DVector::zeros(1),
                readings: vec![DVector::from_element(1, 1.0)],
                over_row: vec![false],
            };
            let filter = stationary_filter(&model, density, &[white]).unwrap();
            let (q, r) = (density * b, white * white);
            // P = a² P r/(P + r) + q.
            let half = 0.5 * (q - r * (1.0 - a * a));
            let p = half + (half * half + q * r).sqrt();
            assert!((filter.innovation_variances[0] / (p + r) - 1.0).abs() < 1e-10);
            assert!((filter.gains[0].omega / (p / (p + r)) - 1.0).abs() < 1e-6, "{density}: {} {}", filter.gains[0].omega, p / (p + r));
        }
    }
}
