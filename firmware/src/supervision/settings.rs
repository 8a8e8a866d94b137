//! Thresholds of supervision, in SI units, checked by name.

use crate::board::Hardware;
use crate::config::{ConfigError, all_within};

/// Fraction of the converter's range up to which a reading is valid.
const CONVERTER_RANGE: f64 = 0.98;

/// Thresholds. The default suits the default stand: maxon RE 25, 1.3 A of current limit, 12 V.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Motor current above which the drive is switched off within 0.4 ms, A; at most the converter's range.
    pub over_current_A: f64,
    /// Current, or voltage / resistance, at which a motor at rest is stalled, A.
    pub stall_current_A: f64,
    /// Time for which it may be at rest with that current, s.
    pub stall_s: f64,
    /// Rate by back-EMF at which edges must come, rad/s; a fifth of R·i is added for the tolerance of the resistance. At least three times
    /// as much if the count stopped slowly or never moved: brushes and dead time look like back-EMF.
    pub encoder_lost_rad_s: f64,
    /// Time for which the back-EMF may show rotation without edges, s.
    pub encoder_lost_s: f64,
    /// Lowest supply while the drive is on, as a fraction of the nominal supply.
    pub supply_low_share: f64,
    /// Highest supply while the drive is on, as a fraction of the nominal supply.
    pub supply_high_share: f64,
    /// Time for which the ramp may slip without interruption, s.
    pub tracking_s: f64,
    /// Highest temperature of the winding, °C.
    pub temperature_C: f64,
    /// Time for which a detected sensor may deliver nothing, s.
    pub sensor_silent_s: f64,
    /// Tolerance of the index, counts from a whole turn after the last one.
    pub index_off_counts: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            over_current_A: 1.6,     // the limit is 1.3, the converter ends at 1.65
            stall_current_A: 1.0,    // three quarters of the limit: 23 mN m, twenty-five times the default stand's friction
            stall_s: 0.5,            // 1.7 A² × 2.32 Ω × 0.5 s is 2 J: half a kelvin in the winding
            encoder_lost_rad_s: 5.0, // 0.12 V of back-EMF; the current's noise makes 0.03 V
            encoder_lost_s: 0.02,    // 5 rad/s are 300 edges in it
            supply_low_share: 0.75,
            supply_high_share: 1.25,
            tracking_s: 1.0,
            temperature_C: 100.0, // maxon RE 25: 100 °C, the greatest that the winding stands
            sensor_silent_s: 0.1,
            index_off_counts: 8.0, // two lines of the disc
        }
    }
}

impl Settings {
    /// Current at which the drive is switched off, A. At the end of the converter's range the current may be any: that is over-current,
    /// too.
    pub fn trip_A(&self, hardware: &Hardware) -> f64 {
        libm::fmin(self.over_current_A, CONVERTER_RANGE * hardware.current_zero_code * hardware.current_A_per_code)
    }

    /// Checks all thresholds.
    ///
    /// # Errors
    /// The name of the first that is not finite or out of its range.
    pub fn check(&self) -> Result<(), ConfigError> {
        all_within! { of self, "safety.";
            over_current_A: 1e-3, 1e3;
            stall_current_A: 1e-3, 1e3;
            stall_s: 1e-3, 60.0;
            encoder_lost_rad_s: 1e-3, 1e4;
            encoder_lost_s: 1e-3, 5.0;
            supply_low_share: 0.0, 1.0;
            supply_high_share: 1.0, 10.0;
            tracking_s: 1e-3, 3600.0;
            temperature_C: -50.0, 500.0;
            sensor_silent_s: 1e-3, 3600.0;
            index_off_counts: 0.0, 1e6;
        }
    }
}
