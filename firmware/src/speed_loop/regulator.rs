//! Regulator: PI on the rate, as a gain on the rate error and one on the position error, which is its integral; then current and voltage limit.
//!
//! The integral cannot wind up: the ramp slips where the platform does not follow ([`super::ramp`]).

use crate::status::Limits;

/// Gains and limits in compare counts of the bridge.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    /// Per count per tick of rate error.
    pub rate_gain: f32,
    /// Per count of position error.
    pub position_gain: f32,
    /// Back-EMF per count per tick.
    pub back_emf: f32,
    /// Voltage of the current limit over the winding's resistance.
    pub current_limit: f32,
    /// Voltage limit.
    pub voltage_limit: f32,
}

impl Config {
    /// Compare counts for a position error (counts) and a rate error (counts per tick).
    #[inline]
    pub fn regulate(&self, position_error: f32, rate_error: f32) -> f32 {
        self.position_gain * position_error + self.rate_gain * rate_error
    }

    /// `duty` within the limits of current and voltage at this rate (counts per tick). Limits in force are set in `limits`.
    #[inline]
    pub fn limit(&self, duty: f32, rate: f32, limits: &mut Limits) -> f32 {
        let back_emf = self.back_emf * rate;
        let resistive_drop = duty - back_emf;
        let mut limited = duty;
        if resistive_drop.abs() > self.current_limit {
            limited = back_emf + self.current_limit.copysign(resistive_drop);
            limits.set(Limits::CURRENT, true);
        }
        if limited.abs() > self.voltage_limit {
            limited = self.voltage_limit.copysign(limited);
            limits.set(Limits::VOLTAGE, true);
        }
        limited
    }
}
