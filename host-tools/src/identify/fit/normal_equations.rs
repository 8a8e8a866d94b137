//! Normal equations, accumulated while the model runs: an hour's Jacobian would be a gigabyte.
//!
//! The free parameters are common to all segments, the initial states belong to one each; the states are eliminated segment by segment
//! (Schur complement), so that memory and work stay linear in the number of segments.

use drive_rig::Rig;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::parameters::{Dual, Parameters};
use super::prepared_log::PreparedLog;
use super::simulate::{InitialStateKind, LawScalar, System, run};
use crate::statistics::Extremes;

/// Initial states of all segments, and how firmly a start value holds them.
#[derive(Debug, Clone)]
pub struct InitialStates {
    /// Which states.
    pub kinds: Vec<InitialStateKind>,
    /// Values, segment by segment.
    pub values: Vec<Vec<f64>>,
    /// Where they started.
    pub prior: Vec<Vec<f64>>,
    /// Standard deviation of the prior; weak, only there so that an unseen state does not wander off.
    pub prior_sigma: Vec<f64>,
}

/// Normal equations of one segment, in the coordinates [parameters, states].
#[derive(Debug, Clone)]
pub struct SegmentEquations {
    /// Information.
    pub h: DMatrix<f64>,
    /// Gradient of the residual's fit: Σ w J r.
    pub g: DVector<f64>,
}

/// What one channel contributes to one segment, before it is weighted.
#[derive(Debug, Clone)]
struct ChannelSums {
    h: DMatrix<f64>,
    g: DVector<f64>,
    square: f64,
}

/// The model run at one point: its derivatives, not yet weighted, and its residuals.
#[derive(Debug, Clone)]
pub struct Linearization {
    /// Per segment and channel.
    parts: Vec<Vec<ChannelSums>>,
    /// Measured minus modelled per channel and row, held-out rows too; NaN where a row is not compared.
    pub residuals: Vec<Vec<f64>>,
    free: usize,
}

/// The model linearised at one point, with weights.
#[derive(Debug, Clone)]
pub struct NormalEquations {
    /// A block per segment.
    pub blocks: Vec<SegmentEquations>,
    /// Weighted sum of squares, with the prior's.
    pub cost: f64,
    /// Number of free parameters.
    pub free: usize,
}

/// Most lanes that a fit can have: free parameters and initial states of one segment.
pub const MAX_UNKNOWNS: usize = 32;

/// Runs the model with its derivatives at these parameters and states.
pub fn linearize(system: &System, parameters: &Parameters, record: &PreparedLog, starts: &InitialStates) -> Linearization {
    linearize_below(system, parameters, record, starts, &[], f64::INFINITY)
}

/// The same, given up where χ² by `weights` passes `most`: then it is infinite. What diverges is not followed to its end.
pub fn linearize_below(
    system: &System,
    parameters: &Parameters,
    record: &PreparedLog,
    starts: &InitialStates,
    weights: &[f64],
    most: f64,
) -> Linearization {
    let lanes = parameters.free().len() + starts.kinds.len();
    match lanes {
        0..=8 => linearize_in::<8>(system, parameters, record, starts, weights, most),
        9..=12 => linearize_in::<12>(system, parameters, record, starts, weights, most),
        13..=16 => linearize_in::<16>(system, parameters, record, starts, weights, most),
        _ => linearize_in::<32>(system, parameters, record, starts, weights, most),
    }
}

fn linearize_in<const N: usize>(
    system: &System,
    parameters: &Parameters,
    record: &PreparedLog,
    starts: &InitialStates,
    weights: &[f64],
    most: f64,
) -> Linearization
where
    Dual<N>: LawScalar,
{
    let rig = system.rig::<Dual<N>>(parameters, record.driven);
    let free = parameters.free().len();
    let segments: Vec<(Vec<ChannelSums>, Vec<Vec<f64>>)> = (0..record.segments.len())
        .into_par_iter()
        .map(|segment| along_segment(&rig, record, segment, free, (&starts.kinds, &starts.values[segment]), weights, most))
        .collect();
    let mut parts = Vec::with_capacity(segments.len());
    let nowhere = || vec![f64::NAN; record.len()];
    let mut residuals = Vec::new();
    for (rows, (own, found)) in record.segments.iter().zip(segments) {
        parts.push(own);
        if *rows == (0..record.len()) {
            residuals = found;
            continue;
        }
        residuals.resize_with(record.channels.len(), nowhere);
        for (all, found) in residuals.iter_mut().zip(found) {
            all[rows.clone()].copy_from_slice(&found);
        }
    }
    residuals.resize_with(record.channels.len(), nowhere);
    Linearization { parts, residuals, free }
}

/// One segment: what each channel contributes, and its residuals there. Given up where its χ² alone passes `most`: then it is infinite.
fn along_segment<const N: usize>(
    rig: &Rig<Dual<N>>,
    record: &PreparedLog,
    segment: usize,
    free: usize,
    states: (&[InitialStateKind], &[f64]),
    weights: &[f64],
    most: f64,
) -> (Vec<ChannelSums>, Vec<Vec<f64>>) {
    let rows = record.segments[segment].clone();
    let lanes = free + states.0.len();
    let mut residuals = vec![vec![f64::NAN; rows.len()]; record.channels.len()];
    let mut sums = vec![([[0.0; N]; N], [0.0; N], 0.0); record.channels.len()];
    let mut chi2 = 0.0;
    run(rig, record, segment, states, free, &mut |channel, row, value: &Dual<N>| {
        let Some(target) = record.target(channel, row, rows.start) else { return true };
        let r = target - value.re;
        residuals[channel][row - rows.start] = r;
        if record.held_out(row) {
            return true;
        }
        let (h, g, square) = &mut sums[channel];
        *square += r * r;
        chi2 += weights.get(channel).map_or(0.0, |w| w * r * r);
        if chi2 > most {
            *square = f64::INFINITY;
            return false;
        }
        let Some(eps) = value.eps.0.as_ref() else { return true };
        let eps = eps.as_slice();
        for i in 0..lanes {
            let e = eps[i];
            g[i] += e * r;
            // The lower triangle, in whole rows of four so that the compiler makes vectors of it.
            for j in 0..((i | 3) + 1).min(N) {
                h[i][j] += e * eps[j];
            }
        }
        true
    });
    let parts = sums
        .into_iter()
        .map(|(h, g, square)| ChannelSums {
            h: DMatrix::from_fn(lanes, lanes, |i, j| if j <= i { h[i][j] } else { h[j][i] }),
            g: DVector::from_fn(lanes, |i, _| g[i]),
            square,
        })
        .collect();
    (parts, residuals)
}

impl Linearization {
    /// The normal equations with `weights` (1/σ² per channel) and the prior on the states.
    pub fn weighted(&self, starts: &InitialStates, weights: &[f64]) -> NormalEquations {
        let free = self.free;
        let mut cost = 0.0;
        let mut blocks = Vec::with_capacity(self.parts.len());
        for (segment, channels) in self.parts.iter().enumerate() {
            let lanes = free + starts.kinds.len();
            let mut block = SegmentEquations { h: DMatrix::zeros(lanes, lanes), g: DVector::zeros(lanes) };
            for (part, &w) in channels.iter().zip(weights) {
                cost += w * part.square;
                block.h += &part.h * w;
                block.g += &part.g * w;
            }
            for (k, &sigma) in starts.prior_sigma.iter().enumerate() {
                let w = 1.0 / (sigma * sigma);
                let off = starts.prior[segment][k] - starts.values[segment][k];
                cost += w * off * off;
                block.h[(free + k, free + k)] += w;
                block.g[free + k] += w * off;
            }
            blocks.push(block);
        }
        NormalEquations { blocks, cost, free }
    }
}

/// A step of the parameters and of every segment's states.
#[derive(Debug, Clone)]
pub struct Step {
    /// Of the free coordinates.
    pub parameters: Vec<f64>,
    /// Of the states.
    pub states: Vec<Vec<f64>>,
    /// Fall of the cost that the linear model promises.
    pub promised: f64,
}

impl NormalEquations {
    /// The step with Marquardt's damping, in which the `held` lanes do not move; `None` where the equations are singular even so.
    pub fn step(&self, damping: f64, held: &[usize]) -> Option<Step> {
        let p = self.free;
        let mut reduced = DMatrix::<f64>::zeros(p, p);
        let mut right = DVector::<f64>::zeros(p);
        let mut eliminated = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
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
            // A parameter that no row sees stays where it is.
            reduced[(k, k)] += damping * diagonal[k] + 1e-14 * diagonal[k] + if diagonal[k] <= 0.0 { largest.max(1.0) } else { 0.0 };
        }
        for &lane in held {
            for k in 0..p {
                reduced[(lane, k)] = 0.0;
                reduced[(k, lane)] = 0.0;
            }
            reduced[(lane, lane)] = 1.0;
            right[lane] = 0.0;
        }
        let parameters = if p == 0 { DVector::zeros(0) } else { Cholesky::new(reduced)?.solve(&right) };
        let mut promised = 0.0;
        let states: Vec<Vec<f64>> = eliminated
            .iter()
            .map(|(factor, hsp, gs)| {
                let step = factor.solve(&(gs - hsp * &parameters));
                promised += step.dot(gs);
                step.iter().copied().collect()
            })
            .collect();
        for block in &self.blocks {
            promised += parameters.dot(&block.g.rows(0, p).into_owned());
        }
        Some(Step { parameters: parameters.iter().copied().collect(), states, promised })
    }

    fn parameter_diagonal(&self) -> Vec<f64> {
        (0..self.free).map(|k| self.blocks.iter().map(|b| b.h[(k, k)]).sum()).collect()
    }

    /// Information on the parameters and gradient, with the states eliminated.
    pub fn profiled(&self) -> (DMatrix<f64>, DVector<f64>) {
        let (information, eliminators) = self.reduced();
        let mut gradient = DVector::zeros(self.free);
        for (block, eliminator) in self.blocks.iter().zip(&eliminators) {
            gradient += eliminator * &block.g;
        }
        (information, gradient)
    }

    /// Information on the parameters with the states eliminated, and per segment the matrix that eliminates them.
    pub fn reduced(&self) -> (DMatrix<f64>, Vec<DMatrix<f64>>) {
        let p = self.free;
        let mut information = DMatrix::<f64>::zeros(p, p);
        let mut eliminators = Vec::new();
        for block in &self.blocks {
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
