//! Standard errors that cover: the sandwich H⁻¹ B H⁻¹ with the colour of each channel's noise.
//!
//! An angle's increments over m rows are differences of white quantisation noise, and so is a rate made from an encoder: their scores
//! telescope, which is exact to write down (B = σ_e² Σ D Dᵀ with D = w(J_k − J_{k+m})). Other channels are inflated by the correlation seen
//! in the residual. A channel that the model does not describe has its errors enlarged by its χ²/n.

use std::collections::VecDeque;

use nalgebra::{DMatrix, SVector, SymmetricEigen};

use super::normal_equations::{InitialStates, NormalEquations};
use super::parameters::{Dual, Parameters};
use super::prepared_log::PreparedLog;
use super::simulate::{LawScalar, System, run};
use crate::statistics::Extremes;

/// Colour of a channel's noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseColour {
    /// Lag over which white noise was differenced, in rows; 0: it was not.
    pub differenced: usize,
    /// Inflation of the information's covariance: colour seen, and misfit.
    pub inflation: f64,
}

/// Covariance of the free coordinates, and which of them the log does not determine.
pub struct Covariance {
    /// In the free coordinates.
    pub matrix: DMatrix<f64>,
    /// Directions (free coordinates, unit length in their scaled form) without information.
    pub unseen: Vec<Vec<f64>>,
    /// Correlation of the free coordinates.
    pub correlation: DMatrix<f64>,
}

/// Relative eigenvalue of the scaled information below which a direction is not determined by the log.
const SINGULAR: f64 = 1e-9;

/// The covariance at the solution.
pub fn covariance(
    system: &System,
    parameters: &Parameters,
    record: &PreparedLog,
    starts: &InitialStates,
    weights: &[f64],
    colours: &[NoiseColour],
    linear: &NormalEquations,
) -> Covariance {
    let lanes = parameters.free().len() + starts.kinds.len();
    let scores = match lanes {
        0..=8 => scores::<8>(system, parameters, record, starts, weights, colours),
        9..=16 => scores::<16>(system, parameters, record, starts, weights, colours),
        _ => scores::<32>(system, parameters, record, starts, weights, colours),
    };
    let (information, eliminators) = linear.reduced();
    let p = information.nrows();
    let mut b = DMatrix::<f64>::zeros(p, p);
    for (score, eliminator) in scores.iter().zip(&eliminators) {
        b += eliminator * score * eliminator.transpose();
    }
    let scale: Vec<f64> = (0..p).map(|k| if information[(k, k)] > 0.0 { information[(k, k)].sqrt() } else { 0.0 }).collect();
    let scaled = DMatrix::from_fn(p, p, |i, j| {
        let d = scale[i] * scale[j];
        if d > 0.0 { information[(i, j)] / d } else { 0.0 }
    });
    let mut unseen: Vec<Vec<f64>> =
        (0..p).filter(|&k| scale[k] == 0.0).map(|k| (0..p).map(|j| f64::from(u8::from(j == k))).collect()).collect();
    let mut inverse = DMatrix::<f64>::zeros(p, p);
    if p > 0 {
        let eigen = SymmetricEigen::new(scaled);
        let largest = eigen.eigenvalues.iter().copied().max_or_zero();
        for (k, &value) in eigen.eigenvalues.iter().enumerate() {
            let v = eigen.eigenvectors.column(k);
            if value > SINGULAR * largest {
                inverse += v * v.transpose() / value;
            } else if v.iter().zip(&scale).any(|(v, s)| v.abs() > 0.1 && *s > 0.0) {
                unseen.push(v.iter().copied().collect());
            }
        }
    }
    let inverse = DMatrix::from_fn(p, p, |i, j| {
        let d = scale[i] * scale[j];
        if d > 0.0 { inverse[(i, j)] / d } else { 0.0 }
    });
    let matrix = &inverse * b * &inverse;
    let correlation = DMatrix::from_fn(p, p, |i, j| {
        let d = (matrix[(i, i)] * matrix[(j, j)]).sqrt();
        if d > 0.0 { matrix[(i, j)] / d } else { 0.0 }
    });
    Covariance { matrix, unseen, correlation }
}

/// Covariance of the score Σ w J r, per segment.
fn scores<const N: usize>(
    system: &System,
    parameters: &Parameters,
    record: &PreparedLog,
    starts: &InitialStates,
    weights: &[f64],
    colours: &[NoiseColour],
) -> Vec<DMatrix<f64>>
where
    Dual<N>: LawScalar,
{
    let rig = system.rig::<Dual<N>>(parameters, record.driven);
    let free = parameters.free().len();
    let lanes = free + starts.kinds.len();
    let mut all = Vec::with_capacity(record.segments.len());
    for (segment, rows) in record.segments.iter().enumerate() {
        let mut b = [[0.0; N]; N];
        let mut add = |d: &SVector<f64, N>, w: f64| {
            let d = d.as_slice();
            for i in 0..N {
                let wi = w * d[i];
                for j in 0..N {
                    b[i][j] += wi * d[j];
                }
            }
        };
        let mut past: Vec<VecDeque<SVector<f64, N>>> = vec![VecDeque::new(); record.channels.len()];
        run(&rig, record, segment, (&starts.kinds, &starts.values[segment]), free, &mut |channel, row, value: &Dual<N>| {
            let colour = colours[channel];
            let on = !record.held_out(row) && record.target(channel, row, rows.start).is_some();
            let j = if on { value.eps.0.unwrap_or_else(SVector::zeros) } else { SVector::zeros() };
            let w = weights[channel] * colour.inflation;
            if colour.differenced == 0 {
                if on {
                    add(&j, w);
                }
                return true;
            }
            // Noise e_{k−m} enters row k with −1 and row k−m with +1; the noise of the first rows enters once.
            let queue = &mut past[channel];
            if queue.is_empty() {
                queue.extend(std::iter::repeat_n(SVector::zeros(), colour.differenced));
            }
            queue.push_back(j);
            if let Some(before) = queue.pop_front() {
                add(&(before - j), 0.5 * w);
            }
            true
        });
        for (channel, queue) in past.iter().enumerate() {
            for j in queue {
                add(j, 0.5 * weights[channel] * colours[channel].inflation);
            }
        }
        all.push(DMatrix::from_fn(lanes, lanes, |i, j| b[i][j]));
    }
    all
}
