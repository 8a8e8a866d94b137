//! Rub in one sector of the turn: additional Coulomb and viscous friction while the platform angle is in the sector.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Additional Coulomb torque that is clearly visible on the default stand and does not block it, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (1e-3, 3e-3);
/// Corresponding width of the sector, rad.
pub const TEST_WIDTH_RANGE_RAD: (f64, f64) = (0.4, 1.2);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SectorRub {
    /// Additional Coulomb torque within the sector, N m.
    pub rub_N_m: f64,
    /// Additional viscous coefficient within the sector, N m s.
    pub rub_N_m_s: f64,
    /// Start of the sector, rad from the index.
    pub from_rad: f64,
    /// Width of the sector, rad.
    pub width_rad: f64,
}

impl Default for SectorRub {
    fn default() -> Self {
        SectorRub { rub_N_m: 1.5e-3, rub_N_m_s: 0.0, from_rad: 1.0, width_rad: 0.6 }
    }
}

impl SectorRub {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("sector-rub", "rub_N_m", self.rub_N_m, (0.0, 1e3))?;
        within("sector-rub", "rub_N_m_s", self.rub_N_m_s, (0.0, 1e3))?;
        within("sector-rub", "from_rad", self.from_rad, (-1e3, 1e3))?;
        // An integration step could skip a narrower sector.
        within("sector-rub", "width_rad", self.width_rad, (0.02, TAU))
    }

    /// Whether the angle is in the sector.
    pub fn holds(&self, theta_rad: f64) -> bool {
        (theta_rad - self.from_rad).rem_euclid(TAU) < self.width_rad
    }
}
