//! The sensor under test (DUT): an inertial sensor on the platform, behind one driver trait.
//!
//! [`Sensor`] is the trait. [`Ism330dhcx`] implements it for a gyro with accelerometer, [`Adxl355`] for an accelerometer;
//! [`DetectedSensor`] is the one of them that answers on the bus. [`Runner`] is the task: it detects and configures the chip, reads the
//! configuration back, empties the FIFO every millisecond, and converts the time stamps to the board's clock. [`Shared`] has the newest
//! sample and the status for the other tasks; the rows of the measurement loop take the sample from there.
//!
//! Units are rad/s, m/s² and °C. An absent, silent or wrong chip, or invalid data, is a [`SensorError`]; the task then starts again.
//! Transfers use DMA and do not delay the rows.

mod adxl355;
mod detected;
mod error;
mod fifo;
mod ism330dhcx;
mod line;
mod runner;
mod sample_clock;
pub mod selected;
mod shared;

use crate::board::Stamped;

pub use adxl355::Adxl355;
pub use detected::DetectedSensor;
pub use error::SensorError;
pub use ism330dhcx::Ism330dhcx;
pub use runner::Runner;
pub use shared::{Shared, State, Status};

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY_M_S2: f32 = 9.806_65;

/// Data rate and ranges, requested or in force.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Setup {
    /// Samples per second.
    pub data_rate_Hz: f32,
    /// Range of the angular rate, rad/s; in force NaN without a gyro.
    pub rate_range_rad_s: f32,
    /// Range of the acceleration, m/s².
    pub accel_range_m_s2: f32,
}

impl Default for Setup {
    /// A data rate somewhat above the row rate, ± 2000 °/s, ± 4 g.
    fn default() -> Self {
        Self { data_rate_Hz: 1667.0, rate_range_rad_s: 2000_f32.to_radians(), accel_range_m_s2: 4.0 * STANDARD_GRAVITY_M_S2 }
    }
}

/// The set-up in force, and values that depend on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InForce {
    /// Data rate and ranges.
    pub setup: Setup,
    /// Cutoff frequency of the rate's low-pass, Hz; NaN without a gyro.
    pub rate_cutoff_Hz: f32,
    /// Cutoff frequency of the acceleration's low-pass, Hz.
    pub accel_cutoff_Hz: f32,
    /// Resolution of the chip's time stamps, s.
    pub stamp_s: f64,
}

/// A sample in the axes and the time of the chip.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// Time stamp, in steps of [`InForce::stamp_s`], wrapping.
    pub stamp: u32,
    /// Rate about x, y, z, rad/s; `None` without a gyro.
    pub rate_rad_s: Option<[f32; 3]>,
    /// Specific force along x, y, z, m/s².
    pub accel_m_s2: [f32; 3],
}

/// Result of reading the FIFO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Samples read.
    pub samples: usize,
    /// Samples overwritten in the chip, or incomplete.
    pub lost: u32,
    /// Words refused for an unknown tag or a wrong parity.
    pub refused: u32,
}

/// Outputs with new data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ready {
    /// Angular rate.
    pub rate: bool,
    /// Acceleration.
    pub accel: bool,
    /// Temperature.
    pub temperature: bool,
}

/// Result of the self-test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfTest {
    /// Change of the rates, rad/s; NaN without a gyro.
    pub rate_rad_s: [f32; 3],
    /// Change of the specific forces, m/s².
    pub accel_m_s2: [f32; 3],
    /// All changes are within the limits of the data sheet.
    pub passed: bool,
}

/// Motion of the platform, with the sensor mounted z up, x outward, y along the motion at positive rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// Rate about the axis of the platform, rad/s; `None` without a gyro.
    pub rate_rad_s: Option<f32>,
    /// Specific force outward, m/s².
    pub outward_m_s2: f32,
    /// Specific force along the motion, m/s².
    pub along_m_s2: f32,
}

impl From<&Sample> for Motion {
    fn from(sample: &Sample) -> Self {
        let [outward_m_s2, along_m_s2, _] = sample.accel_m_s2;
        Self { rate_rad_s: sample.rate_rad_s.map(|[_, _, z]| z), outward_m_s2, along_m_s2 }
    }
}

/// The smallest entry that is at least `wanted`, or the greatest entry.
fn at_least<T: Copy>(list: &[T], wanted: f32, size: impl Fn(&T) -> f32) -> Option<T> {
    // A value converted from another unit may be off by its last digit.
    list.iter().find(|entry| size(entry) >= wanted * 0.999).or(list.last()).copied()
}

/// Driver of a sensor under test. Every method may wait for the bus.
#[allow(async_fn_in_trait)] // one thread, one executor: no future leaves it
pub trait Sensor {
    /// Name of the part.
    fn name(&self) -> &'static str;

    /// Finds the chip: a driver of several parts selects the one that answers.
    async fn detect(&mut self) -> Result<(), SensorError> {
        self.identify().await
    }
    /// Checks that the expected chip answers.
    async fn identify(&mut self) -> Result<(), SensorError>;
    /// Resets the chip, selects the smallest data rate and ranges that cover the request, starts the FIFO, and reads all registers back.
    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, SensorError>;
    /// Outputs with new data.
    async fn ready(&mut self) -> Result<Ready, SensorError>;
    /// Reads the oldest samples from the FIFO, at most `samples.len()`.
    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, SensorError>;
    /// A time of the chip, on the scale of the time stamps, with the board's time.
    async fn stamp(&mut self) -> Result<Stamped<u32>, SensorError>;
    /// Temperature of the chip, °C.
    async fn temperature_C(&mut self) -> Result<f32, SensorError>;
    /// Deflects the proof masses by a known force, at rest; takes about half a second. The chip must be configured again afterwards.
    async fn self_test(&mut self) -> Result<SelfTest, SensorError>;
}
