//! What a row can carry, and how each of it is coded.
//!
//! Angles and durations are whole numbers of 10⁻⁹ (nrad, ns), so that an hour's angle is as fine as the first turn's; what is good to a part
//! in 10⁷ is single precision; flags are whole numbers. A value that is not there is coded as such and is NaN to the receiver: nothing is
//! made up.

use crate::measurement_loop::Row;

/// How a channel's value is on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Single precision: four bytes; NaN where there is no value.
    Single,
    /// A signed whole number of 10⁻⁹: one to ten bytes; the least there is where there is no value.
    Nano,
    /// An unsigned whole number: one to five bytes.
    Whole,
}

impl Coding {
    /// Bytes that a value takes at most in practice: an angle of 4 million radians, flags of 21 bits.
    fn bytes(self) -> u32 {
        match self {
            Coding::Single => 4,
            Coding::Nano => 8,
            Coding::Whole => 3,
        }
    }
}

/// One thing that a row can carry.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Its name with its unit: the column of a log (interfaces.md).
    pub name: &'static str,
    /// How it is on the wire.
    pub coding: Coding,
    /// Its value in a row; NaN where there is none.
    pub read: fn(&Row) -> f64,
}

const fn channel(name: &'static str, coding: Coding, read: fn(&Row) -> f64) -> Channel {
    Channel { name, coding, read }
}

fn some(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn single(value: Option<f32>) -> f64 {
    some(value.map(f64::from))
}

/// All channels; the place is the bit in [`Channels`], so new ones come at the end.
pub const CHANNELS: [Channel; 26] = [
    channel("u_V", Coding::Single, |row| row.u_V),
    channel("supply_V", Coding::Single, |row| some(row.supply_V)),
    channel("i_A", Coding::Single, |row| some(row.i_A)),
    channel("theta_rad", Coding::Nano, |row| row.theta_rad),
    channel("omega_rad_s", Coding::Single, |row| some(row.omega_rad_s)),
    channel("rate_cmd_rad_s", Coding::Single, |row| some(row.rate_cmd_rad_s)),
    channel("theta_cmd_rad", Coding::Nano, |row| some(row.theta_cmd_rad)),
    channel("temp_C", Coding::Single, |row| some(row.temp_C)),
    channel("from_index_rad", Coding::Nano, |row| some(row.from_index_rad)),
    channel("limits", Coding::Whole, |row| f64::from(row.limits.0)),
    channel("fault", Coding::Whole, |row| f64::from(row.fault.code())),
    channel("age_s", Coding::Nano, |row| row.age as f64 * 1e-7),
    channel("turn_s", Coding::Nano, |row| some(row.turn_s())),
    channel("gyro_rad_s", Coding::Single, |row| some(row.gyro_rad_s)),
    channel("accel_x_m_s2", Coding::Single, |row| some(row.accel_x_m_s2)),
    channel("accel_y_m_s2", Coding::Single, |row| some(row.accel_y_m_s2)),
    channel("angle_sensor_V", Coding::Single, |row| some(row.angle_sensor_V)),
    channel("torquer_A", Coding::Single, |row| some(row.torquer_A)),
    channel("drift_mark", Coding::Whole, |row| f64::from(row.drift_mark)),
    channel("gamma_rad", Coding::Single, |row| some(row.roll_rad)),
    channel("alpha_hat_rad", Coding::Single, |row| single(row.observed.map(|o| o.alpha_rad))),
    channel("alpha_rate_hat_rad_s", Coding::Single, |row| single(row.observed.map(|o| o.alpha_rate_rad_s))),
    channel("beta_rate_hat_rad_s", Coding::Single, |row| single(row.observed.map(|o| o.beta_rate_rad_s))),
    channel("moment_hat_N_m", Coding::Single, |row| single(row.observed.and_then(|o| o.moment_N_m))),
    channel("sensor_C", Coding::Single, |row| some(row.sensor_C)),
    channel("sensor_age_s", Coding::Nano, |row| some(row.gyro_rad_s.map(|_| row.imu_age as f64 * 1e-7))),
];

/// A set of channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Channels(pub u32);

impl Channels {
    /// What a stream begins with: the columns of a log, and why the output was less than asked.
    pub const USUAL: Self = Self(0b110_1111_1111);
    /// All there are.
    pub const ALL: Self = Self((1 << CHANNELS.len()) - 1);

    /// The set of one channel; `None` where no channel is called so. Case does not matter.
    pub fn named(name: &str) -> Option<Self> {
        CHANNELS.iter().position(|channel| channel.name.eq_ignore_ascii_case(name)).map(|bit| Self(1 << bit))
    }

    /// Both sets.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The channels in it, in the order of the wire; bits that no channel has are passed over.
    pub fn iter(self) -> impl Iterator<Item = &'static Channel> {
        CHANNELS.iter().enumerate().filter(move |(bit, _)| self.0 >> bit & 1 == 1).map(|(_, channel)| channel)
    }

    /// Bytes of one row's frame on the line, at most in practice.
    pub fn frame_bytes(self) -> u32 {
        // Two zeros, COBS, type and number, CRC; then the row's number, its time and the set.
        2 + 1 + 3 + 4 + 5 + 6 + 4 + self.iter().map(|channel| channel.coding.bytes()).sum::<u32>()
    }
}
