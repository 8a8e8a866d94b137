//! A supply that swings: the bridge gives u (1 + a sin(2πft + φ)) where u was asked for.
//!
//! The log shows what was asked for, as always; `supply_V` stays at its mean, because the converter of the supply is filtered more slowly
//! than it swings. So nothing in the log but the drive itself shows it.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Part of the supply by which it swings that is clearly seen on the default stand.
pub const SEEN: (f64, f64) = (0.03, 0.1);
/// How fast, Hz: within what the drive follows.
pub const SEEN_HZ: (f64, f64) = (0.3, 3.0);

/// Its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HuntingSupply {
    /// Amplitude as a part of the supply.
    pub hunting: f64,
    /// Frequency, Hz.
    pub hunting_Hz: f64,
    /// Phase at the beginning, rad.
    pub hunting_phase_rad: f64,
}

impl Default for HuntingSupply {
    fn default() -> Self {
        HuntingSupply { hunting: 0.05, hunting_Hz: 0.8, hunting_phase_rad: 0.0 }
    }
}

impl HuntingSupply {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("hunting-supply", "hunting", self.hunting, (0.0, 0.9))?;
        // Beyond, a control tick would no longer resolve it.
        within("hunting-supply", "hunting_Hz", self.hunting_Hz, (0.0, 500.0))?;
        within("hunting-supply", "hunting_phase_rad", self.hunting_phase_rad, (-1e3, 1e3))
    }

    /// What the bridge gives of what was asked for.
    pub fn factor(&self, t_s: f64) -> f64 {
        1.0 + self.hunting * (TAU * self.hunting_Hz * t_s + self.hunting_phase_rad).sin()
    }
}
