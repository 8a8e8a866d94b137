//! Random numbers of a seed, for the drawn devices.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// A stream of random numbers.
pub(super) struct Draw(Xoshiro256PlusPlus);

impl Draw {
    /// The stream of a seed.
    pub(super) fn new(seed: u64) -> Self {
        Draw(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    /// A seed.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in a range.
    pub(super) fn between(&mut self, (low, high): (f64, f64)) -> f64 {
        low + (high - low) * (self.seed() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Uniform within ± `percent` of 1.
    pub(super) fn factor(&mut self, percent: f64) -> f64 {
        1.0 + percent / 100.0 * self.between((-1.0, 1.0))
    }

    /// Uniform in a range of sizes, with either sign.
    pub(super) fn signed(&mut self, range: (f64, f64)) -> f64 {
        let size = self.between(range);
        if self.between((-1.0, 1.0)) < 0.0 { -size } else { size }
    }

    /// A whole number below `count`.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.between((0.0, 1.0)) * count as f64) as usize).min(count.saturating_sub(1))
    }
}
