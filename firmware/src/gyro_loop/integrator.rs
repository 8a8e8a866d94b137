//! Commutated integrator: exact integer sums over the 2 N + 1 samples of a cycle.
//!
//! Trapezoidal weights, doubled so that they are integers: ACC2 = c₀ + 2 Σ c₁…c₍N−1₎ − 2 Σ c₍N+1₎…c₍2N−1₎ − c₂N. Further sums: without
//! commutation, the current under the triangular weight of the cycle, the moment about the middle (for least squares), and minimum and
//! maximum. They fit 64 bits: 2³¹ codes × 60 000² is 2⁶²·⁷.

use crate::board::GyroSample;

/// Sums of a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// ACC2: twice the commutated integral, codes × samples.
    pub acc2: i64,
    /// The same without commutation: the reference channel.
    pub sum2: i64,
    /// Σ wₙ iₙ with wₙ = 1, 3, 5 … 2N−1, 2N−1 … 3, 1: the torquer's current, codes.
    pub current: i64,
    /// Σ (n − N) cₙ.
    pub moment: i64,
    /// Smallest sample.
    pub min: i32,
    /// Largest sample.
    pub max: i32,
    /// Conversions in each sample of the current.
    pub conversions: u32,
}

/// The integrator during a cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integrator {
    samples: u32,
    count: u32,
    sums: Sums,
}

impl Integrator {
    /// Zeroed, for pulses of `samples` each, 1 to [`MAX_PULSE_SAMPLES`](super::MAX_PULSE_SAMPLES).
    pub fn new(samples: u32) -> Self {
        Self { samples, count: 0, sums: Sums { min: i32::MAX, max: i32::MIN, ..Sums::default() } }
    }

    /// Samples so far.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Adds the next sample. Its current belongs to the interval before, so the first one's is not used.
    pub fn add(&mut self, sample: &GyroSample) {
        let (middle, last) = (self.samples, 2 * self.samples);
        let n = self.count;
        if n > last {
            return;
        }
        let sums = &mut self.sums;
        let code = i64::from(sample.angle);
        let weighted = if n == 0 || n == last { code } else { 2 * code };
        sums.sum2 += weighted;
        sums.acc2 += match n.cmp(&middle) {
            core::cmp::Ordering::Less => weighted,
            core::cmp::Ordering::Equal => 0,
            core::cmp::Ordering::Greater => -weighted,
        };
        sums.moment += (i64::from(n) - i64::from(middle)) * code;
        sums.min = sums.min.min(sample.angle);
        sums.max = sums.max.max(sample.angle);
        if n > 0 {
            let weight = 2 * n.min(last + 1 - n) - 1;
            sums.current += i64::from(weight) * i64::from(sample.torquer);
            sums.conversions = sample.conversions;
        }
        self.count += 1;
    }

    /// The sums so far.
    pub fn partial_sums(&self) -> Sums {
        self.sums
    }

    /// The sums, once the cycle is complete.
    pub fn sums(&self) -> Option<Sums> {
        (self.count == 2 * self.samples + 1).then_some(self.sums)
    }
}
