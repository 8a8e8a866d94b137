//! Whole turns at a rate: from rest to rest, and the angle is the same again.
//!
//! The way is worked out in continuous time: up, plateau, down, its area the turns exactly. Each value is that area's growth over the
//! millisecond that ends there. So the sum of the values is the area whatever its corners fall on, the plateau has exactly the rate
//! that was asked for, and averaging over a millisecond keeps every limit.

use core::f64::consts::TAU;

use super::ProfileConfig;
use super::slope::{Hold, Slope};
use crate::config::{ConfigError, within};

/// Longest run, s: 11 days.
const LONGEST_S: f64 = 1e6;

#[derive(Clone, Debug)]
pub(super) struct Turns {
    rate_rad_s: f64,
    up: Slope,
    /// When it begins to go down, s.
    down_s: f64,
    done_ms: u64,
}

impl Turns {
    pub(super) fn new(amplitude: f64, c: &ProfileConfig) -> Result<Self, ConfigError> {
        if c.offset != 0.0 {
            return Err(ConfigError::Unfit("offset", "must be 0 for turns, which begin and end at rest"));
        }
        let hold = Hold::rounded(c);
        let angle_rad = f64::from(c.turns) * TAU;
        // A little below: at the greatest rate itself the plateau has no length, and rounding decides.
        let greatest = hold.greatest_within(angle_rad) * (1.0 - 1e-9);
        let rate_rad_s = within("amplitude", amplitude, -greatest, greatest)?;
        let slowest = angle_rad / LONGEST_S;
        if rate_rad_s.abs() < slowest {
            return Err(ConfigError::Unfit("amplitude", "is so slow that the turns would take more than 11 days"));
        }
        Ok(Self { rate_rad_s, up: Slope::new(0.0, rate_rad_s, &hold), down_s: angle_rad / rate_rad_s.abs(), done_ms: 0 })
    }

    pub(super) fn next_value(&mut self) -> f64 {
        let [before_s, now_s] = [self.done_ms.saturating_sub(1), self.done_ms].map(|ms| ms as f64 * 1e-3);
        self.done_ms = self.done_ms.saturating_add(1);
        if before_s >= self.up.length_s && now_s <= self.down_s {
            return self.rate_rad_s;
        }
        // From the end of the plateau on the way up comes again, taken away.
        let grown = |slope_s: [f64; 2]| (self.up.area(slope_s[1]) - self.up.area(slope_s[0])) * 1e3;
        let up = if before_s < self.up.length_s { grown([before_s, now_s]) } else { self.rate_rad_s };
        let gone_s = [before_s, now_s].map(|t_s| t_s - self.down_s);
        let down = if gone_s[0] < self.up.length_s { grown(gone_s) } else { self.rate_rad_s };
        up - down
    }
}
