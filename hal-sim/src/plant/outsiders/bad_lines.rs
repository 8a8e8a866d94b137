//! Bad lines of the encoder: in one sector of the disc the angle reading is off by a bump of raised-cosine shape.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Heights of the bump that are clearly visible on the default stand, rad.
pub const TEST_RANGE_RAD: (f64, f64) = (0.01, 0.04);
/// Corresponding widths of the sector, rad.
pub const TEST_WIDTH_RANGE_RAD: (f64, f64) = (0.2, 0.6);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BadLines {
    /// Height of the bump, rad.
    pub lines_rad: f64,
    /// Start of the sector, rad from the index.
    pub from_rad: f64,
    /// Width of the sector, rad.
    pub width_rad: f64,
}

impl Default for BadLines {
    fn default() -> Self {
        BadLines { lines_rad: 0.02, from_rad: 1.0, width_rad: 0.4 }
    }
}

impl BadLines {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("bad-lines", "lines_rad", self.lines_rad, (-0.5, 0.5))?;
        within("bad-lines", "from_rad", self.from_rad, (-1e3, 1e3))?;
        within("bad-lines", "width_rad", self.width_rad, (0.02, TAU))
    }

    /// Error of the angle reading at an angle, rad.
    pub fn error_rad(&self, theta_rad: f64) -> f64 {
        let part = (theta_rad - self.from_rad).rem_euclid(TAU) / self.width_rad;
        if part < 1.0 { 0.5 * self.lines_rad * (1.0 - libm::cos(TAU * part)) } else { 0.0 }
    }
}
