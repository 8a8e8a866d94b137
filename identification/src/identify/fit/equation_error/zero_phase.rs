//! Zero-phase low-passes: filtered forwards, then backwards.
//!
//! Input: an evenly sampled series and a cutoff relative to half the sampling rate. Output: a series of the same length. A filter is a
//! cascade of second-order sections, from the analogue poles by the bilinear transform (Oppenheim and Schafer, Discrete-Time Signal
//! Processing, §7.1); its DC gain is 1. The ends are extended by point reflection and the sections start settled, so that a constant or a
//! ramp passes unchanged.

use std::f64::consts::PI;

/// Second-order section in transposed direct form II.
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A low-pass of even order.
#[derive(Debug, Clone)]
pub struct LowPass {
    sections: Vec<Section>,
    /// Points by which the ends are extended.
    extension: usize,
}

/// Extension in periods of the cutoff, after which the transients of the slowest pole have decayed.
const EXTENSION_PERIODS: f64 = 3.0;

impl LowPass {
    /// Butterworth filter: −3 dB at `cutoff` relative to half the sampling rate (0 < cutoff < 1), with `pairs` conjugate pairs of poles.
    pub fn butterworth(pairs: u32, cutoff: f64) -> LowPass {
        LowPass::from_poles(pairs, cutoff, |angle| (angle.sin(), angle.cos()))
    }

    /// Chebyshev filter of type I: ripple of `ripple_dB` below `cutoff` relative to half the sampling rate.
    pub fn chebyshev(pairs: u32, ripple_dB: f64, cutoff: f64) -> LowPass {
        let ripple = (10f64.powf(0.1 * ripple_dB) - 1.0).sqrt();
        let eccentricity = ripple.recip().asinh() / f64::from(2 * pairs);
        LowPass::from_poles(pairs, cutoff, |angle| (eccentricity.sinh() * angle.sin(), eccentricity.cosh() * angle.cos()))
    }

    /// Filter from its analogue poles: `pole` gives (−real, imaginary) part of the pole at an angle, for a cutoff of 1 rad/s.
    fn from_poles(pairs: u32, cutoff: f64, pole: impl Fn(f64) -> (f64, f64)) -> LowPass {
        // The bilinear transform maps the cutoff to this analogue frequency.
        let warped = (0.5 * PI * cutoff).tan();
        let section = |k: u32| {
            let (damping, frequency) = pole(PI * f64::from(2 * k + 1) / f64::from(4 * pairs));
            let (c1, c0) = (2.0 * damping * warped, (damping * damping + frequency * frequency) * warped * warped);
            let a0 = 1.0 + c1 + c0;
            let b = c0 / a0;
            Section { b: [b, 2.0 * b, b], a: [2.0 * (c0 - 1.0) / a0, (1.0 - c1 + c0) / a0] }
        };
        LowPass { sections: (0..pairs).map(section).collect(), extension: (2.0 * EXTENSION_PERIODS / cutoff).ceil() as usize }
    }

    /// Filters the series forwards and backwards.
    pub fn filter_both_ways(&self, x: &[f64]) -> Vec<f64> {
        let (Some(&first), Some(&last)) = (x.first(), x.last()) else { return Vec::new() };
        let extension = self.extension.min(x.len() - 1);
        let before = (1..=extension).rev().map(|k| 2.0 * first - x[k]);
        let after = (1..=extension).map(|k| 2.0 * last - x[x.len() - 1 - k]);
        let mut y: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            for section in &self.sections {
                section.run(&mut y);
            }
            y.reverse();
        }
        y[extension..extension + x.len()].to_vec()
    }
}

impl Section {
    /// Filters the series in place, settled at its first value.
    fn run(&self, y: &mut [f64]) {
        let first = y.first().copied().unwrap_or(0.0);
        let mut z = [(1.0 - self.b[0]) * first, (self.b[2] - self.a[1]) * first];
        for y in y {
            let x = *y;
            *y = self.b[0] * x + z[0];
            z = [self.b[1] * x - self.a[0] * *y + z[1], self.b[2] * x - self.a[1] * *y];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Gain for a sine in the middle of the series; `share` of half the sampling rate.
    fn gain(filter: &LowPass, share: f64) -> f64 {
        let x: Vec<f64> = (0..4000).map(|k| (PI * share * f64::from(k)).sin()).collect();
        let y = filter.filter_both_ways(&x);
        // Projection on the input sine: a delay reduces the gain.
        let (xy, xx) = (1000..3000).fold((0.0, 0.0), |(xy, xx), k| (xy + x[k] * y[k], xx + x[k] * x[k]));
        xy / xx
    }

    #[test]
    fn butterworth_gain_is_that_of_order_four_without_delay() {
        let filter = LowPass::butterworth(2, 0.2);
        // |H|² of two passes: 1/(1 + (tan ω/tan ω_c)⁸), the closed form of order four.
        for share in [0.05f64, 0.1, 0.2, 0.3] {
            let ratio = (0.5 * PI * share).tan() / (0.5 * PI * 0.2).tan();
            let expected = 1.0 / (1.0 + ratio.powi(8));
            assert!((gain(&filter, share) - expected).abs() < 1e-3, "{share}: {} for {expected}", gain(&filter, share));
        }
    }

    #[test]
    fn chebyshev_ripple_and_roll_off_are_as_specified() {
        let filter = LowPass::chebyshev(4, 0.05, 0.08);
        let ripple = 10f64.powf(0.1 * 0.05) - 1.0;
        // For an even order the DC gain is the minimum of the ripple, here 1.
        for share in [0.01, 0.03, 0.05, 0.07] {
            assert!((0.999..1.001 + ripple).contains(&gain(&filter, share)), "{share}: {}", gain(&filter, share));
        }
        assert!(gain(&filter, 0.12).abs() < 1e-3);
    }

    #[test]
    fn ramp_passes_unchanged_up_to_its_ends() {
        let ramp: Vec<f64> = (0..500).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        let y = LowPass::butterworth(2, 0.1).filter_both_ways(&ramp);
        // The transient of the settled start decays by e⁻⁶ over the extension.
        assert!(ramp.iter().zip(&y).all(|(a, b)| (a - b).abs() < 0.02), "{:?}", &y[..3]);
    }
}
