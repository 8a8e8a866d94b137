//! Covariance of the estimates: the sandwich estimator H⁻¹ B H⁻¹ with the noise colour of each channel.
//!
//! Increments of an angle over m rows, and a rate derived from an encoder, contain differenced white quantisation noise. Their score
//! covariance is exactly B = σ_e² Σ D Dᵀ with D = w(J_k − J_{k+m}). The covariance of other channels is inflated by the autocorrelation of
//! the residual; that of a channel with a misfit by its χ²/n.
//!
//! A direction without information has no finite variance. What moves along it is not determined; a parameter that moves only a little
//! along it still has limits, by the distance over which the others can move: until each of them has changed by its own size. That distance
//! is the standard deviation along the direction, so that no standard error is conditional on a direction that was left out.

use std::collections::VecDeque;

use drive_model::ParameterKind;
use nalgebra::{DMatrix, DVector, SVector, SymmetricEigen};

use super::Unidentifiable;
use super::normal_equations::NormalEquations;
use super::parameters::{Dual, Parameters};
use super::problem::Problem;
use super::simulate::run;
use super::solve::Iterate;
use super::system::FitScalar;
use crate::statistics::Extremes;

/// Colour of the noise of a channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseColour {
    /// Number of rows over which white noise was differenced; 0 if it was not.
    pub differencing_rows: usize,
    /// Inflation of the covariance by autocorrelation and misfit.
    pub inflation: f64,
}

/// Covariance of the free coordinates.
pub struct Covariance {
    /// Covariance matrix.
    pub matrix: DMatrix<f64>,
    /// Directions without information, as unit vectors in the scaled coordinates.
    pub undetermined: Vec<Vec<f64>>,
    /// Correlation matrix.
    pub correlation: DMatrix<f64>,
}

/// Relative eigenvalue of the scaled information matrix below which a direction is undetermined.
const MIN_RELATIVE_EIGENVALUE: f64 = 1e-9;

/// Component of an undetermined direction above which a parameter belongs to the direction.
const MIN_DIRECTION_COMPONENT: f64 = 0.2;
/// Standard error of a positive or fractional parameter, in its logarithmic coordinate, above which it is undetermined.
const MAX_LOGARITHMIC_SIGMA: f64 = 1.0;

impl Covariance {
    /// Parameters that the log does not determine.
    pub(super) fn unidentifiable(&self, parameters: &Parameters) -> Vec<Unidentifiable> {
        let free = parameters.free();
        let name = |index: usize| parameters.list[free[index]].name.clone();
        let mut list: Vec<Unidentifiable> = Vec::new();
        for direction in &self.undetermined {
            let members: Vec<usize> = (0..free.len()).filter(|&k| direction[k].abs() > MIN_DIRECTION_COMPONENT).collect();
            for &member in &members {
                let partner = members.iter().copied().find(|&other| other != member);
                if !list.iter().any(|u| u.parameter == name(member)) {
                    let partner = partner.map(|other| (name(other), -(direction[member] * direction[other]).signum()));
                    list.push(Unidentifiable { parameter: name(member), partner });
                }
            }
        }
        for index in 0..free.len() {
            let p = &parameters.list[free[index]];
            let relative = match p.kind {
                ParameterKind::Positive | ParameterKind::Fraction => self.matrix[(index, index)].sqrt(),
                _ => 0.0,
            };
            if relative > MAX_LOGARITHMIC_SIGMA && !list.iter().any(|u| u.parameter == p.name) {
                let correlation = |other: usize| self.correlation[(index, other)];
                let partner =
                    (0..free.len()).filter(|&other| other != index).max_by(|&a, &b| correlation(a).abs().total_cmp(&correlation(b).abs()));
                list.push(Unidentifiable { parameter: p.name.clone(), partner: partner.map(|other| (name(other), correlation(other))) });
            }
        }
        list
    }
}

/// The covariance at an iterate, with the noise colour of each channel.
pub fn covariance(problem: Problem, iterate: &Iterate, colours: &[NoiseColour], equations: &NormalEquations) -> Covariance {
    let scores = match iterate.parameters.free().len() + iterate.initial_states.kinds.len() {
        0..=8 => scores::<8>(problem, iterate, colours),
        9..=16 => scores::<16>(problem, iterate, colours),
        _ => scores::<32>(problem, iterate, colours),
    };
    from_scores(&scores, equations, &iterate.parameters.coordinate_sizes())
}

/// Blocks into which the rows are divided for [`clustered`], and the length of a block at least, s: longer than a plateau of a usual
/// profile.
const BLOCKS: usize = 24;
const MIN_BLOCK_S: f64 = 1.0;
/// Blocks per parameter at least: from fewer, the estimate scatters by more than the correlation that it is to show.
const MIN_BLOCKS_PER_PARAMETER: usize = 3;

/// The covariance at an iterate from the sums of the score over blocks of rows, which may be correlated within a block in any way
/// (cluster-robust: Liang and Zeger, Biometrika 73 (1986) 13, with the factor G/(G − p) for G blocks and p parameters). `None` where there
/// are too few blocks.
pub fn clustered(problem: Problem, iterate: &Iterate, equations: &NormalEquations) -> Option<Covariance> {
    let free = iterate.parameters.free().len();
    let (scores, blocks) = match free + iterate.initial_states.kinds.len() {
        0..=8 => clustered_scores::<8>(problem, iterate),
        9..=16 => clustered_scores::<16>(problem, iterate),
        _ => clustered_scores::<32>(problem, iterate),
    };
    if blocks < MIN_BLOCKS_PER_PARAMETER * free.max(1) {
        return None;
    }
    let correction = blocks as f64 / (blocks - free) as f64;
    let mut clustered = from_scores(&scores, equations, &iterate.parameters.coordinate_sizes());
    clustered.matrix *= correction;
    Some(clustered)
}

/// Sum over the blocks of the outer products of their scores, by segment; and the number of blocks.
fn clustered_scores<const N: usize>(problem: Problem, iterate: &Iterate) -> (Vec<DMatrix<f64>>, usize)
where
    Dual<N>: FitScalar,
{
    let Problem { system, data, weights } = problem;
    let (parameters, initial_states) = (&iterate.parameters, &iterate.initial_states);
    let rig = system.rig::<Dual<N>>(parameters, data.driven);
    let free = parameters.free().len();
    let unknowns = free + initial_states.kinds.len();
    let rows_of_all: usize = data.segments.iter().map(ExactSizeIterator::len).sum();
    let block_rows = (rows_of_all / BLOCKS).max((MIN_BLOCK_S / data.dt_s) as usize).max(1);
    let (mut all, mut blocks) = (Vec::with_capacity(data.segments.len()), 0);
    for (segment, rows) in data.segments.iter().enumerate() {
        let mut sums = vec![SVector::<f64, N>::zeros(); rows.len().div_ceil(block_rows)];
        let states = (initial_states.kinds.as_slice(), initial_states.values[segment].as_slice());
        run(&rig, data, segment, states, free, &mut |channel, row, value: &Dual<N>| {
            if let Some(target) = data.target(channel, row, rows.start).filter(|_| !data.held_out(row)) {
                sums[(row - rows.start) / block_rows] += SVector::from(value.slopes) * (weights[channel] * (target - value.re));
            }
            true
        });
        blocks += sums.iter().filter(|sum| sum.iter().any(|s| *s != 0.0)).count();
        all.push(DMatrix::from_fn(unknowns, unknowns, |i, j| sums.iter().map(|sum| sum[i] * sum[j]).sum()));
    }
    (all, blocks)
}

/// The sandwich H⁻¹ B H⁻¹ with the covariance of the score by segment. `sizes`: change of each coordinate that is as large as its parameter.
fn from_scores(scores: &[DMatrix<f64>], equations: &NormalEquations, sizes: &[f64]) -> Covariance {
    let (information, eliminators) = equations.reduced();
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
    let mut undetermined: Vec<Vec<f64>> =
        (0..p).filter(|&k| scale[k] == 0.0).map(|k| (0..p).map(|j| f64::from(u8::from(j == k))).collect()).collect();
    let mut inverse = DMatrix::<f64>::zeros(p, p);
    if p > 0 {
        let eigen = SymmetricEigen::new(scaled);
        let largest = eigen.eigenvalues.iter().copied().max_or_zero();
        for (k, &value) in eigen.eigenvalues.iter().enumerate() {
            let v = eigen.eigenvectors.column(k);
            if value > MIN_RELATIVE_EIGENVALUE * largest {
                inverse += v * v.transpose() / value;
            } else if v.iter().zip(&scale).any(|(v, s)| v.abs() > 0.1 && *s > 0.0) {
                undetermined.push(v.iter().copied().collect());
            }
        }
    }
    let inverse = DMatrix::from_fn(p, p, |i, j| {
        let d = scale[i] * scale[j];
        if d > 0.0 { inverse[(i, j)] / d } else { 0.0 }
    });
    let mut matrix = &inverse * b * &inverse;
    for direction in &undetermined {
        let moved = along(direction, &scale, sizes);
        matrix += &moved * moved.transpose();
    }
    let correlation = DMatrix::from_fn(p, p, |i, j| {
        let d = (matrix[(i, i)] * matrix[(j, j)]).sqrt();
        if d > 0.0 { matrix[(i, j)] / d } else { 0.0 }
    });
    Covariance { matrix, undetermined, correlation }
}

/// Change of each coordinate along a direction of the scaled ones, over the longest distance at which a member of the direction has changed
/// by its own size; zero for a coordinate without information at all.
fn along(direction: &[f64], scale: &[f64], sizes: &[f64]) -> DVector<f64> {
    let per_unit = DVector::from_fn(scale.len(), |k, _| if scale[k] > 0.0 { direction[k] / scale[k] } else { 0.0 });
    let is_member = |k: &usize| direction[*k].abs() > MIN_DIRECTION_COMPONENT && per_unit[*k] != 0.0;
    let distance = (0..scale.len()).filter(is_member).map(|k| sizes[k] / per_unit[k].abs()).max_or_zero();
    per_unit * distance
}

/// Covariance of the score Σ w J r, by segment.
fn scores<const N: usize>(problem: Problem, iterate: &Iterate, colours: &[NoiseColour]) -> Vec<DMatrix<f64>>
where
    Dual<N>: FitScalar,
{
    let Problem { system, data, weights } = problem;
    let (parameters, initial_states) = (&iterate.parameters, &iterate.initial_states);
    let rig = system.rig::<Dual<N>>(parameters, data.driven);
    let free = parameters.free().len();
    let unknowns = free + initial_states.kinds.len();
    let mut all = Vec::with_capacity(data.segments.len());
    for (segment, rows) in data.segments.iter().enumerate() {
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
        let mut delayed: Vec<VecDeque<SVector<f64, N>>> = vec![VecDeque::new(); data.channels.len()];
        run(&rig, data, segment, (&initial_states.kinds, &initial_states.values[segment]), free, &mut |channel, row, value: &Dual<N>| {
            let colour = colours[channel];
            let fitted = !data.held_out(row) && data.target(channel, row, rows.start).is_some();
            let j = if fitted { SVector::from(value.slopes) } else { SVector::zeros() };
            let w = weights[channel] * colour.inflation;
            if colour.differencing_rows == 0 {
                if fitted {
                    add(&j, w);
                }
                return true;
            }
            // Noise e_{k−m} enters row k with −1 and row k−m with +1; the noise of the first rows enters once.
            let queue = &mut delayed[channel];
            if queue.is_empty() {
                queue.extend(std::iter::repeat_n(SVector::zeros(), colour.differencing_rows));
            }
            queue.push_back(j);
            if let Some(before) = queue.pop_front() {
                add(&(before - j), 0.5 * w);
            }
            true
        });
        for (channel, queue) in delayed.iter().enumerate() {
            for j in queue {
                add(j, 0.5 * weights[channel] * colours[channel].inflation);
            }
        }
        all.push(DMatrix::from_fn(unknowns, unknowns, |i, j| b[i][j]));
    }
    all
}
