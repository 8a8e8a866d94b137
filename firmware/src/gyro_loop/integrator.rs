//! The integrator with its switch: sums of whole numbers, exact, over the 2 N + 1 samples of a cycle.
//!
//! With trapezoid weights, all doubled so that they are whole: ACC2 = c₀ + 2 Σ c₁…c₍N−1₎ − 2 Σ c₍N+1₎…c₍2N−1₎ − c₂N (theory.md §3.4). Beside it run
//! the same sum with no switch, the current under the triangular weight of the cycle, the moment about the middle (least squares), and the least and
//! the greatest sample. 64 bits hold them: 2³¹ codes × 60 000² is 2⁶²·⁷.

use crate::board::GyroSample;

/// What a cycle adds up to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// ACC2: twice the switched integral, codes × samples.
    pub acc2: i64,
    /// The same without the switch: the reference channel.
    pub sum2: i64,
    /// Σ wₙ iₙ with wₙ = 1, 3, 5 … 2N−1, 2N−1 … 3, 1: the torquer's current, codes summed as they came.
    pub current: i64,
    /// Σ (n − N) cₙ.
    pub moment: i64,
    /// The least sample.
    pub least: i32,
    /// The greatest.
    pub greatest: i32,
    /// Conversions in each sample of the current.
    pub conversions: u32,
}

/// A cycle under way.
#[derive(Clone, Copy, Debug, Default)]
pub struct Integrator {
    samples: u32,
    taken: u32,
    sums: Sums,
}

impl Integrator {
    /// Zeroed, for pulses of `samples` each, 1 to [`MOST_ROWS`](super::MOST_ROWS).
    pub fn new(samples: u32) -> Self {
        Self { samples, taken: 0, sums: Sums { least: i32::MAX, greatest: i32::MIN, ..Sums::default() } }
    }

    /// How many samples it has taken.
    pub fn taken(&self) -> u32 {
        self.taken
    }

    /// Takes the next sample. The current in it is that of the interval before, so the first one's is nobody's.
    pub fn take(&mut self, sample: &GyroSample) {
        let (middle, last) = (self.samples, 2 * self.samples);
        let n = self.taken;
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
        sums.least = sums.least.min(sample.angle);
        sums.greatest = sums.greatest.max(sample.angle);
        if n > 0 {
            let weight = 2 * n.min(last + 1 - n) - 1;
            sums.current += i64::from(weight) * i64::from(sample.torquer);
            sums.conversions = sample.conversions;
        }
        self.taken += 1;
    }

    /// The sums as they are.
    pub fn so_far(&self) -> Sums {
        self.sums
    }

    /// The sums, once all samples are in.
    pub fn sums(&self) -> Option<Sums> {
        (self.taken == 2 * self.samples + 1).then_some(self.sums)
    }
}
