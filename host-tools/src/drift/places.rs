//! More than two positions: own drift, what gravity adds to it, and the Earth's rotation, by weighted least squares.
//!
//! In a place turned by ψ, its sensitive axis raised by ε and rolled by ρ about it (spin axis up at ρ = 0, output axis at 90°):
//! Ω + ω_v sin ε = d₀ + d_I sin ε + d_O cos ε sin ρ + d_S cos ε cos ρ − (C cos ψ − S sin ψ) cos ε, with C = ω_h cos A and S = ω_h sin A. What the places do
//! not tell apart is not asked for: without a roll d_S is within d₀, with a turn by 180° alone S is not seen and A comes from C and the latitude.

use super::DriftError;
use hal_sim::gyro::Place;
use nalgebra::{DMatrix, DVector};

/// A number with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Value {
    /// The number.
    pub value: f64,
    /// Its standard error; `None` where nothing tells it.
    pub sigma: Option<f64>,
}

/// A mean rate in a place, rad/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Where.
    pub place: Place,
    /// Ω.
    pub rate_rad_s: f64,
    /// Its standard error.
    pub sigma_rad_s: Option<f64>,
}

/// What comes of them, rad/s and rad/s for each g.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// d₀, and d_S where no roll tells it apart.
    pub own: Value,
    /// d_I, d_O, d_S, where they were asked for.
    pub by_g: [Option<Value>; 3],
    /// C = ω_h cos A.
    pub along: Value,
    /// S = ω_h sin A, where the turns show it.
    pub across: Option<Value>,
    /// Misfit beyond what was fitted: χ² and its degrees of freedom.
    pub chi2: Option<(f64, usize)>,
}

const NAMES: [&str; 6] = [
    "own drift",
    "C = ω_h cos A",
    "S = ω_h sin A",
    "drift by g along the sensitive axis",
    "by g along the output axis",
    "by g along the spin axis",
];
/// Places are the same where their sines are.
const SAME: f64 = 1e-6;

/// Fits the places.
///
/// # Errors
/// Only one place; places that do not separate what they show.
pub fn fit(rates: &[Rate], vertical_rad_s: f64) -> Result<Found, DriftError> {
    let rows: Vec<[f64; 6]> = rates.iter().map(|rate| row(&rate.place)).collect();
    let varies = |column: usize| {
        let of = |row: &[f64; 6]| row[column];
        rows.iter().any(|row| (of(row) - of(&rows[0])).abs() > SAME)
    };
    let shows = |column: usize| rows.iter().any(|row| row[column].abs() > SAME);
    if !(0..6).any(varies) {
        let [psi, epsilon, rho] =
            rates.first().map_or([0.0; 3], |r| [r.place.turned_rad, r.place.raised_rad, r.place.rolled_rad].map(f64::to_degrees));
        return Err(DriftError::NoTurn { position: format!("turned {psi}°, raised {epsilon}°, rolled {rho}°") });
    }
    // The own drift and C always; the others where the places show them.
    let asked: Vec<usize> = (0..6)
        .filter(|column| match column {
            0 | 1 => true,
            5 => varies(5),
            other => shows(*other),
        })
        .collect();
    let sigmas: Vec<Option<f64>> = rates.iter().map(|rate| rate.sigma_rad_s.filter(|sigma| *sigma > 0.0)).collect();
    let known = sigmas.iter().all(Option::is_some);
    let weight = |k: usize| if known { 1.0 / sigmas[k].unwrap_or(1.0) } else { 1.0 };
    let a = DMatrix::from_fn(rates.len(), asked.len(), |k, j| rows[k][asked[j]] * weight(k));
    let b = DVector::from_fn(rates.len(), |k, _| (rates[k].rate_rad_s + vertical_rad_s * rates[k].place.raised_rad.sin()) * weight(k));
    let too_few = || {
        let what = asked.iter().map(|column| NAMES[*column]).collect::<Vec<_>>().join(", ");
        DriftError::Positions { what, hint: format!("{} positions; add others, turned, rolled or raised otherwise", rates.len()) }
    };
    if rates.len() < asked.len() {
        return Err(too_few());
    }
    let normal = a.transpose() * &a;
    let scale: Vec<f64> = (0..asked.len()).map(|j| normal[(j, j)].sqrt()).collect();
    let scaled = DMatrix::from_fn(asked.len(), asked.len(), |i, j| normal[(i, j)] / (scale[i] * scale[j]));
    if scaled.clone().symmetric_eigen().eigenvalues.min() < 1e-9 {
        return Err(too_few());
    }
    let inverse = scaled.try_inverse().ok_or_else(too_few)?;
    let covariance = DMatrix::from_fn(asked.len(), asked.len(), |i, j| inverse[(i, j)] / (scale[i] * scale[j]));
    let solution = &covariance * (a.transpose() * &b);
    let misfit = (&a * &solution - &b).norm_squared();
    let free = rates.len() - asked.len();
    let value = |column: usize| {
        asked.iter().position(|c| *c == column).map(|j| Value { value: solution[j], sigma: known.then(|| covariance[(j, j)].sqrt()) })
    };
    let none = Value { value: 0.0, sigma: None };
    Ok(Found {
        own: value(0).unwrap_or(none),
        by_g: [value(3), value(4), value(5)],
        along: value(1).unwrap_or(none),
        across: value(2),
        chi2: (known && free > 0).then_some((misfit, free)),
    })
}

fn row(place: &Place) -> [f64; 6] {
    let [input, output, spin] = place.up();
    let level = place.raised_rad.cos();
    [1.0, -place.turned_rad.cos() * level, place.turned_rad.sin() * level, input, output, spin]
}
