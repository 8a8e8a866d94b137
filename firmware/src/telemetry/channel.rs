//! The table of all channels of the stand.
//!
//! Rows, frames, the simulator, the recorder and the columns of logs use this table. Angles and durations are transmitted as integers in
//! units of 10⁻⁹ (nrad, ns), so that the resolution of an angle does not decrease with the number of turns. Other quantities are
//! transmitted in single precision, flags as integers.

use crate::measurement_loop::Row;
use Coding::{Nano, Single, Whole};
use Sampling::{Held, Instant, Mean, PerTurn};
use Source::{Command, Drive, Dut, Encoder, Gyroscope, Observer, RateSensor, Status};

/// Transmitted format of a channel, with its scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Single precision: four bytes; NaN where there is no value.
    Single,
    /// Signed integer in units of 10⁻⁹: one to ten bytes; `i64::MIN` where there is no value.
    Nano,
    /// Unsigned integer: one to five bytes.
    Whole,
}

impl Coding {
    /// Length of a value in practice, bytes: angles up to 4 million radians, flags up to 21 bits.
    fn bytes(self) -> u32 {
        match self {
            Coding::Single => 4,
            Coding::Nano => 8,
            Coding::Whole => 3,
        }
    }
}

/// Origin of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The commanded values.
    Command,
    /// Converters of the drive: supply, motor current, winding temperature.
    Drive,
    /// The encoder with its index.
    Encoder,
    /// The rate sensor of the stand.
    RateSensor,
    /// The sensor under test.
    Dut,
    /// The gyroscope with angle sensor and torquer.
    Gyroscope,
    /// Estimates of the gyroscope's observer.
    Observer,
    /// Status of the control and of the measurement.
    Status,
}

/// Rate class of a channel: the time that its value in row k refers to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Sampled in each row, at t_k.
    Instant,
    /// Mean over [t_k, t_{k+1}).
    Mean,
    /// The last reading of a slow measurement before t_k.
    Held,
    /// The last whole turn before t_k.
    PerTurn,
}

/// Where a channel is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Column of a log, in the default selection of a stream.
    DefaultColumn,
    /// Column of a log.
    Column,
    /// In the default selection of a stream; not a column.
    DefaultStatus,
    /// Only on request; not a column.
    Auxiliary,
}

/// A channel of the stand.
#[derive(Clone, Copy, Debug)]
pub struct Channel {
    /// Name with the unit; also the name of the log column.
    pub name: &'static str,
    /// Unit; empty for numbers without a unit.
    pub unit: &'static str,
    /// Description.
    pub description: &'static str,
    /// Origin.
    pub source: Source,
    /// Rate class.
    pub sampling: Sampling,
    /// Transmitted format.
    pub coding: Coding,
    /// Log column, default selection.
    pub usage: Use,
    /// Its value in a row, in its unit; `None` where there is none.
    pub read: fn(&Row) -> Option<f64>,
}

impl Channel {
    /// Whether it is a column of a log.
    pub const fn is_column(&self) -> bool {
        matches!(self.usage, Use::DefaultColumn | Use::Column)
    }

    /// Whether it is in the default selection of a stream.
    pub const fn is_default(&self) -> bool {
        matches!(self.usage, Use::DefaultColumn | Use::DefaultStatus)
    }

    /// The channel of this name, in any case.
    pub fn named(name: &str) -> Option<&'static Self> {
        CHANNELS.iter().find(|channel| channel.name.eq_ignore_ascii_case(name))
    }
}

macro_rules! channels {
    ($($name:literal, $unit:literal, $source:ident, $sampling:ident, $coding:ident, $usage:ident, $description:literal, $read:expr;)*) => {
        [$(Channel {
            name: $name,
            unit: $unit,
            description: $description,
            source: $source,
            sampling: $sampling,
            coding: $coding,
            usage: Use::$usage,
            read: $read,
        }),*]
    };
}

/// All channels. The index of a channel is its bit in [`Channels`] and its place in a frame: new channels are added at the end.
#[rustfmt::skip]
pub const CHANNELS: [Channel; 27] = channels! {
    "u_V", "V", Command, Mean, Single, DefaultColumn, "commanded voltage at nominal supply", |row| Some(row.u_V);
    "supply_V", "V", Drive, Instant, Single, DefaultColumn, "supply voltage of the bridge", |row| row.supply_V;
    "i_A", "A", Drive, Mean, Single, DefaultColumn, "motor current", |row| row.i_A;
    "theta_rad", "rad", Encoder, Instant, Nano, DefaultColumn, "platform angle", |row| Some(row.theta_rad);
    "omega_rad_s", "rad/s", RateSensor, Instant, Single, DefaultColumn, "platform rate", |row| row.omega_rad_s;
    "rate_cmd_rad_s", "rad/s", Command, Instant, Single, DefaultColumn, "commanded rate", |row| row.rate_cmd_rad_s;
    "theta_cmd_rad", "rad", Command, Instant, Nano, DefaultColumn, "commanded angle", |row| row.theta_cmd_rad;
    "temp_C", "°C", Drive, Held, Single, DefaultColumn, "winding temperature", |row| row.temp_C;
    "from_index_rad", "rad", Encoder, Instant, Nano, Auxiliary, "platform angle from the index", |row| row.from_index_rad;
    "limits", "", Status, Mean, Whole, DefaultStatus, "limits in force during the row, as bits", |row| Some(f64::from(row.limits.0));
    "fault", "", Status, Instant, Whole, DefaultStatus, "number of the latched fault", |row| Some(f64::from(row.fault.code()));
    "age_s", "s", Status, Instant, Nano, Auxiliary, "age of the oldest reading in the row", |row| Some(row.age as f64 * 1e-7);
    "turn_s", "s", Encoder, PerTurn, Nano, Column, "duration of the last whole turn", |row| row.turn_s();
    "gyro_rad_s", "rad/s", Dut, Instant, Single, Column, "rate of the sensor under test", |row| row.gyro_rad_s;
    "accel_x_m_s2", "m/s²", Dut, Instant, Single, Column, "outward acceleration of the sensor under test", |row| row.accel_x_m_s2;
    "accel_y_m_s2", "m/s²", Dut, Instant, Single, Column, "acceleration of the sensor under test along the motion", |row| row.accel_y_m_s2;
    "angle_sensor_V", "V", Gyroscope, Instant, Single, Column, "angle sensor of the gyroscope", |row| row.angle_sensor_V;
    "torquer_A", "A", Gyroscope, Mean, Single, Column, "torquer current of the gyroscope", |row| row.torquer_A;
    "drift_mark", "", Status, Instant, Whole, Auxiliary, "phase of the drift measurement", |row| Some(f64::from(row.drift_mark));
    "gamma_rad", "rad", Gyroscope, Instant, Single, Column, "roll of the gyroscope", |row| row.roll_rad;
    "alpha_hat_rad", "rad", Observer, Instant, Single, Column, "estimated azimuth", |row| row.observed.map(|o| f64::from(o.alpha_rad));
    "alpha_rate_hat_rad_s", "rad/s", Observer, Instant, Single, Column, "estimated rate of the azimuth", |row| row.observed.map(|o| f64::from(o.alpha_rate_rad_s));
    "beta_rate_hat_rad_s", "rad/s", Observer, Instant, Single, Column, "estimated rate of the tilt", |row| row.observed.map(|o| f64::from(o.beta_rate_rad_s));
    "moment_hat_N_m", "N m", Observer, Instant, Single, Column, "estimated moment about the vertical", |row| row.observed.and_then(|o| o.moment_N_m).map(f64::from);
    "sensor_C", "°C", Dut, Held, Single, Column, "temperature of the sensor under test", |row| row.sensor_C;
    "sensor_age_s", "s", Dut, Instant, Nano, Column, "age of the sample of the sensor under test at t_k", |row| row.gyro_rad_s.map(|_| row.imu_age as f64 * 1e-7);
    "u_slope_V", "V", Command, Mean, Single, DefaultColumn, "first moment of u_V within the row: u(t) ≈ u_V + u_slope_V (2 (t − t_k)/Δt − 1)", |row| Some(row.u_slope_V);
};

/// A set of channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct Channels(u32);

impl Channels {
    /// The default selection of a stream.
    pub const DEFAULT: Self = Self::default_selection();
    /// All channels.
    pub const ALL: Self = Self((1 << CHANNELS.len()) - 1);

    #[allow(clippy::indexing_slicing, reason = "evaluated at compile time")]
    const fn default_selection() -> Self {
        let (mut bits, mut index) = (0, 0);
        while index < CHANNELS.len() {
            if CHANNELS[index].is_default() {
                bits |= 1 << index;
            }
            index += 1;
        }
        Self(bits)
    }

    /// The set of one channel, by its name in any case; `None` if there is no such channel.
    pub fn named(name: &str) -> Option<Self> {
        CHANNELS.iter().position(|channel| channel.name.eq_ignore_ascii_case(name)).map(|index| Self(1 << index))
    }

    /// The channels that satisfy a condition.
    pub fn matching(condition: impl Fn(&Channel) -> bool) -> Self {
        Self::ALL.indexed().filter(|(_, channel)| condition(channel)).fold(Self::default(), |set, (index, _)| Self(set.0 | 1 << index))
    }

    /// The set with these bits; `None` if a bit has no channel.
    pub fn from_bits(bits: u32) -> Option<Self> {
        (bits & !Self::ALL.0 == 0).then_some(Self(bits))
    }

    /// The set as bits, as frames carry it.
    pub fn bits(self) -> u32 {
        self.0
    }

    /// The union of both sets.
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The set without the channels of another.
    pub fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Whether all channels of another set are in this one.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// The channels with their indices, in the order of a frame.
    pub fn indexed(self) -> impl Iterator<Item = (usize, &'static Channel)> {
        CHANNELS.iter().enumerate().filter(move |(index, _)| self.0 >> index & 1 == 1)
    }

    /// The channels in the order of a frame.
    pub fn iter(self) -> impl Iterator<Item = &'static Channel> {
        self.indexed().map(|(_, channel)| channel)
    }

    /// Length of a row's frame in practice, bytes.
    pub fn frame_bytes(self) -> u32 {
        // Two zeros, COBS, type and number, CRC; then number and time of the row, and the set.
        2 + 1 + 3 + 4 + 5 + 6 + 4 + self.iter().map(|channel| channel.coding.bytes()).sum::<u32>()
    }
}
