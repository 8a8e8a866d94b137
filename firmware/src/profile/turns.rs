//! Whole turns at a rate, from rest to rest.
//!
//! The rate is defined in continuous time: slope, plateau, slope, with an area of exactly the turns. Each value is the mean over the
//! millisecond before it. So the sum of the values is exact for any timing of the slopes, the plateau has exactly the commanded rate, and
//! all limits are kept.

use core::f64::consts::TAU;

use super::ProfileConfig;
use super::slope::{Slope, SlopeLimits};
use crate::config::{ConfigError, within};

/// Longest duration, s: 11 days.
const MAX_DURATION_S: f64 = 1e6;

#[derive(Clone, Debug)]
pub(super) struct Turns {
    rate_rad_s: f64,
    up: Slope,
    /// Start of the slope down, s.
    down_s: f64,
    done_ms: u64,
}

impl Turns {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Result<Self, ConfigError> {
        if c.offset != 0.0 {
            return Err(ConfigError::Unfit("offset", "must be 0 for turns, which start and end at rest"));
        }
        let limits = SlopeLimits::rounded(c);
        let angle_rad = f64::from(c.turns) * TAU;
        // Slightly below the greatest rate, at which the plateau has no duration.
        let greatest = limits.greatest_level(angle_rad) * (1.0 - 1e-9);
        let rate_rad_s = within("amplitude", amplitude, -greatest, greatest)?;
        let slowest = angle_rad / MAX_DURATION_S;
        if rate_rad_s.abs() < slowest {
            return Err(ConfigError::Unfit("amplitude", "is too low: the turns would take more than 11 days"));
        }
        Ok(Self { rate_rad_s, up: Slope::new(0.0, rate_rad_s, &limits), down_s: angle_rad / rate_rad_s.abs(), done_ms: 0 })
    }

    pub(super) fn next_value(&mut self) -> f64 {
        let [before_s, now_s] = [self.done_ms.saturating_sub(1), self.done_ms].map(|ms| ms as f64 * 1e-3);
        self.done_ms = self.done_ms.saturating_add(1);
        if before_s >= self.up.length_s && now_s <= self.down_s {
            return self.rate_rad_s;
        }
        // From the end of the plateau on the slope up is subtracted.
        let grown = |slope_s: [f64; 2]| (self.up.area(slope_s[1]) - self.up.area(slope_s[0])) * 1e3;
        let up = if before_s < self.up.length_s { grown([before_s, now_s]) } else { self.rate_rad_s };
        let gone_s = [before_s, now_s].map(|t_s| t_s - self.down_s);
        let down = if gone_s[0] < self.up.length_s { grown(gone_s) } else { self.rate_rad_s };
        up - down
    }
}
