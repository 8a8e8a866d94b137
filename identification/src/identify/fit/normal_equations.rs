//! Normal equations, accumulated during the simulation: the Jacobian of an hour would need a gigabyte.
//!
//! The free parameters are common to all segments, the initial states belong to one segment each. The states are eliminated by segment
//! (Schur complement), so that memory and computing time are proportional to the number of segments.

use drive_rig::Rig;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::initial_states::{InitialStateKind, InitialStates};
use super::parameters::{Dual, Parameters};
use super::problem::Problem;
use super::simulate::run;
use super::system::{FitScalar, System};
use crate::recording::prepared_log::PreparedLog;
use crate::statistics::Extremes;

/// Normal equations of one segment, in the coordinates [parameters, states].
#[derive(Debug, Clone)]
pub struct SegmentEquations {
    /// Information matrix, Σ w Jᵀ J.
    pub h: DMatrix<f64>,
    /// Gradient, Σ w Jᵀ r.
    pub g: DVector<f64>,
}

/// Sums of one channel over one segment, not weighted.
#[derive(Debug, Clone)]
struct ChannelSums {
    h: DMatrix<f64>,
    g: DVector<f64>,
    square: f64,
}

/// Residuals and sums of sensitivities at one point, not weighted.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// By segment and channel.
    sums: Vec<Vec<ChannelSums>>,
    /// Measured minus modelled, by channel and row, including held-out rows; NaN in rows without comparison.
    pub residuals: Vec<Vec<f64>>,
    free: usize,
}

/// Weighted normal equations.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    /// Equations of each segment.
    pub segments: Vec<SegmentEquations>,
    /// χ²: weighted sum of squares, including the prior of the initial states.
    pub cost: f64,
    /// Number of free parameters.
    pub free: usize,
}

/// Most unknowns of a fit: free parameters and initial states of one segment.
pub const MAX_UNKNOWNS: usize = 32;

/// Simulates the model with its sensitivities.
pub fn linearize(system: &System, parameters: &Parameters, data: &PreparedLog, initial_states: &InitialStates) -> Linearization {
    linearize_below(Problem { system, data, weights: &[] }, parameters, initial_states, f64::INFINITY)
}

/// Simulates as [`linearize`]; χ² above `max_chi2` ends the simulation with an infinite χ². A diverging simulation thus ends early.
pub fn linearize_below(problem: Problem, parameters: &Parameters, initial_states: &InitialStates, max_chi2: f64) -> Linearization {
    match parameters.free().len() + initial_states.kinds.len() {
        0..=8 => linearize_in::<8>(problem, parameters, initial_states, max_chi2),
        9..=12 => linearize_in::<12>(problem, parameters, initial_states, max_chi2),
        13..=16 => linearize_in::<16>(problem, parameters, initial_states, max_chi2),
        _ => linearize_in::<32>(problem, parameters, initial_states, max_chi2),
    }
}

fn linearize_in<const N: usize>(problem: Problem, parameters: &Parameters, initial_states: &InitialStates, max_chi2: f64) -> Linearization
where
    Dual<N>: FitScalar,
{
    let Problem { system, data, weights } = problem;
    let rig = system.rig::<Dual<N>>(parameters, data.driven);
    let free = parameters.free().len();
    let segments: Vec<(Vec<ChannelSums>, Vec<Vec<f64>>)> = (0..data.segments.len())
        .into_par_iter()
        .map(|segment| {
            let states = (initial_states.kinds.as_slice(), initial_states.values[segment].as_slice());
            linearize_segment(&rig, data, segment, SegmentOptions { free, states, weights, max_chi2 })
        })
        .collect();
    let mut sums = Vec::with_capacity(segments.len());
    let not_compared = || vec![f64::NAN; data.len()];
    let mut residuals = Vec::new();
    for (rows, (segment_sums, segment_residuals)) in data.segments.iter().zip(segments) {
        sums.push(segment_sums);
        if *rows == (0..data.len()) {
            residuals = segment_residuals;
            continue;
        }
        residuals.resize_with(data.channels.len(), not_compared);
        for (all, own) in residuals.iter_mut().zip(segment_residuals) {
            all[rows.clone()].copy_from_slice(&own);
        }
    }
    residuals.resize_with(data.channels.len(), not_compared);
    Linearization { sums, residuals, free }
}

/// Options of [`linearize_segment`].
struct SegmentOptions<'a> {
    /// Number of free parameters.
    free: usize,
    /// Kinds and values of the initial states.
    states: (&'a [InitialStateKind], &'a [f64]),
    /// 1/σ² of each channel.
    weights: &'a [f64],
    /// χ² of the segment above which the simulation ends with an infinite χ².
    max_chi2: f64,
}

/// Sums and residuals of each channel over one segment.
fn linearize_segment<const N: usize>(
    rig: &Rig<Dual<N>>,
    data: &PreparedLog,
    segment: usize,
    options: SegmentOptions,
) -> (Vec<ChannelSums>, Vec<Vec<f64>>) {
    let SegmentOptions { free, states, weights, max_chi2 } = options;
    let rows = data.segments[segment].clone();
    let unknowns = free + states.0.len();
    let mut residuals = vec![vec![f64::NAN; rows.len()]; data.channels.len()];
    let mut sums = vec![([[0.0; N]; N], [0.0; N], 0.0); data.channels.len()];
    let mut chi2 = 0.0;
    run(rig, data, segment, states, free, &mut |channel, row, value: &Dual<N>| {
        let Some(target) = data.target(channel, row, rows.start) else { return true };
        let r = target - value.re;
        residuals[channel][row - rows.start] = r;
        if data.held_out(row) {
            return true;
        }
        let (h, g, square) = &mut sums[channel];
        *square += r * r;
        chi2 += weights.get(channel).map_or(0.0, |w| w * r * r);
        if chi2 > max_chi2 {
            *square = f64::INFINITY;
            return false;
        }
        let slopes = &value.slopes;
        for i in 0..unknowns {
            let e = slopes[i];
            g[i] += e * r;
            // The lower triangle in groups of four columns, which the compiler vectorises.
            for j in 0..((i | 3) + 1).min(N) {
                h[i][j] += e * slopes[j];
            }
        }
        true
    });
    let sums = sums
        .into_iter()
        .map(|(h, g, square)| ChannelSums {
            h: DMatrix::from_fn(unknowns, unknowns, |i, j| if j <= i { h[i][j] } else { h[j][i] }),
            g: DVector::from_fn(unknowns, |i, _| g[i]),
            square,
        })
        .collect();
    (sums, residuals)
}

impl Linearization {
    /// The normal equations with `weights` (1/σ² per channel) and the prior on the states.
    pub fn weighted(&self, initial_states: &InitialStates, weights: &[f64]) -> NormalEquations {
        let free = self.free;
        let mut cost = 0.0;
        let mut segments = Vec::with_capacity(self.sums.len());
        for (segment, channels) in self.sums.iter().enumerate() {
            let unknowns = free + initial_states.kinds.len();
            let mut block = SegmentEquations { h: DMatrix::zeros(unknowns, unknowns), g: DVector::zeros(unknowns) };
            for (sums, &w) in channels.iter().zip(weights) {
                cost += w * sums.square;
                block.h += &sums.h * w;
                block.g += &sums.g * w;
            }
            for (k, &sigma) in initial_states.prior_sigma.iter().enumerate() {
                let w = 1.0 / (sigma * sigma);
                let deviation = initial_states.prior[segment][k] - initial_states.values[segment][k];
                cost += w * deviation * deviation;
                block.h[(free + k, free + k)] += w;
                block.g[free + k] += w * deviation;
            }
            segments.push(block);
        }
        NormalEquations { segments, cost, free }
    }
}

/// A step of the minimisation.
#[derive(Debug, Clone)]
pub struct Step {
    /// Step of the free coordinates.
    pub parameters: Vec<f64>,
    /// Step of the initial states, by segment.
    pub states: Vec<Vec<f64>>,
    /// Decrease of χ² predicted by the linearised model.
    pub predicted_decrease: f64,
}

impl NormalEquations {
    /// Step with Marquardt's damping, without the coordinates `held`; `None` for singular equations.
    pub fn step(&self, damping: f64, held: &[usize]) -> Option<Step> {
        let p = self.free;
        let mut reduced = DMatrix::<f64>::zeros(p, p);
        let mut right = DVector::<f64>::zeros(p);
        let mut eliminated = Vec::with_capacity(self.segments.len());
        for block in &self.segments {
            let s = block.h.nrows() - p;
            reduced += block.h.view((0, 0), (p, p));
            right += block.g.rows(0, p);
            let mut hss = block.h.view((p, p), (s, s)).into_owned();
            for k in 0..s {
                hss[(k, k)] += damping * hss[(k, k)];
            }
            let factor = Cholesky::new(hss)?;
            let hsp = block.h.view((p, 0), (s, p)).into_owned();
            let gs = block.g.rows(p, s).into_owned();
            let solved = factor.solve(&hsp);
            reduced -= hsp.transpose() * &solved;
            right -= solved.transpose() * &gs;
            eliminated.push((factor, hsp, gs));
        }
        let diagonal = self.parameter_diagonal();
        let largest = diagonal.iter().copied().max_or_zero();
        for k in 0..p {
            // A parameter without influence on the outputs is not moved.
            reduced[(k, k)] += damping * diagonal[k] + 1e-14 * diagonal[k] + if diagonal[k] <= 0.0 { largest.max(1.0) } else { 0.0 };
        }
        for &index in held {
            for k in 0..p {
                reduced[(index, k)] = 0.0;
                reduced[(k, index)] = 0.0;
            }
            reduced[(index, index)] = 1.0;
            right[index] = 0.0;
        }
        let parameters = if p == 0 { DVector::zeros(0) } else { Cholesky::new(reduced)?.solve(&right) };
        let mut predicted_decrease = 0.0;
        let states: Vec<Vec<f64>> = eliminated
            .iter()
            .map(|(factor, hsp, gs)| {
                let step = factor.solve(&(gs - hsp * &parameters));
                predicted_decrease += step.dot(gs);
                step.iter().copied().collect()
            })
            .collect();
        for block in &self.segments {
            predicted_decrease += parameters.dot(&block.g.rows(0, p).into_owned());
        }
        Some(Step { parameters: parameters.iter().copied().collect(), states, predicted_decrease })
    }

    /// Diagonal of the information matrix of the parameters.
    fn parameter_diagonal(&self) -> Vec<f64> {
        (0..self.free).map(|k| self.segments.iter().map(|b| b.h[(k, k)]).sum()).collect()
    }

    /// Information matrix and gradient of the parameters, with the initial states eliminated.
    pub fn profiled(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (information, eliminators) = self.reduced();
        let mut gradient = DVector::zeros(self.free);
        for (block, eliminator) in self.segments.iter().zip(&eliminators) {
            gradient += eliminator * &block.g;
        }
        (information, gradient)
    }

    /// Information matrix of the parameters with the initial states eliminated, and the eliminating matrix of each segment.
    pub fn reduced(&self) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
        let p = self.free;
        let mut information = DMatrix::<f64>::zeros(p, p);
        let mut eliminators = Vec::new();
        for block in &self.segments {
            let s = block.h.nrows() - p;
            let hss = block.h.view((p, p), (s, s)).into_owned();
            let hsp = block.h.view((p, 0), (s, p)).into_owned();
            let solved = match Cholesky::new(hss) {
                Some(factor) => factor.solve(&hsp),
                None => DMatrix::zeros(s, p),
            };
            information += block.h.view((0, 0), (p, p)) - hsp.transpose() * &solved;
            let mut eliminator = DMatrix::zeros(p, p + s);
            eliminator.view_mut((0, 0), (p, p)).fill_with_identity();
            eliminator.view_mut((0, p), (p, s)).copy_from(&(-solved.transpose()));
            eliminators.push(eliminator);
        }
        (information, eliminators)
    }
}
