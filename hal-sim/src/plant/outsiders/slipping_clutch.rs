//! A clutch between motor and platform: rigid up to a torque limit, slipping beyond.
//!
//! Two masses, fraction r of J at the motor. While the clutch is closed both rotate together and it transmits the torque of the platform,
//! (1 − r) J ω'. Above its limit it slips and transmits the limit in the direction of the slip, until both rates are equal again.

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Limits that the usual profiles of the default stand exceed clearly, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (8e-4, 2e-3);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlippingClutch {
    /// Largest transmitted torque, N m.
    pub clutch_N_m: f64,
    /// Fraction of the inertia on the motor side.
    pub motor_inertia_share: f64,
}

impl Default for SlippingClutch {
    fn default() -> Self {
        SlippingClutch { clutch_N_m: 1.2e-3, motor_inertia_share: 0.3 }
    }
}

impl SlippingClutch {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("slipping-clutch", "clutch_N_m", self.clutch_N_m, (1e-9, 1e3))?;
        within("slipping-clutch", "motor_inertia_share", self.motor_inertia_share, (0.01, 0.99))
    }
}
