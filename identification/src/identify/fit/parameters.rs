//! Parameters of a fit and their coordinates.
//!
//! The coordinate of a positive parameter is its logarithm, that of a fraction its logit, those of an amplitude with its phase a·cos φ and
//! a·sin φ; that of any other parameter is its value. Results are given for the parameters of the model file.

pub use drive_model::Dual;
use drive_model::{Card, ParameterKind, Scalar};

/// A scalar that carries the derivatives by the unknowns, by index.
pub trait DerivativeScalar: Scalar {
    /// Number of derivatives.
    const DERIVATIVES: usize;
    /// `value` with the derivative `slope` by unknown `index`.
    fn seeded(value: f64, index: usize, slope: f64) -> Self;
    /// Adds `slope` to the derivative by unknown `index`.
    fn with(self, index: usize, slope: f64) -> Self;
    /// Derivative by unknown `index`.
    fn slope(&self, index: usize) -> f64;
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
    fn seeded(value: f64, index: usize, slope: f64) -> Self {
        Dual::<N>::from(value).with(index, slope)
    }
    fn with(mut self, index: usize, slope: f64) -> Self {
        self.slopes[index] += slope;
        self
    }
    fn slope(&self, index: usize) -> f64 {
        self.slopes[index]
    }
}

/// One parameter of a fit.
#[derive(Debug, Clone)]
pub struct Parameter {
    /// Name in the model file, e.g. `cogging_N_m#2`.
    pub name: String,
    /// Value, in the unit of its name.
    pub value: f64,
    /// The fit does not change it.
    pub fixed: bool,
    /// Kind, which determines its coordinate.
    pub kind: ParameterKind,
    /// Physical range.
    pub range: (f64, f64),
    /// Index of the phase of an amplitude, or of the amplitude of a phase.
    pub polar: Option<usize>,
    /// The equations have no meaning below zero; the fit stops there.
    pub limited_at_zero: bool,
    /// The fit keeps it within `range`. Otherwise an estimate may leave the range, which `explain` takes as evidence against an effect.
    pub bounded: bool,
    /// A level of dry friction.
    pub is_dry_friction: bool,
    /// A clearance.
    pub is_clearance: bool,
}

/// All parameters of a model.
#[derive(Debug, Clone, Default)]
pub struct Parameters {
    /// The parameters, in the order of the model.
    pub list: Vec<Parameter>,
}

/// Least value of a positive parameter.
const MIN_POSITIVE: f64 = 1e-12;
/// Least amplitude for the derivatives by a phase.
const MIN_AMPLITUDE: f64 = 1e-12;

impl Parameters {
    /// The parameters, kept within their physical ranges by a fit: its result is then a valid model file.
    pub fn within_physical_ranges(mut self) -> Parameters {
        for p in &mut self.list {
            p.bounded = true;
        }
        self
    }

    /// Indices of the free parameters at an end of the range that the fit keeps.
    pub fn at_bounds(&self) -> Vec<usize> {
        let at_bound = |k: &usize| {
            let p = &self.list[*k];
            let (low, high) = p.limits();
            p.bounded && (p.value <= low || p.value >= high)
        };
        self.free().into_iter().filter(at_bound).collect()
    }

    /// Indices of the free parameters. Their order is that of the coordinates.
    pub fn free(&self) -> Vec<usize> {
        (0..self.list.len()).filter(|&k| self.is_free(k)).collect()
    }

    /// Change of each free coordinate that is as large as its parameter: 1 of a logarithm or a logit, otherwise the value.
    pub fn coordinate_sizes(&self) -> Vec<f64> {
        let size = |k: usize| {
            let p = &self.list[k];
            match p.kind {
                ParameterKind::Positive | ParameterKind::Fraction => 1.0,
                // The phase of a free amplitude has a coordinate of the amplitude's unit.
                ParameterKind::Phase if self.is_polar(k) => self.list[p.polar.unwrap_or(k)].value.abs(),
                _ => p.value.abs(),
            }
        };
        self.free().into_iter().map(size).collect()
    }

    fn is_free(&self, k: usize) -> bool {
        let p = &self.list[k];
        !p.fixed && p.kind != ParameterKind::HarmonicOrder
    }

    /// Amplitude and phase are both free.
    fn is_polar(&self, k: usize) -> bool {
        self.list[k].polar.is_some_and(|partner| self.is_free(k) && self.is_free(partner))
    }

    /// The values with their derivatives by the free coordinates.
    pub fn seeded<S: DerivativeScalar>(&self) -> Vec<S> {
        let free = self.free();
        let mut values: Vec<S> = self.list.iter().map(|p| S::from(p.value)).collect();
        if S::DERIVATIVES == 0 {
            return values;
        }
        for (index, &k) in free.iter().enumerate() {
            for (to, slope) in self.moves(k) {
                values[to] = values[to].with(index, slope);
            }
        }
        values
    }

    /// Parameters that depend on the coordinate of `k`, with the derivatives.
    fn moves(&self, k: usize) -> Vec<(usize, f64)> {
        let p = &self.list[k];
        if self.is_polar(k) {
            let partner = p.polar.unwrap_or(k);
            let (amplitude, phase) = if p.kind == ParameterKind::Phase { (partner, k) } else { (k, partner) };
            let a = self.list[amplitude].value.max(MIN_AMPLITUDE);
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

    /// The parameters after a step of the free coordinates.
    pub fn moved(&self, step: &[f64]) -> Parameters {
        let mut next = self.clone();
        let free = self.free();
        let coordinate_of = |k: usize| free.iter().position(|&f| f == k);
        for (index, &k) in free.iter().enumerate() {
            let p = &self.list[k];
            if self.is_polar(k) {
                if p.kind == ParameterKind::Phase {
                    continue;
                }
                let phase = p.polar.unwrap_or(k);
                let (s, c) = self.list[phase].value.sin_cos();
                let x = p.value * c + step[index];
                let y = p.value * s + coordinate_of(phase).map_or(0.0, |l| step[l]);
                let (_, high) = p.limits();
                next.list[k].value = x.hypot(y).min(high);
                next.list[phase].value = y.atan2(x).rem_euclid(std::f64::consts::TAU);
                continue;
            }
            let value = match p.kind {
                // At most a factor of e² per step.
                ParameterKind::Positive => p.value * step[index].clamp(-2.0, 2.0).exp(),
                ParameterKind::Fraction => {
                    let logit = (p.value / (1.0 - p.value)).ln() + step[index].clamp(-2.0, 2.0);
                    1.0 / (1.0 + (-logit).exp())
                }
                ParameterKind::Phase => (p.value + step[index]).rem_euclid(std::f64::consts::TAU),
                _ => p.value + step[index],
            };
            let (low, high) = p.limits();
            next.list[k].value = value.clamp(low, high);
        }
        next
    }

    /// Coordinates whose parameter is at a limit and would be moved beyond it by `step`.
    pub fn at_limits(&self, step: &[f64]) -> Vec<usize> {
        let free = self.free();
        let outward = |index: &usize| {
            let p = &self.list[free[*index]];
            let (low, high) = p.limits();
            !self.is_polar(free[*index]) && ((p.value <= low && step[*index] < 0.0) || (p.value >= high && step[*index] > 0.0))
        };
        (0..free.len()).filter(outward).collect()
    }

    /// Covariance of all parameters from that of the free coordinates; 0 for fixed parameters.
    pub fn full_covariance(&self, covariance: &nalgebra::DMatrix<f64>) -> nalgebra::DMatrix<f64> {
        let mut slopes = nalgebra::DMatrix::zeros(self.list.len(), covariance.ncols());
        for (index, &k) in self.free().iter().enumerate() {
            for (to, slope) in self.moves(k) {
                slopes[(to, index)] += slope;
            }
        }
        &slopes * covariance * slopes.transpose()
    }

    /// Standard errors of all parameters from the covariance of the free coordinates; 0 for fixed parameters.
    pub fn sigmas(&self, covariance: &nalgebra::DMatrix<f64>) -> Vec<f64> {
        let full = self.full_covariance(covariance);
        (0..self.list.len()).map(|k| full[(k, k)].max(0.0).sqrt()).collect()
    }
}

impl Parameter {
    /// A parameter without a card: any value, fitted by its value.
    pub fn plain(name: String, value: f64) -> Parameter {
        Parameter {
            name,
            value,
            fixed: false,
            kind: ParameterKind::Signed,
            range: (f64::NEG_INFINITY, f64::INFINITY),
            polar: None,
            limited_at_zero: false,
            bounded: false,
            is_dry_friction: false,
            is_clearance: false,
        }
    }

    /// Limits of the fit.
    pub(super) fn limits(&self) -> (f64, f64) {
        match self.kind {
            ParameterKind::Positive => (self.range.0.max(MIN_POSITIVE), self.range.1),
            ParameterKind::Periodicity => self.range,
            // Periodic, or not fitted.
            ParameterKind::Phase | ParameterKind::HarmonicOrder => (f64::NEG_INFINITY, f64::INFINITY),
            _ if self.bounded => self.range,
            // Other coefficients, such as a viscosity, may become negative: this indicates over-fitting.
            _ if self.limited_at_zero => (0.0, self.range.1),
            _ => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// Takes the properties of parameter `index` of an effect.
    pub(super) fn set_properties(&mut self, card: &Card, index: usize) {
        self.limited_at_zero = card.limited_at_zero.contains(&index);
        self.is_dry_friction = card.dry_friction == Some(index);
        self.is_clearance = card.clearance == Some(index);
    }
}
