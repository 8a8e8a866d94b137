//! The sensor under test: a gyro–accelerometer that rides on the platform, behind one trait.
//!
//! [`Sensor`] is what any part must be able to do; [`Ism330dhcx`] does it through ST's own driver. [`Runner`] keeps one going for ever in a
//! task: it finds the chip, sets it up, reads the set-up back, empties its FIFO each millisecond, puts its samples on the board's clock, and
//! says in [`Shared`] what it sees or why it sees nothing. The rows of the measurement loop take the newest sample from there.
//!
//! Units are rad/s, m/s² and °C. A chip that is absent, silent, wrong or talks rubbish is a [`Trouble`], never a panic, and is tried
//! again. Nothing here holds up the rows: a transfer goes by DMA while the others run.

mod fifo;
mod ism330dhcx;
mod runner;
mod sample_clock;
mod shared;
mod trouble;

pub use ism330dhcx::Ism330dhcx;
pub use runner::Runner;
pub use shared::{Shared, State, Status};
pub use trouble::Trouble;

/// Standard gravity, m/s².
pub const STANDARD_GRAVITY_M_S2: f32 = 9.806_65;

/// Ranges and rates: asked for, or as the chip holds them.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Setup {
    /// Samples per second.
    pub data_rate_Hz: f32,
    /// Largest rate, rad/s.
    pub rate_range_rad_s: f32,
    /// Largest acceleration, m/s².
    pub accel_range_m_s2: f32,
}

impl Default for Setup {
    /// Samples somewhat closer than the rows, ± 2000 °/s, ± 4 g.
    fn default() -> Self {
        Self { data_rate_Hz: 1667.0, rate_range_rad_s: 2000_f32.to_radians(), accel_range_m_s2: 4.0 * STANDARD_GRAVITY_M_S2 }
    }
}

/// A set-up as the chip holds it, and what follows from it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InForce {
    /// Ranges and rates.
    pub setup: Setup,
    /// Cutoff of the gyro's low-pass, Hz.
    pub rate_cutoff_Hz: f32,
    /// Cutoff of the accelerometer's low-pass, Hz.
    pub accel_cutoff_Hz: f32,
    /// One step of the chip's own time, s.
    pub stamp_s: f64,
}

/// One sample, by the chip's axes and time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sample {
    /// When, in steps of the chip's own time ([`InForce::stamp_s`]), wrapping.
    pub stamp: u32,
    /// Rate about x, y, z, rad/s.
    pub rate_rad_s: [f32; 3],
    /// Specific force along x, y, z, m/s².
    pub accel_m_s2: [f32; 3],
}

/// What came out of the FIFO.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Drained {
    /// Samples handed over.
    pub samples: usize,
    /// Samples that were overwritten or came incomplete.
    pub lost: u32,
    /// Words that were refused: their tag is none, or its parity is wrong.
    pub refused: u32,
}

/// Which outputs hold something new.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ready {
    /// The gyro.
    pub rate: bool,
    /// The accelerometer.
    pub accel: bool,
    /// The thermometer.
    pub temperature: bool,
}

/// What the self-test moved.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SelfTest {
    /// Change of the rates, rad/s.
    pub rate_rad_s: [f32; 3],
    /// Change of the specific forces, m/s².
    pub accel_m_s2: [f32; 3],
    /// All of it within the data sheet's limits.
    pub passed: bool,
}

/// What the platform does, by the sensor as it is mounted: z up, x outward, y along the motion of positive rate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// About the platform's axis, rad/s.
    pub rate_rad_s: f32,
    /// Specific force outward, m/s².
    pub outward_m_s2: f32,
    /// Specific force along the motion, m/s².
    pub along_m_s2: f32,
}

impl From<&Sample> for Motion {
    fn from(sample: &Sample) -> Self {
        let ([_, _, rate_rad_s], [outward_m_s2, along_m_s2, _]) = (sample.rate_rad_s, sample.accel_m_s2);
        Self { rate_rad_s, outward_m_s2, along_m_s2 }
    }
}

/// A sensor under test.
///
/// Each verb may wait for the line, and says in its error what a person can do about it.
#[allow(async_fn_in_trait)] // one thread, one executor: no future leaves it
pub trait Sensor {
    /// The part's name.
    const NAME: &'static str;

    /// Whether it is there and is what it should be.
    async fn identify(&mut self) -> Result<(), Trouble>;
    /// Sets it up anew with the least ranges and rates that hold what is asked for, starts its FIFO, reads everything back.
    async fn configure(&mut self, wanted: &Setup) -> Result<InForce, Trouble>;
    /// Which outputs hold something new.
    async fn ready(&mut self) -> Result<Ready, Trouble>;
    /// Takes the oldest samples out of its FIFO, at most as many as there is room for.
    async fn drain(&mut self, samples: &mut [Sample]) -> Result<Drained, Trouble>;
    /// Its own time now, as the samples are stamped with.
    async fn stamp(&mut self) -> Result<u32, Trouble>;
    /// Its temperature, °C.
    async fn temperature_C(&mut self) -> Result<f32, Trouble>;
    /// Lets it move its own masses by a known force, at rest; takes about half a second. It must be configured again afterwards.
    async fn self_test(&mut self) -> Result<SelfTest, Trouble>;
}
