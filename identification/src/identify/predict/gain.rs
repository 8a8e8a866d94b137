//! The stationary Kalman filter of a row model.
//!
//! In: a [`RowModel`], the density of the random torque, white and coloured noise of each channel. Out: a [`Predictor`]: gains, and the variance of
//! each channel's innovations. The covariance of the prediction solves the discrete algebraic Riccati equation, by the structure-preserving doubling
//! algorithm (Chu, Fan, Lin, Wang, Int. J. Control 77 (2004) 767), which converges quadratically also for a very small random torque.

use nalgebra::{DMatrix, DVector};

use super::row_model::{DriveState, RowModel};
use crate::identify::fit::predictor::{Gain, Predictor};

/// Noise of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChannelNoise {
    /// Standard deviation of the white noise, in the unit of the channel.
    pub white: f64,
    /// Coloured noise beside it.
    pub coloured: Option<ColouredNoise>,
}

/// A first-order Gauss–Markov process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColouredNoise {
    /// Standard deviation, in the unit of the channel.
    pub sigma: f64,
    /// Correlation from row to row.
    pub decay: f64,
}

/// Doublings of the Riccati equation at most: 2^60 rows.
const MAX_DOUBLINGS: usize = 60;
/// Relative change of the covariance at which the doubling ends.
const TOLERANCE: f64 = 1e-12;

/// The filter for a random torque of `density`, (N m)²/Hz two-sided; `None` where the equation has no solution.
pub fn stationary_filter(model: &RowModel, density: f64, noise: &[ChannelNoise]) -> Option<Predictor> {
    let drive = model.states.len();
    let coloured: Vec<usize> = (0..noise.len()).filter(|&c| noise[c].coloured.is_some()).collect();
    let n = drive + coloured.len();
    let mut f = DMatrix::<f64>::zeros(n, n);
    let mut q = DMatrix::<f64>::zeros(n, n);
    f.view_mut((0, 0), (drive, drive)).copy_from(&model.transition);
    q.view_mut((0, 0), (drive, drive)).copy_from(&(&model.by_torque * density));
    let mut readings: Vec<DVector<f64>> = model.readings.iter().map(|r| r.clone().resize_vertically(n, 0.0)).collect();
    for (k, &c) in coloured.iter().enumerate() {
        let ColouredNoise { sigma, decay } = noise[c].coloured?;
        f[(drive + k, drive + k)] = decay;
        q[(drive + k, drive + k)] = sigma * sigma * (1.0 - decay * decay);
        readings[c][drive + k] = 1.0;
    }
    let p = prediction_covariance(&f, &q, &readings, noise)?;
    gains(model, &f, p, &readings, noise, &coloured)
}

/// Covariance of the predicted state: the solution of P = F (P⁻¹ + Cᵀ R⁻¹ C)⁻¹ Fᵀ + Q.
fn prediction_covariance(f: &DMatrix<f64>, q: &DMatrix<f64>, readings: &[DVector<f64>], noise: &[ChannelNoise]) -> Option<DMatrix<f64>> {
    let n = f.nrows();
    // States in units in which the best channel's white noise is 1: the doubling loses no digits.
    let information = |readings: &dyn Fn(usize) -> DVector<f64>| {
        let mut g = DMatrix::<f64>::zeros(n, n);
        for (c, noise) in noise.iter().enumerate() {
            let r = readings(c);
            g += &r * r.transpose() / (noise.white * noise.white);
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
fn gains(
    model: &RowModel,
    f: &DMatrix<f64>,
    mut p: DMatrix<f64>,
    readings: &[DVector<f64>],
    noise: &[ChannelNoise],
    coloured: &[usize],
) -> Option<Predictor> {
    let drive = model.states.len();
    let mut predictor = Predictor {
        gains: vec![Gain::default(); noise.len()],
        innovation_variances: vec![0.0; noise.len()],
        noise_decay: noise.iter().map(|n| n.coloured.map_or(0.0, |c| c.decay)).collect(),
    };
    // Those at the time of the row are used first.
    let order = (0..noise.len()).filter(|&c| !model.over_row[c]).chain((0..noise.len()).filter(|&c| model.over_row[c]));
    for c in order {
        let covariance = &p * &readings[c];
        let variance = readings[c].dot(&covariance) + noise[c].white * noise[c].white;
        if variance.is_nan() || variance <= 0.0 {
            return None;
        }
        let gain = &covariance / variance;
        p -= &gain * covariance.transpose();
        // A mean over the row corrects the state at its end.
        let moved = if model.over_row[c] { f * &gain } else { gain.clone() };
        let of = |state: DriveState| model.states.iter().position(|s| *s == state).map_or(0.0, |k| moved[k]);
        let mut by_channel = vec![0.0; noise.len()];
        for (k, &of) in coloured.iter().enumerate() {
            by_channel[of] = gain[drive + k];
        }
        predictor.gains[c] = Gain {
            omega: of(DriveState::Omega),
            theta: of(DriveState::Theta),
            motor_omega: of(if model.states.contains(&DriveState::MotorOmega) { DriveState::MotorOmega } else { DriveState::Omega }),
            twist: of(DriveState::Twist),
            noise: by_channel,
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
                states: vec![DriveState::Omega],
                transition: DMatrix::from_element(1, 1, a),
                by_torque: DMatrix::from_element(1, 1, b),
                torque_response: DVector::zeros(1),
                readings: vec![DVector::from_element(1, 1.0)],
                over_row: vec![false],
            };
            let filter = stationary_filter(&model, density, &[ChannelNoise { white, coloured: None }]).unwrap();
            let (q, r) = (density * b, white * white);
            // P = a² P r/(P + r) + q.
            let half = 0.5 * (q - r * (1.0 - a * a));
            let p = half + (half * half + q * r).sqrt();
            assert!((filter.innovation_variances[0] / (p + r) - 1.0).abs() < 1e-10);
            assert!((filter.gains[0].omega / (p / (p + r)) - 1.0).abs() < 1e-6, "{density}: {} {}", filter.gains[0].omega, p / (p + r));
        }
    }
}
