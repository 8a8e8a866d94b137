//! Positions of a single-axis gyroscope: own drift, g-dependent drift, and the Earth's rotation.
//!
//! In a position turned by ψ, with the sensitive axis raised by ε and rolled by ρ about it (spin axis up at ρ = 0, output axis at 90°): Ω +
//! ω_v sin ε = d₀ + d_I sin ε + d_O cos ε sin ρ + d_S cos ε cos ρ − (C cos ψ − S sin ψ) cos ε, with C = ω_h cos A and S = ω_h sin A.
//! Parameters that the positions do not separate are not fitted: without a roll d_S is part of d₀; two positions 180° apart do not show S,
//! and A follows from C and the latitude.

use super::error::{DriftError, PositionParameter};
use hal_sim::gyro::Orientation;
use identification::statistics::uncertainty::Estimate;
use nalgebra::DMatrix;

/// Results of a fit over positions, rad/s and rad/s/g.
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

/// The parameters that positions determine.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PositionModel {
    fitted: Vec<usize>,
}

impl PositionModel {
    /// The parameters for these positions, each given once.
    ///
    /// # Errors
    /// Only one position; positions that do not separate the parameters.
    pub fn new(positions: &[Orientation]) -> Result<Self, DriftError> {
        let rows: Vec<[f64; 6]> = positions.iter().map(regressors).collect();
        let varies = |column: usize| rows.iter().any(|row| (row[column] - rows[0][column]).abs() > MIN_DIFFERENCE);
        let is_present = |column: usize| rows.iter().any(|row| row[column].abs() > MIN_DIFFERENCE);
        if !(0..6).any(varies) {
            let [turned_deg, raised_deg, rolled_deg] =
                positions.first().map_or([0.0; 3], |p| [p.turned_rad, p.raised_rad, p.rolled_rad].map(f64::to_degrees));
            return Err(DriftError::OnePosition { turned_deg, raised_deg, rolled_deg });
        }
        // Own drift and C always; the others where the positions show them.
        let fitted: Vec<usize> = (0..6)
            .filter(|column| match column {
                0 | 1 => true,
                5 => varies(5),
                other => is_present(*other),
            })
            .collect();
        let model = Self { fitted };
        let normal = DMatrix::from_fn(model.fitted.len(), model.fitted.len(), |i, j| {
            rows.iter().map(|row| row[model.fitted[i]] * row[model.fitted[j]]).sum::<f64>()
        });
        let scaled = DMatrix::from_fn(normal.nrows(), normal.ncols(), |i, j| normal[(i, j)] / (normal[(i, i)] * normal[(j, j)]).sqrt());
        let is_separable = rows.len() >= model.fitted.len() && scaled.symmetric_eigen().eigenvalues.min() >= MIN_EIGENVALUE;
        if !is_separable {
            return Err(model.not_separable(rows.len()));
        }
        Ok(model)
    }

    /// The error of positions that do not separate the parameters.
    pub fn not_separable(&self, positions: usize) -> DriftError {
        DriftError::NotSeparable { parameters: self.fitted.iter().map(|column| PARAMETERS[*column]).collect(), positions }
    }

    /// Regressors of a position, one for each parameter.
    pub fn regressors(&self, position: &Orientation) -> Vec<f64> {
        let all = regressors(position);
        self.fitted.iter().map(|column| all[*column]).collect()
    }

    /// The combination that is one parameter, in the order d₀, C, S, d_I, d_O, d_S; `None` where it is not fitted.
    fn parameter(&self, column: usize) -> Option<Vec<f64>> {
        let place = self.fitted.iter().position(|c| *c == column)?;
        Some((0..self.fitted.len()).map(|k| f64::from(u8::from(k == place))).collect())
    }

    /// d₀.
    pub fn own(&self) -> Vec<f64> {
        self.parameter(0).unwrap_or_default()
    }

    /// C.
    pub fn cosine(&self) -> Vec<f64> {
        self.parameter(1).unwrap_or_default()
    }

    /// S.
    pub fn sine(&self) -> Option<Vec<f64>> {
        self.parameter(2)
    }

    /// d_I, d_O, d_S.
    pub fn g_dependent(&self) -> [Option<Vec<f64>>; 3] {
        [3, 4, 5].map(|column| self.parameter(column))
    }
}

fn regressors(position: &Orientation) -> [f64; 6] {
    let [input, output, spin] = position.up();
    let level = position.raised_rad.cos();
    [1.0, -position.turned_rad.cos() * level, position.turned_rad.sin() * level, input, output, spin]
}
