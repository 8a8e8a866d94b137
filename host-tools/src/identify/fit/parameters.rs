//! The parameters of a fit: what is free, and in which coordinates it moves.
//!
//! A positive parameter moves by its logarithm, a share by its logit, an amplitude with its phase as a·cos φ and a·sin φ; the rest as
//! it is. The answers are always in the parameters of the model file.

use drive_model::{ParameterKind, Scalar};
use nalgebra::SVector;
use num_dual::{Derivative, DualSVec64};

/// A dual number with `N` derivatives.
pub type Dual<const N: usize> = DualSVec64<N>;

/// A number that may carry the derivative by one lane.
pub trait DerivativeScalar: Scalar {
    /// Derivatives it carries.
    const DERIVATIVES: usize;
    /// `value` with derivative `slope` by `lane`.
    fn seeded(value: f64, lane: usize, slope: f64) -> Self;
    /// Adds `slope` to the derivative by `lane`.
    fn with(self, lane: usize, slope: f64) -> Self;
    /// Derivative by `lane`.
    fn slope(&self, lane: usize) -> f64;
}

impl DerivativeScalar for f64 {
    const DERIVATIVES: usize = 0;
    fn seeded(value: f64, _: usize, _: f64) -> Self {
        value
    }
    fn with(self, _: usize, _: f64) -> Self {
        self
    }
    fn slope(&self, _: usize) -> f64 {
        0.0
    }
}

impl<const N: usize> DerivativeScalar for Dual<N> {
    const DERIVATIVES: usize = N;
    fn seeded(value: f64, lane: usize, slope: f64) -> Self {
        Dual::<N>::from(value).with(lane, slope)
    }
    fn with(mut self, lane: usize, slope: f64) -> Self {
        let mut eps = self.eps.0.unwrap_or_else(SVector::zeros);
        eps[lane] += slope;
        self.eps = Derivative::some(eps);
        self
    }
    fn slope(&self, lane: usize) -> f64 {
        self.eps.0.map_or(0.0, |eps| eps[lane])
    }
}

/// One parameter of the model, as the fit holds it.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name in the model file, e.g. `cogging_N_m#2`.
    pub name: String,
    /// Value, in its own unit.
    pub value: f64,
    /// Not moved.
    pub fixed: bool,
    /// How it moves.
    pub kind: ParameterKind,
    /// Physical range.
    pub range: (f64, f64),
    /// Index of its partner, where the two are amplitude and phase; the amplitude names the phase and the phase the amplitude.
    pub polar: Option<usize>,
}

/// All parameters of a model.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    /// In the model's order.
    pub list: Vec<Parameter>,
}

/// Least value of a positive parameter: below it nothing that turns.
const LEAST: f64 = 1e-12;
/// Smallest amplitude, relative to one unit, at which a phase still has a direction.
const SMALLEST_AMPLITUDE: f64 = 1e-12;

impl Parameters {
    /// Indices of the free parameters; a lane of the fit each.
    pub fn free(&self) -> Vec<usize> {
        (0..self.list.len()).filter(|&k| self.is_free(k)).collect()
    }

    fn is_free(&self, k: usize) -> bool {
        let p = &self.list[k];
        !p.fixed && p.kind != ParameterKind::HarmonicOrder
    }

    /// Both of an amplitude and its phase are free.
    fn is_polar(&self, k: usize) -> bool {
        self.list[k].polar.is_some_and(|partner| self.is_free(k) && self.is_free(partner))
    }

    /// The values with the derivatives of the free ones by their coordinates.
    pub fn seeded<S: DerivativeScalar>(&self) -> Vec<S> {
        let free = self.free();
        let mut values: Vec<S> = self.list.iter().map(|p| S::from(p.value)).collect();
        if S::DERIVATIVES == 0 {
            return values;
        }
        for (lane, &k) in free.iter().enumerate() {
            for (to, slope) in self.moves(k) {
                values[to] = values[to].with(lane, slope);
            }
        }
        values
    }

    /// Which parameters the coordinate of `k` moves, and how fast.
    fn moves(&self, k: usize) -> Vec<(usize, f64)> {
        let p = &self.list[k];
        if self.is_polar(k) {
            let partner = p.polar.unwrap_or(k);
            let (amplitude, phase) = if p.kind == ParameterKind::Phase { (partner, k) } else { (k, partner) };
            let a = self.list[amplitude].value.max(SMALLEST_AMPLITUDE);
            let (s, c) = self.list[phase].value.sin_cos();
            return if k == amplitude { vec![(amplitude, c), (phase, -s / a)] } else { vec![(amplitude, s), (phase, c / a)] };
        }
        let slope = match p.kind {
            ParameterKind::Positive => p.value,
            ParameterKind::Fraction => p.value * (1.0 - p.value),
            _ => 1.0,
        };
        vec![(k, slope)]
    }

    /// The parameters after a move of the free coordinates by `step`.
    pub fn moved(&self, step: &[f64]) -> Parameters {
        let mut next = self.clone();
        let free = self.free();
        let lane_of = |k: usize| free.iter().position(|&f| f == k);
        for (lane, &k) in free.iter().enumerate() {
            let p = &self.list[k];
            if self.is_polar(k) {
                if p.kind == ParameterKind::Phase {
                    continue;
                }
                let phase = p.polar.unwrap_or(k);
                let (s, c) = self.list[phase].value.sin_cos();
                let x = p.value * c + step[lane];
                let y = p.value * s + lane_of(phase).map_or(0.0, |l| step[l]);
                next.list[k].value = x.hypot(y);
                next.list[phase].value = y.atan2(x).rem_euclid(std::f64::consts::TAU);
                continue;
            }
            let value = match p.kind {
                // No more than a factor of e² in one step.
                ParameterKind::Positive => (p.value * step[lane].clamp(-2.0, 2.0).exp()).clamp(p.range.0.max(LEAST), p.range.1),
                ParameterKind::Fraction => {
                    let logit = (p.value / (1.0 - p.value)).ln() + step[lane].clamp(-2.0, 2.0);
                    1.0 / (1.0 + (-logit).exp())
                }
                ParameterKind::Phase => (p.value + step[lane]).rem_euclid(std::f64::consts::TAU),
                _ => p.value + step[lane],
            };
            let (low, high) = hard_limits(p);
            next.list[k].value = value.clamp(low, high);
        }
        next
    }

    /// Lanes whose parameter stands at the end of what it can be, with a step that would carry it further.
    pub fn against_a_limit(&self, step: &[f64]) -> Vec<usize> {
        let free = self.free();
        let outward = |lane: &usize| {
            let p = &self.list[free[*lane]];
            let (low, high) = match p.kind {
                ParameterKind::Positive => (p.range.0.max(LEAST), p.range.1),
                _ => hard_limits(p),
            };
            !self.is_polar(free[*lane]) && ((p.value <= low && step[*lane] < 0.0) || (p.value >= high && step[*lane] > 0.0))
        };
        (0..free.len()).filter(outward).collect()
    }

    /// Standard errors of the parameters, in the list's order, from the covariance of the coordinates (row-major, square); 0 where fixed.
    pub fn sigmas(&self, covariance: &nalgebra::DMatrix<f64>) -> Vec<f64> {
        let mut slopes = nalgebra::DMatrix::zeros(self.list.len(), covariance.ncols());
        for (lane, &k) in self.free().iter().enumerate() {
            for (to, slope) in self.moves(k) {
                slopes[(to, lane)] += slope;
            }
        }
        let full = &slopes * covariance * slopes.transpose();
        (0..self.list.len()).map(|k| full[(k, k)].max(0.0).sqrt()).collect()
    }
}

/// Where the equations themselves end; the physical range may be narrower, and a fit that leaves it says so.
fn hard_limits(p: &Parameter) -> (f64, f64) {
    // Dry levels, drops and gaps have no meaning below zero; a viscosity has (the over-fit trap of a cubic drag shows by it).
    let has_no_negative = ["coulomb_N_m", "stribeck_N_m", "brush_V", "dead_time_V", "gap_rad", "shaft_N_m_s_rad", "lag_s", "skew_s"];
    let stem = p.name.split('#').next().unwrap_or(&p.name);
    if has_no_negative.contains(&stem) { (0.0, p.range.1) } else { (f64::NEG_INFINITY, f64::INFINITY) }
}
