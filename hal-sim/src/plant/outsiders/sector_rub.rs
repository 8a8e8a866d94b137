//! A rub in one sector of the turn: more dry and viscous friction while the platform's angle is within it.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Dry level that is clearly seen on the default stand and does not hold it for good, N m.
pub const SEEN_N_M: (f64, f64) = (1e-3, 3e-3);
/// Width of the sector that goes with it, rad.
pub const SEEN_WIDTH_RAD: (f64, f64) = (0.4, 1.2);

/// Its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SectorRub {
    /// Dry level that comes on top within the sector, N m.
    pub rub_N_m: f64,
    /// Viscous coefficient that comes on top within the sector, N m s.
    pub rub_N_m_s: f64,
    /// Where the sector begins, rad from the index.
    pub from_rad: f64,
    /// How wide it is, rad.
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
        // A narrower one could be passed between two steps.
        within("sector-rub", "width_rad", self.width_rad, (0.02, TAU))
    }

    /// The angle lies in the sector.
    pub fn holds(&self, theta_rad: f64) -> bool {
        (theta_rad - self.from_rad).rem_euclid(TAU) < self.width_rad
    }
}
