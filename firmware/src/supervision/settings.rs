//! Thresholds of what switches the drive off, in a person's units, checked by name.

use crate::config::{ConfigError, all_within};

/// Thresholds. The default suits the default stand: maxon RE 25, 1.5 A of current limit, 12 V.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Motor current above which the drive is switched off within 0.4 ms, A; where the converter ends below it, there.
    pub over_current_A: f64,
    /// Current, or voltage over resistance, at which the motor pushes: if the count stays, it is stalled, A.
    pub stall_current_A: f64,
    /// How long it may push while the count stays, s.
    pub stall_s: f64,
    /// Rate by its back-EMF at which a motor's count cannot stay, rad/s; a fifth of R·i is added for what the resistance is wrong. Where the count crept
    /// to rest, or never ran, at least three times as much: brushes and the bridge's dead time keep voltage back, too.
    pub encoder_lost_rad_s: f64,
    /// How long it may seem to turn while the count stays, s.
    pub encoder_lost_s: f64,
    /// Least supply while it drives, share of the nominal one.
    pub supply_low_share: f64,
    /// Greatest supply while it drives, share of the nominal one.
    pub supply_high_share: f64,
    /// How long the ramp may slip without a pause, s.
    pub tracking_s: f64,
    /// Greatest temperature of the winding, °C.
    pub temperature_C: f64,
    /// How long a sensor that was there may be silent, s.
    pub sensor_silent_s: f64,
    /// How far from a whole turn after the last the index may come, counts.
    pub index_off_counts: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            over_current_A: 1.6,     // the limit is 1.5, the converter ends at 1.65
            stall_current_A: 1.2,    // four fifths of the limit: 28 mN m, thirty times the default stand's friction
            stall_s: 0.5,            // 2.25 A² × 2.32 Ω × 0.5 s is 2.6 J: half a kelvin in the winding
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
    /// Checks all thresholds.
    ///
    /// # Errors
    /// The name of the first that is not a number or makes no sense.
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
