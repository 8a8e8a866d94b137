//! Random levels for random times; excites friction, inertia and asymmetry.
//!
//! Magnitudes are uniform between 15 % and 100 % of the amplitude. The sign changes in most steps, so that zero is crossed often, and every
//! sixth level is zero. Dwells are uniform between 0.5 and 1.5 times their mean.

use super::{ProfileConfig, milliseconds};

#[derive(Clone, Debug)]
pub(super) struct MultiStep {
    amplitude: f64,
    dwell_ms: u32,
    random: SplitMix,
    level: f64,
    left_ms: u32,
    nth: u32,
}

impl MultiStep {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Self {
        Self { amplitude, dwell_ms: milliseconds(c.dwell_s), random: SplitMix(c.seed), level: 0.0, left_ms: 0, nth: 0 }
    }

    pub(super) fn next_value(&mut self) -> f64 {
        if self.left_ms == 0 {
            let size = 0.15 + 0.85 * self.random.unit();
            let back = self.random.unit() < 0.7;
            let sign = if (self.level > 0.0) == back { -1.0 } else { 1.0 };
            self.level = if self.nth == 5 { 0.0 } else { self.amplitude * size * sign };
            self.nth = if self.nth == 5 { 0 } else { self.nth + 1 };
            self.left_ms = ((0.5 + self.random.unit()) * f64::from(self.dwell_ms)) as u32;
        }
        self.left_ms = self.left_ms.saturating_sub(1);
        self.level
    }
}

/// SplitMix64 (Steele, Lea, Flood 2014). A seed must keep its meaning, so this generator must not change.
#[derive(Clone, Debug)]
pub(super) struct SplitMix(pub(super) u64);

impl SplitMix {
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub(super) fn unit(&mut self) -> f64 {
        (self.next() >> 40) as f64 / 16_777_216.0
    }
}
