//! Motions of the level of a known shape: what a record contains besides noise, to be subtracted.
//!
//! The unit of time is the row. A curve is stated by its integral, so that the mean over any rows, and the change of an angle, are exact.

use std::f64::consts::TAU;
use std::ops::Range;

/// Shape of a motion of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// exp(−row/rows), from the first row on.
    Exponential {
        /// Time constant, rows.
        rows: f64,
    },
    /// Sine and cosine.
    Sinusoid {
        /// Period, rows.
        rows: f64,
    },
}

/// A motion of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Curve {
    /// Shape.
    pub shape: Shape,
    /// Factors of the shape's columns; 0 for a column that it does not have.
    pub coefficients: [f64; 2],
}

impl Shape {
    /// Number of columns: of its linear coefficients.
    pub fn columns(self) -> usize {
        match self {
            Shape::Exponential { .. } => 1,
            Shape::Sinusoid { .. } => 2,
        }
    }

    /// The same shape with another time constant or period.
    #[must_use]
    pub fn stretched(self, factor: f64) -> Self {
        match self {
            Shape::Exponential { rows } => Shape::Exponential { rows: factor * rows },
            Shape::Sinusoid { rows } => Shape::Sinusoid { rows: factor * rows },
        }
    }

    /// Mean of a column over rows.
    pub fn mean(self, column: usize, rows: &Range<usize>) -> f64 {
        (self.integral(column, rows.end as f64) - self.integral(column, rows.start as f64)) / rows.len() as f64
    }

    /// Integral of a column from 0 to `row`.
    fn integral(self, column: usize, row: f64) -> f64 {
        match self {
            Shape::Exponential { rows } => -rows * (-row / rows).exp_m1(),
            Shape::Sinusoid { rows } => {
                let w = TAU / rows;
                if column == 0 { 2.0 * (0.5 * w * row).sin().powi(2) / w } else { (w * row).sin() / w }
            }
        }
    }
}

impl Curve {
    /// Mean over rows.
    pub fn mean(&self, rows: &Range<usize>) -> f64 {
        self.coefficients.iter().enumerate().take(self.shape.columns()).map(|(column, size)| size * self.shape.mean(column, rows)).sum()
    }

    /// Integral from 0 to `row`.
    pub fn integral(&self, row: usize) -> f64 {
        let columns = self.coefficients.iter().enumerate().take(self.shape.columns());
        columns.map(|(column, size)| size * self.shape.integral(column, row as f64)).sum()
    }

    /// Largest magnitude.
    pub fn size(&self) -> f64 {
        match self.shape {
            Shape::Exponential { .. } => self.coefficients[0],
            Shape::Sinusoid { .. } => self.coefficients[0].hypot(self.coefficients[1]),
        }
    }
}
