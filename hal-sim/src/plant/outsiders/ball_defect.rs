//! A damaged rolling element: short friction pulses whose number per turn is not whole, stronger on the loaded side of the bearing.
//!
//! Additional Coulomb torque a (1 + m cos θ) w(ρθ/2π): w is a raised cosine of unit height over a fraction of each period, zero elsewhere.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Heights of the pulses that are clearly visible on the default stand, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (3e-3, 8e-3);
/// Corresponding numbers of pulses per turn.
pub const TEST_RANGE_PER_TURN: (f64, f64) = (2.2, 7.8);
/// Corresponding modulations.
pub const TEST_RANGE_MODULATION: (f64, f64) = (0.3, 1.0);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BallDefect {
    /// Height of a pulse, N m.
    pub ball_N_m: f64,
    /// Pulses per turn.
    pub ball_per_turn: f64,
    /// Width of a pulse as a fraction of the distance between two.
    pub ball_width: f64,
    /// Modulation of the height over the turn.
    pub ball_modulation: f64,
}

impl Default for BallDefect {
    fn default() -> Self {
        BallDefect { ball_N_m: 5e-3, ball_per_turn: 3.57, ball_width: 0.12, ball_modulation: 0.6 }
    }
}

impl BallDefect {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("ball-defect", "ball_N_m", self.ball_N_m, (0.0, 1e3))?;
        within("ball-defect", "ball_per_turn", self.ball_per_turn, (0.1, 100.0))?;
        // An integration step could skip a narrower pulse.
        within("ball-defect", "ball_width", self.ball_width, (0.02, 1.0))?;
        within("ball-defect", "ball_modulation", self.ball_modulation, (0.0, 1.0))
    }

    /// Additional Coulomb torque at an angle, N m.
    pub fn coulomb_N_m(&self, theta_rad: f64) -> f64 {
        let from_center = (self.ball_per_turn * theta_rad / TAU).rem_euclid(1.0) - 0.5;
        if from_center.abs() >= 0.5 * self.ball_width {
            return 0.0;
        }
        let pulse = 0.5 * (1.0 + libm::cos(TAU * from_center / self.ball_width));
        self.ball_N_m * pulse * (1.0 + self.ball_modulation * libm::cos(theta_rad))
    }
}
