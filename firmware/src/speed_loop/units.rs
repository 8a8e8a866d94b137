//! Scales from SI units to the units of the tick.

use super::Settings;
use crate::board::{CONTROL_HZ, Hardware};

/// Scales from SI units to the tick's.
pub(super) struct TickUnits {
    /// One count per tick, rad/s.
    pub rad_s_per_count_tick: f64,
    /// Compare counts per volt.
    pub duty_per_V: f64,
    /// Compare counts per newton metre: R/K.
    pub duty_per_N_m: f64,
}

impl TickUnits {
    pub fn new(s: &Settings, hardware: &Hardware) -> Self {
        let duty_per_V = 1.0 / hardware.volt_per_duty();
        Self {
            rad_s_per_count_tick: hardware.rad_per_count() * CONTROL_HZ as f64,
            duty_per_V,
            duty_per_N_m: s.resistance_ohm / s.motor_constant_N_m_A * duty_per_V,
        }
    }
}
