//! A rate sensor with hysteresis: its reading follows the rate only after the rate has moved by more than a half-width (play operator;
//! Visintin, Differential Models of Hysteresis (1994), ch. III).

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Half-widths that are clearly visible on the default stand, rad/s.
pub const TEST_RANGE_RAD_S: (f64, f64) = (0.1, 0.4);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StickyRateSensor {
    /// Half-width of the play, rad/s.
    pub sticks_rad_s: f64,
}

impl Default for StickyRateSensor {
    fn default() -> Self {
        StickyRateSensor { sticks_rad_s: 0.2 }
    }
}

impl StickyRateSensor {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("sticky-rate-sensor", "sticks_rad_s", self.sticks_rad_s, (0.0, 1e3))
    }

    /// The next reading, rad/s.
    pub fn reading_rad_s(&self, rate_rad_s: f64, last_rad_s: f64) -> f64 {
        last_rad_s.clamp(rate_rad_s - self.sticks_rad_s, rate_rad_s + self.sticks_rad_s)
    }
}
