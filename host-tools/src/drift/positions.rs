//! Weighted least squares over positions: own drift, g-dependent drift, and the Earth's rotation.
//!
//! In a position turned by ψ, with the sensitive axis raised by ε and rolled by ρ about it (spin axis up at ρ = 0, output axis at 90°):
//! Ω + ω_v sin ε = d₀ + d_I sin ε + d_O cos ε sin ρ + d_S cos ε cos ρ − (C cos ψ − S sin ψ) cos ε, with C = ω_h cos A and S = ω_h sin A. Parameters
//! that the positions do not separate are not fitted: without a roll d_S is part of d₀; two positions 180° apart do not show S, and A follows from C
//! and the latitude.

use super::error::{DriftError, PositionParameter};
use super::estimate::Estimate;
use hal_sim::gyro::Orientation;
use nalgebra::{DMatrix, DVector};

/// Mean rate in one position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionRate {
    /// The position.
    pub position: Orientation,
    /// Ω, rad/s.
    pub rate_rad_s: f64,
    /// Its standard uncertainty, rad/s.
    pub sigma_rad_s: Option<f64>,
}

/// Fit over positions, rad/s and rad/s/g.
#[derive(Debug, Clone, PartialEq)]
pub struct PositionFit {
    /// d₀, with d_S where no roll separates them.
    pub own: Estimate,
    /// d_I, d_O, d_S, where they are fitted.
    pub g_dependent: [Option<Estimate>; 3],
    /// C = ω_h cos A.
    pub cosine: Estimate,
    /// S = ω_h sin A, where the positions show it.
    pub sine: Option<Estimate>,
    /// χ² and its degrees of freedom.
    pub chi2: Option<(f64, usize)>,
}

const PARAMETERS: [PositionParameter; 6] = [
    PositionParameter::OwnDrift,
    PositionParameter::AzimuthCosine,
    PositionParameter::AzimuthSine,
    PositionParameter::GSensitive,
    PositionParameter::GOutput,
    PositionParameter::GSpin,
];
/// Smallest difference of a regressor.
const MIN_DIFFERENCE: f64 = 1e-6;
/// Smallest eigenvalue of the scaled normal equations.
const MIN_EIGENVALUE: f64 = 1e-9;

/// Fits the mean rates; `vertical_rad_s` is the vertical component of the Earth's rotation.
///
/// # Errors
/// Only one position; positions that do not separate the parameters.
pub fn fit(rates: &[PositionRate], vertical_rad_s: f64) -> Result<PositionFit, DriftError> {
    let rows: Vec<[f64; 6]> = rates.iter().map(|rate| regressors(&rate.position)).collect();
    let varies = |column: usize| {
        let of = |row: &[f64; 6]| row[column];
        rows.iter().any(|row| (of(row) - of(&rows[0])).abs() > MIN_DIFFERENCE)
    };
    let is_present = |column: usize| rows.iter().any(|row| row[column].abs() > MIN_DIFFERENCE);
    if !(0..6).any(varies) {
        let [psi, epsilon, rho] =
            rates.first().map_or([0.0; 3], |r| [r.position.turned_rad, r.position.raised_rad, r.position.rolled_rad].map(f64::to_degrees));
        return Err(DriftError::OnePosition { turned_deg: psi, raised_deg: epsilon, rolled_deg: rho });
    }
    // Own drift and C always; the others where the positions show them.
    let fitted: Vec<usize> = (0..6)
        .filter(|column| match column {
            0 | 1 => true,
            5 => varies(5),
            other => is_present(*other),
        })
        .collect();
    let sigmas: Vec<Option<f64>> = rates.iter().map(|rate| rate.sigma_rad_s.filter(|sigma| *sigma > 0.0)).collect();
    let known = sigmas.iter().all(Option::is_some);
    let weight = |k: usize| if known { 1.0 / sigmas[k].unwrap_or(1.0) } else { 1.0 };
    let a = DMatrix::from_fn(rates.len(), fitted.len(), |k, j| rows[k][fitted[j]] * weight(k));
    let b = DVector::from_fn(rates.len(), |k, _| (rates[k].rate_rad_s + vertical_rad_s * rates[k].position.raised_rad.sin()) * weight(k));
    let not_separable =
        || DriftError::NotSeparable { parameters: fitted.iter().map(|column| PARAMETERS[*column]).collect(), positions: rates.len() };
    if rates.len() < fitted.len() {
        return Err(not_separable());
    }
    let normal = a.transpose() * &a;
    let scale: Vec<f64> = (0..fitted.len()).map(|j| normal[(j, j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(fitted.len(), fitted.len(), |i, j| normal[(i, j)] / (scale[i] * scale[j]));
    if scaled.clone().symmetric_eigen().eigenvalues.min() < MIN_EIGENVALUE {
        return Err(not_separable());
    }
    let inverse = scaled.try_inverse().ok_or_else(not_separable)?;
    let covariance = DMatrix::from_fn(fitted.len(), fitted.len(), |i, j| inverse[(i, j)] / (scale[i] * scale[j]));
    let solution = &covariance * (a.transpose() * &b);
    let misfit = (&a * &solution - &b).norm_squared();
    let free = rates.len() - fitted.len();
    let value = |column: usize| {
        fitted.iter().position(|c| *c == column).map(|j| Estimate { value: solution[j], sigma: known.then(|| covariance[(j, j)].sqrt()) })
    };
    let none = Estimate { value: 0.0, sigma: None };
    Ok(PositionFit {
        own: value(0).unwrap_or(none),
        g_dependent: [value(3), value(4), value(5)],
        cosine: value(1).unwrap_or(none),
        sine: value(2),
        chi2: (known && free > 0).then_some((misfit, free)),
    })
}

fn regressors(position: &Orientation) -> [f64; 6] {
    let [input, output, spin] = position.up();
    let level = position.raised_rad.cos();
    [1.0, -position.turned_rad.cos() * level, position.turned_rad.sin() * level, input, output, spin]
}
