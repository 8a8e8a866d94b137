//! A grinding bearing: an additional Coulomb torque c |x| that varies at random.
//!
//! x is an Ornstein–Uhlenbeck process of unit variance and correlation time τ ([`RandomPath`]).

use serde::{Deserialize, Serialize};

use super::random_path::RandomPath;
use super::{StandError, within};

/// Torques c that are clearly visible on the default stand, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (8e-4, 2e-3);
/// Corresponding correlation times, s.
pub const TEST_RANGE_S: (f64, f64) = (0.05, 0.5);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GrindingBearing {
    /// Root mean square of the additional Coulomb torque, N m.
    pub grinding_N_m: f64,
    /// Correlation time, s.
    pub grinding_s: f64,
    /// Seed of the path.
    pub seed: u64,
}

impl Default for GrindingBearing {
    fn default() -> Self {
        GrindingBearing { grinding_N_m: 1e-3, grinding_s: 0.2, seed: 1 }
    }
}

impl GrindingBearing {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("grinding-bearing", "grinding_N_m", self.grinding_N_m, (0.0, 1e3))?;
        // The draws do not resolve shorter times.
        within("grinding-bearing", "grinding_s", self.grinding_s, (0.01, 1e6))
    }

    /// The additional Coulomb torque over time.
    pub(super) fn path(&self) -> RandomPath {
        RandomPath::folded(self.grinding_N_m, self.grinding_s, self.seed)
    }
}
