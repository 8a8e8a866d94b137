//! Fourier transforms of real series. The only place that plans them: the library's code for all lengths is compiled once.

use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Transforms of one length in both directions, not normalised: the inverse of a transform is the series times its length.
pub struct Transforms {
    forward: Arc<dyn RealToComplex<f64>>,
    inverse: Arc<dyn ComplexToReal<f64>>,
}

impl Transforms {
    /// For series of this length.
    pub fn of_length(length: usize) -> Self {
        let mut planner = RealFftPlanner::<f64>::new();
        Transforms { forward: planner.plan_fft_forward(length), inverse: planner.plan_fft_inverse(length) }
    }

    /// The lines 0 to length/2 of a series, whose values are used as scratch space; empty for a series of another length.
    pub fn forward(&self, series: &mut [f64]) -> Vec<Complex<f64>> {
        let mut lines = self.forward.make_output_vec();
        match self.forward.process(series, &mut lines) {
            Ok(()) => lines,
            Err(_) => Vec::new(),
        }
    }

    /// The series of these lines, times its length; empty for another number of lines. The first and, for an even length, the last line
    /// must be real.
    pub fn inverse(&self, lines: &mut [Complex<f64>]) -> Vec<f64> {
        let mut series = self.inverse.make_output_vec();
        match self.inverse.process(lines, &mut series) {
            Ok(()) => series,
            Err(_) => Vec::new(),
        }
    }
}

/// The lines of a real series; empty for an empty one.
pub fn transform(mut series: Vec<f64>) -> Vec<Complex<f64>> {
    if series.is_empty() { Vec::new() } else { Transforms::of_length(series.len()).forward(&mut series) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_of_a_transform_is_the_series() {
        for length in [2, 30, 37, 64] {
            let series: Vec<f64> = (0..length).map(|k| f64::from(k as u32).sin()).collect();
            let transforms = Transforms::of_length(length);
            let mut lines = transforms.forward(&mut series.clone());
            assert!(
                (lines[1].re
                    - series.iter().enumerate().map(|(k, v)| v * (std::f64::consts::TAU * k as f64 / length as f64).cos()).sum::<f64>())
                .abs()
                    < 1e-12
            );
            let back = transforms.inverse(&mut lines);
            assert!(series.iter().zip(&back).all(|(v, b)| (v - b / length as f64).abs() < 1e-12), "{length}");
        }
        assert!(transform(Vec::new()).is_empty());
    }
}
