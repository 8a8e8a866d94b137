//! What of a residual is worth a picture beside its means: the orders of the angle, how the strongest goes with rate and current, and what
//! follows a reversal.

use super::harmonics::{self, Spectrum};
use super::rows::Rows;
use super::{search, shapes};
use crate::identify::fit::{FitResult, PreparedLog};
use crate::log::Log;
use crate::statistics::Extremes;
use crate::statistics::bins::Bin;

/// A log's residuals, ready for pictures.
pub struct ResidualPlotData {
    rows: Rows,
    since_reversal_s: Vec<f64>,
}

/// Bins of the rate or the current in which an order's amplitude is looked at.
const SLICES: usize = 14;
/// A slice needs some turns of the order to show an amplitude.
const FEWEST: f64 = 200.0;

impl ResidualPlotData {
    /// Of the residuals of `held`; `None` where nothing was compared.
    pub fn of(log: &Log, record: &PreparedLog, held: &FitResult) -> Option<ResidualPlotData> {
        let rows = Rows::of(log, record, held)?;
        let since_reversal_s = if rows.omega.is_empty() { Vec::new() } else { shapes::since_reversal(&rows).1 };
        Some(ResidualPlotData { rows, since_reversal_s })
    }

    /// The spectrum of channel `index` by order of the angle, with the weight (1/ω, 1, ω, i/ω) under which an order stands out most; `None`
    /// without an angle that turns.
    pub fn orders(&self, index: usize) -> Option<Spectrum> {
        let n = self.rows.len();
        let unit = self.rows.channels.get(index)?.unit;
        if self.rows.theta.len() != n || self.rows.omega.len() != n || self.turns() < 1.0 {
            return None;
        }
        let y: Vec<f64> = self.rows.y[index * n..(index + 1) * n].iter().map(|y| y * unit).collect();
        let highest = search::highest(&self.rows);
        let strongest = |s: &Spectrum| s.share.iter().copied().max_or_zero();
        let all = search::weights(&self.rows).into_iter().map(|weight| harmonics::spectrum(&self.rows.theta, &y, weight, highest));
        all.max_by(|a, b| strongest(a).total_cmp(&strongest(b)))
    }

    fn turns(&self) -> f64 {
        let (low, high) = self.rows.theta.iter().copied().min_max();
        (high - low) / std::f64::consts::TAU
    }

    /// Amplitude of `order` in channel `index` over slices of the modelled rate, rad/s.
    pub fn over_rate(&self, index: usize, order: u32) -> Vec<Bin> {
        self.sliced(index, order, &self.rows.omega)
    }

    /// The same over slices of the current, A.
    pub fn over_current(&self, index: usize, order: u32) -> Vec<Bin> {
        self.sliced(index, order, &self.rows.current)
    }

    /// Amplitudes with their 95 % intervals, as if what is left beside the order were white within a slice.
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
            let Some(inverse) = m.try_inverse().filter(|_| rows >= FEWEST) else { continue };
            let x = inverse * b;
            let variance = ((squares[k] - x.dot(b)) / (rows - 3.0)).max(0.0);
            let spread = variance * 0.5 * (inverse[(1, 1)] + inverse[(2, 2)]);
            let confidence = 1.96 * spread.sqrt();
            let amplitude = x[1].hypot(x[2]);
            // A slice in which the angle hardly turned tells nothing.
            if confidence.is_finite() && inverse[(1, 1)].max(inverse[(2, 2)]) * rows < 20.0 {
                bins.push(Bin { at: low + (k as f64 + 0.5) * width, mean: amplitude, confidence });
            }
        }
        bins
    }

    /// Time since the modelled rate last changed its direction or left rest, s, and the residual in the direction of the motion, row by row;
    /// `None` where it never did.
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
