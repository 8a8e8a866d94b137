//! A clutch between motor and platform: rigid up to a torque, beyond which the two slip against each other.
//!
//! Two masses, share r of J at the motor. While the clutch holds they turn as one, and it carries what the platform needs,
//! (1 − r) J ω'. Where that would be more than its limit it slips, and carries the limit, in the direction of the slip, until the rates
//! are the same again.

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Limit that the default stand's usual profiles pass clearly, N m.
pub const SEEN_N_M: (f64, f64) = (8e-4, 2e-3);

/// Its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SlippingClutch {
    /// Largest torque that it carries, N m.
    pub clutch_N_m: f64,
    /// Share of the inertia on the motor's side.
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
