//! The incremental encoder and its 16-bit counter.
//!
//! US Digital E6, 5000 lines, all edges counted: 20 000 counts per turn. The count is the number of edges passed, that
//! is the angle rounded *down*. Errors of the disc (eccentricity) belong to the plant.

use stand_firmware::board::{EncoderCount, Hardware};

/// An encoder with this number of counts per turn.
#[derive(Clone, Copy, Debug)]
pub struct Encoder {
    counts_per_rad: f64,
}

impl Encoder {
    /// The encoder of this hardware.
    pub fn new(hardware: &Hardware) -> Self {
        Self { counts_per_rad: 1.0 / hardware.rad_per_count() }
    }

    /// The counter at the angle `theta_rad`.
    #[inline]
    pub fn count(&self, theta_rad: f64) -> EncoderCount {
        EncoderCount(self.whole(theta_rad) as u16)
    }

    /// Edges from angle zero, without wrapping.
    #[inline]
    pub fn whole(&self, theta_rad: f64) -> i64 {
        floor(self.exact(theta_rad))
    }

    /// The angle in counts, not rounded.
    #[inline]
    pub fn exact(&self, theta_rad: f64) -> f64 {
        theta_rad * self.counts_per_rad
    }
}

#[inline]
fn floor(exact: f64) -> i64 {
    let truncated = exact as i64;
    truncated - i64::from((truncated as f64) > exact)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_rounded_down_and_wrap_in_both_directions() {
        let encoder = Encoder::new(&Hardware::default());
        let lsb = Hardware::default().rad_per_count();
        for (counts, expected) in [(0.5, 0), (1.5, 1), (-0.5, -1), (-1.0001, -2), (65_536.5, 0), (-65_535.5, 0)] {
            assert_eq!(encoder.count(counts * lsb).0 as i16, expected, "{counts}");
        }
    }
}
