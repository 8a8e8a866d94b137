//! An oscillating supply: the output of the bridge is u (1 + a sin(2πft + φ)) for the command u.
//!
//! The log contains the command, as always; `supply_V` stays at its mean, because the filter of the supply channel is slower than the
//! oscillation. Only the response of the drive shows the disturbance.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Relative amplitudes that are clearly visible on the default stand.
pub const TEST_RANGE: (f64, f64) = (0.03, 0.1);
/// Frequencies that the drive follows, Hz.
pub const TEST_RANGE_HZ: (f64, f64) = (0.3, 3.0);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HuntingSupply {
    /// Amplitude as a fraction of the supply voltage.
    pub hunting: f64,
    /// Frequency, Hz.
    pub hunting_Hz: f64,
    /// Phase at the start, rad.
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
        // A control tick does not resolve higher frequencies.
        within("hunting-supply", "hunting_Hz", self.hunting_Hz, (0.0, 500.0))?;
        within("hunting-supply", "hunting_phase_rad", self.hunting_phase_rad, (-1e3, 1e3))
    }

    /// Output voltage of the bridge over the commanded voltage.
    pub fn factor(&self, t_s: f64) -> f64 {
        1.0 + self.hunting * libm::sin(TAU * self.hunting_Hz * t_s + self.hunting_phase_rad)
    }
}
