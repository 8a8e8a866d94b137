//! Data of the residual plots: spectrum over the harmonic order, amplitude of one harmonic over rate and current, residual after reversals.

use super::harmonics::{self, Spectrum};
use super::rows::ResidualRows;
use super::{search, shapes};
use crate::identify::fit::FitResult;
use crate::log::Log;
use crate::recording::PreparedLog;
use crate::statistics::Extremes;
use crate::statistics::bins::Bin;

/// Residuals of a log with the coordinates of the plots.
pub struct ResidualPlotData {
    rows: ResidualRows,
    since_reversal_s: Vec<f64>,
}

/// Slices of rate or current for the amplitude of a harmonic.
const SLICES: usize = 14;
/// Least rows of a slice.
const MIN_ROWS: f64 = 200.0;

impl ResidualPlotData {
    /// Plot data of the residuals of `fit`; `None` if nothing was compared.
    pub fn new(log: &Log, data: &PreparedLog, fit: &FitResult) -> Option<ResidualPlotData> {
        let rows = ResidualRows::new(log, data, fit)?;
        let since_reversal_s = if rows.omega.is_empty() { Vec::new() } else { shapes::since_reversal(&rows).1 };
        Some(ResidualPlotData { rows, since_reversal_s })
    }

    /// Spectrum of channel `index` over the harmonic order, with the weight (1/ω, 1, ω, i/ω) that gives the largest peak; `None` for less
    /// than one revolution.
    pub fn spectrum(&self, index: usize) -> Option<Spectrum> {
        let n = self.rows.len();
        let unit = self.rows.channels.get(index)?.unit;
        if self.rows.theta.len() != n || self.rows.omega.len() != n || self.revolutions() < 1.0 {
            return None;
        }
        let y: Vec<f64> = self.rows.y[index * n..(index + 1) * n].iter().map(|y| y * unit).collect();
        let highest = search::highest_order(&self.rows);
        let strongest = |s: &Spectrum| s.fraction.iter().copied().max_or_zero();
        let all = search::weights(&self.rows).into_iter().map(|weight| harmonics::spectrum(&self.rows.theta, &y, weight, highest));
        all.max_by(|a, b| strongest(a).total_cmp(&strongest(b)))
    }

    fn revolutions(&self) -> f64 {
        let (low, high) = self.rows.theta.iter().copied().min_max();
        (high - low) / std::f64::consts::TAU
    }

    /// Amplitude of harmonic `order` in channel `index` over slices of the modelled rate, rad/s.
    pub fn over_rate(&self, index: usize, order: u32) -> Vec<Bin> {
        self.sliced(index, order, &self.rows.omega)
    }

    /// Amplitude of harmonic `order` in channel `index` over slices of the current, A.
    pub fn over_current(&self, index: usize, order: u32) -> Vec<Bin> {
        self.sliced(index, order, &self.rows.current)
    }

    /// Amplitudes with 95 % intervals, which assume white noise besides the harmonic within a slice.
    fn sliced(&self, index: usize, order: u32, along: &[f64]) -> Vec<Bin> {
        let n = self.rows.len();
        let (Some(channel), true) = (self.rows.channels.get(index), along.len() == n && self.rows.theta.len() == n) else {
            return Vec::new();
        };
        let (low, high) = along.iter().copied().min_max();
        let width = (high - low) / SLICES as f64;
        if width.is_nan() || width <= 0.0 {
            return Vec::new();
        }
        // Sums of a regression on 1, cos, sin, and of squares.
        let mut sums = vec![nalgebra::Matrix3::<f64>::zeros(); SLICES];
        let mut right = vec![nalgebra::Vector3::<f64>::zeros(); SLICES];
        let mut squares = [0.0; SLICES];
        for (k, x) in along.iter().enumerate() {
            let slice = (((x - low) / width) as usize).min(SLICES - 1);
            let y = self.rows.y[index * n + k] * channel.unit;
            let (sin, cos) = (f64::from(order) * self.rows.theta[k]).sin_cos();
            let row = nalgebra::Vector3::new(1.0, cos, sin);
            sums[slice] += row * row.transpose();
            right[slice] += row * y;
            squares[slice] += y * y;
        }
        let mut bins = Vec::new();
        for (k, (m, b)) in sums.iter().zip(&right).enumerate() {
            let rows = m[(0, 0)];
            let Some(inverse) = m.try_inverse().filter(|_| rows >= MIN_ROWS) else { continue };
            let x = inverse * b;
            let variance = ((squares[k] - x.dot(b)) / (rows - 3.0)).max(0.0);
            let spread = variance * 0.5 * (inverse[(1, 1)] + inverse[(2, 2)]);
            let confidence = 1.96 * spread.sqrt();
            let amplitude = x[1].hypot(x[2]);
            // Without enough motion within the slice cos, sin and mean are not distinguishable.
            if confidence.is_finite() && inverse[(1, 1)].max(inverse[(2, 2)]) * rows < 20.0 {
                bins.push(Bin { at: low + (k as f64 + 0.5) * width, mean: amplitude, confidence });
            }
        }
        bins
    }

    /// Per row: time since the last reversal or start, s, and residual times the sign of the rate. `None` for fewer than four reversals.
    pub fn after_reversals(&self, index: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let n = self.rows.len();
        let unit = self.rows.channels.get(index)?.unit;
        let reversals = self.since_reversal_s.windows(2).filter(|w| w[1] < w[0]).count();
        if reversals < 4 {
            return None;
        }
        let y = (0..n).map(|k| self.rows.y[index * n + k] * unit * self.rows.omega[k].signum()).collect();
        Some((self.since_reversal_s.clone(), y))
    }
}
