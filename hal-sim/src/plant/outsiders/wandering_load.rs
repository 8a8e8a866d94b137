//! A load that wanders: a torque on the rotor that is a random walk ([`RandomPath`]).

use serde::{Deserialize, Serialize};

use super::random_path::RandomPath;
use super::{StandError, within};

/// Standard deviations after one second that are clearly visible on the default stand, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (8e-5, 2e-4);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WanderingLoad {
    /// Standard deviation of the torque after one second; it grows with the square root of the time.
    pub wander_N_m: f64,
    /// Seed of the path.
    pub seed: u64,
}

impl Default for WanderingLoad {
    fn default() -> Self {
        WanderingLoad { wander_N_m: 1e-4, seed: 1 }
    }
}

impl WanderingLoad {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("wandering-load", "wander_N_m", self.wander_N_m, (0.0, 1e3))
    }

    /// The torque over time.
    pub(super) fn path(&self) -> RandomPath {
        RandomPath::walk(self.wander_N_m, self.seed)
    }
}
