//! All kept numbers by name, with their ranges: one list for the console, for `HELP?`, and for the layout of the record.
//!
//! The names are those of the fields and end with the unit. [`Kept::config`] accepts each number in its range if the others have their
//! defaults; a test checks that. Harmonics are set by `COMPensation:HARMonic` instead.

use super::Kept;
use crate::console::quantity::Quantity;

/// A kept number.
pub struct Field {
    /// Name of the field, with its unit.
    pub name: &'static str,
    /// Smallest accepted value.
    pub least: f64,
    /// Greatest accepted value.
    pub greatest: f64,
    /// It is a hardware scale, which acts from the next power-on on.
    pub is_scale: bool,
    /// Reads it.
    pub read: fn(&Kept) -> f64,
    /// Sets it.
    pub write: fn(&mut Kept, f64),
}

impl Field {
    /// Its quantity and unit.
    pub fn quantity(&self) -> Quantity {
        Quantity::of_name(self.name)
    }

    /// The field of this name, in any case.
    pub fn named(name: &[u8]) -> Option<&'static Self> {
        FIELDS.iter().find(|field| name.eq_ignore_ascii_case(field.name.as_bytes()))
    }
}

macro_rules! fields {
    ($($place:ident . $name:ident $(. $inner:ident)? : $least:expr, $greatest:expr;)*) => {
        /// All kept numbers.
        pub const FIELDS: &[Field] = &[$(Field {
            name: fields!(@name $name $($inner)?),
            is_scale: fields!(@is_scale $place),
            least: $least,
            greatest: $greatest,
            read: |kept| fields!(@read kept.$place.$name $(.$inner)?),
            write: |kept, value| fields!(@write kept.$place.$name $(.$inner)?, value),
        }),*];
    };
    (@is_scale hardware) => { true };
    (@is_scale settings) => { false };
    (@name $name:ident) => { stringify!($name) };
    (@name $name:ident $inner:ident) => { stringify!($inner) };
    (@read $kept:ident . $place:ident . duty_full_scale) => { f64::from($kept.$place.duty_full_scale) };
    (@read $($path:tt)*) => { $($path)* };
    (@write $kept:ident . $place:ident . duty_full_scale, $value:ident) => { $kept.$place.duty_full_scale = libm::round($value) as i32 as i16 };
    (@write $kept:ident . $place:ident . $name:ident $(. $inner:ident)?, $value:ident) => { $kept.$place.$name $(.$inner)? = $value };
}

fields! {
    settings.resistance_ohm: 1e-3, 1e4;
    settings.motor_constant_N_m_A: 1e-6, 1e3;
    settings.inertia_kg_m2: 0.0, 1e3;
    settings.rate_gain_V_s_rad: 0.0, 1e4;
    settings.position_gain_V_rad: 0.0, 1e6;
    settings.rate_bandwidth_Hz: 1.0, 1e3;
    settings.acceleration_rad_s2: 1e-3, 1e5;
    settings.slip_rad: 1e-4, 6.3;
    settings.current_limit_A: 1e-3, 1e3;
    settings.voltage_limit_V: 1e-3, 12.0;
    settings.overspeed_rad_s: 1e-3, 1e4;
    settings.approach_rad_s: 1e-4, 1e4;
    settings.compensation.coulomb_N_m: 0.0, 1.3 * 23.4e-3;
    settings.compensation.coulomb_fade_rad_s: 1e-6, 1e3;
    settings.compensation.viscous_N_m_s: 0.0, 1e3;
    settings.compensation.winding_lag_s: 0.0, 0.1;
    settings.safety.over_current_A: 1e-3, 1e3;
    settings.safety.stall_current_A: 1e-3, 1e3;
    settings.safety.stall_s: 1e-3, 60.0;
    settings.safety.encoder_lost_rad_s: 1e-3, 1e4;
    settings.safety.encoder_lost_s: 1e-3, 5.0;
    settings.safety.supply_low_share: 0.0, 1.0;
    settings.safety.supply_high_share: 1.0, 10.0;
    settings.safety.tracking_s: 1e-3, 3600.0;
    settings.safety.temperature_C: -50.0, 500.0;
    settings.safety.sensor_silent_s: 1e-3, 3600.0;
    settings.safety.index_off_counts: 0.0, 1e6;
    settings.gyro.angle_gain_V_rad: 1e-3, 1e6;
    settings.gyro.torquer_gain_rad_s_A: 1e-9, 1e3;
    settings.gyro.correction_1_s: 0.0, 100.0;
    settings.gyro.torquer_limit_A: 1e-6, 1e3;
    settings.gyro.angle_limit_V: 1e-3, 1e3;
    hardware.counts_per_turn: 4.0, 1e6;
    hardware.edge_timer_Hz: 1e5, 1e9;
    hardware.duty_full_scale: 16.0, 32_000.0;
    hardware.supply_nominal_V: 11.4, 1e3;
    hardware.current_A_per_code: 1e-15, 1e3;
    hardware.current_zero_code: 1.0, 1e15;
    hardware.supply_V_per_code: 1e-9, 1e3;
    hardware.rate_rad_s_per_code: 1e-12, 1e3;
    hardware.rate_cutoff_Hz: 0.0, 1e6;
    hardware.temperature_C_per_code: 1e-9, 1e3;
    hardware.angle_V_per_code: 1e-15, 1e3;
    hardware.angle_zero_code: -1e9, 1e9;
    hardware.roll_rad_per_code: 1e-12, 1.0;
    hardware.torquer_A_per_code: 1e-15, 1e3;
    hardware.torquer_zero_code: -1e9, 1e9;
    hardware.torquer_A_per_step: 1e-9, 1e3;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_accepted_exactly_in_their_ranges() {
        for field in FIELDS {
            let with = |value| {
                let mut kept = Kept::default();
                (field.write)(&mut kept, value);
                kept.config().map(drop).map_err(|wrong| wrong.parameter().rsplit('.').next().unwrap_or_default().to_string())
            };
            assert_eq!((with(field.least), with(field.greatest)), (Ok(()), Ok(())), "{}", field.name);
            let named = Err(field.name.to_string());
            let beyond = [field.least - 1e-3 * field.least.abs().max(1e-3), field.greatest * 1.001];
            // A range that depends on another setting names that setting.
            let names = |value: f64| with(value) == named || (field.name == "supply_nominal_V" && with(value).is_err());
            assert!(field.name == "duty_full_scale" || names(beyond[0]), "{} {}", field.name, beyond[0]);
            assert!(names(beyond[1]), "{} {}", field.name, beyond[1]);
        }
    }

    #[test]
    fn each_field_reads_and_writes_only_its_own_number() {
        for (n, field) in FIELDS.iter().enumerate() {
            let mut kept = Kept::default();
            (field.write)(&mut kept, 17.0);
            assert_eq!((field.read)(&kept), 17.0, "{}", field.name);
            for (m, other) in FIELDS.iter().enumerate() {
                assert!(m == n || (other.read)(&kept) == (other.read)(&Kept::default()), "{} moves {}", field.name, other.name);
            }
        }
    }

    /// A field missing in the list could not be set and would not change the layout of the record.
    #[test]
    fn the_list_is_complete() {
        let kept = Kept::default();
        let mut space = [0; 1024];
        let length = postcard::to_slice(&kept, &mut space).unwrap().len();
        // 8 bytes for each number, but 2 for the integer `duty_full_scale`; 1 for the empty list of harmonics.
        assert_eq!(length, 8 * (FIELDS.len() - 1) + 2 + 1);
    }
}
