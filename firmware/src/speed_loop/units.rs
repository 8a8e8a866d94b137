//! Scales from SI units to the units of the tick.

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
    /// Units of a drive with this ratio of winding resistance and motor constant, V/(N m).
    pub fn new(volt_per_N_m: f64, hardware: &Hardware) -> Self {
        let duty_per_V = 1.0 / hardware.volt_per_duty();
        Self { rad_s_per_count_tick: hardware.rad_per_count() * CONTROL_HZ as f64, duty_per_V, duty_per_N_m: volt_per_N_m * duty_per_V }
    }
}
