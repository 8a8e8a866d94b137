//! Low-passes without delay: forwards, then backwards.
//!
//! In: evenly spaced numbers and a cutoff as a share of half the sampling rate. Out: as many numbers, at the same instants. A filter is a
//! cascade of second-order sections, made from the analogue poles by the bilinear transform (Oppenheim and Schafer, Discrete-Time
//! Signal Processing, §7.1); its gain at rest is 1. The ends are continued by their mirror image through the last point, and the
//! sections begin settled, so that a constant or a ramp passes unchanged.

use std::f64::consts::PI;

/// One section in the transposed direct form: b over 1 + a z⁻¹ + ….
#[derive(Debug, Clone, Copy)]
struct Section {
    b: [f64; 3],
    a: [f64; 2],
}

/// A low-pass of even order.
#[derive(Debug, Clone)]
pub struct LowPass {
    sections: Vec<Section>,
    /// Points by which the ends are continued.
    reach: usize,
}

/// Periods of the cutoff after which what the ends do has died away: 3, by the slowest pole of either filter.
const REACH_PERIODS: f64 = 3.0;

impl LowPass {
    /// Butterworth's: flat, −3 dB at `share` of half the sampling rate (0 < share < 1); `pairs` conjugate pairs of poles.
    pub fn butterworth(pairs: u32, share: f64) -> LowPass {
        LowPass::from_poles(pairs, share, |angle| (angle.sin(), angle.cos()))
    }

    /// Chebyshev's of the first kind: steeper, with a ripple of `ripple_dB` below `share` of half the sampling rate.
    pub fn chebyshev(pairs: u32, ripple_dB: f64, share: f64) -> LowPass {
        let ripple = (10f64.powf(0.1 * ripple_dB) - 1.0).sqrt();
        let bend = ripple.recip().asinh() / f64::from(2 * pairs);
        LowPass::from_poles(pairs, share, |angle| (bend.sinh() * angle.sin(), bend.cosh() * angle.cos()))
    }

    /// `pole` gives (−real, imaginary) part of the pole at an angle on the circle, for a cutoff of 1 rad/s.
    fn from_poles(pairs: u32, share: f64, pole: impl Fn(f64) -> (f64, f64)) -> LowPass {
        let cutoff = (0.5 * PI * share).tan();
        let section = |k: u32| {
            let (damping, swing) = pole(PI * f64::from(2 * k + 1) / f64::from(4 * pairs));
            let (c1, c0) = (2.0 * damping * cutoff, (damping * damping + swing * swing) * cutoff * cutoff);
            let a0 = 1.0 + c1 + c0;
            let b = c0 / a0;
            Section { b: [b, 2.0 * b, b], a: [2.0 * (c0 - 1.0) / a0, (1.0 - c1 + c0) / a0] }
        };
        LowPass { sections: (0..pairs).map(section).collect(), reach: (2.0 * REACH_PERIODS / share).ceil() as usize }
    }

    /// The series without what is above the cutoff, undelayed.
    pub fn both_ways(&self, x: &[f64]) -> Vec<f64> {
        let (Some(&first), Some(&last)) = (x.first(), x.last()) else { return Vec::new() };
        let reach = self.reach.min(x.len() - 1);
        let before = (1..=reach).rev().map(|k| 2.0 * first - x[k]);
        let after = (1..=reach).map(|k| 2.0 * last - x[x.len() - 1 - k]);
        let mut y: Vec<f64> = before.chain(x.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            for section in &self.sections {
                section.run(&mut y);
            }
            y.reverse();
        }
        y[reach..reach + x.len()].to_vec()
    }
}

impl Section {
    /// Runs over the series in place, settled at its first value.
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

    /// Amplitude of a sine after the filter, in the middle of the series; `share` of half the sampling rate.
    fn gain(filter: &LowPass, share: f64) -> f64 {
        let x: Vec<f64> = (0..4000).map(|k| (PI * share * f64::from(k)).sin()).collect();
        let y = filter.both_ways(&x);
        // Against the sine itself, so that a delay would show as a loss.
        let (xy, xx) = (1000..3000).fold((0.0, 0.0), |(xy, xx), k| (xy + x[k] * y[k], xx + x[k] * x[k]));
        xy / xx
    }

    #[test]
    fn butterworth_halves_the_power_twice_at_its_cutoff_and_delays_nothing() {
        let filter = LowPass::butterworth(2, 0.2);
        // |H|² of two passes: 1/(1 + (tan ω/tan ω_c)⁸), the closed form of order four.
        for share in [0.05f64, 0.1, 0.2, 0.3] {
            let ratio = (0.5 * PI * share).tan() / (0.5 * PI * 0.2).tan();
            let expected = 1.0 / (1.0 + ratio.powi(8));
            assert!((gain(&filter, share) - expected).abs() < 1e-3, "{share}: {} for {expected}", gain(&filter, share));
        }
    }

    #[test]
    fn chebyshev_ripples_as_little_as_it_was_told_and_falls_steeply() {
        let filter = LowPass::chebyshev(4, 0.05, 0.08);
        let ripple = 10f64.powf(0.1 * 0.05) - 1.0;
        // An even order has its gain at rest at the lower end of the ripple; here it is 1, and the peaks lie above.
        for share in [0.01, 0.03, 0.05, 0.07] {
            assert!((0.999..1.001 + ripple).contains(&gain(&filter, share)), "{share}: {}", gain(&filter, share));
        }
        assert!(gain(&filter, 0.12).abs() < 1e-3);
    }

    #[test]
    fn a_ramp_passes_unchanged_up_to_its_ends() {
        let ramp: Vec<f64> = (0..500).map(|k| 3.0 + 0.5 * f64::from(k)).collect();
        let y = LowPass::butterworth(2, 0.1).both_ways(&ramp);
        // What the settled start leaves of a ramp has died away over the continued end: e⁻⁶ per reach, of a lag of some rows.
        assert!(ramp.iter().zip(&y).all(|(a, b)| (a - b).abs() < 0.02), "{:?}", &y[..3]);
    }
}
