//! Gyros beside the drive: what hangs on the torquer's and the angle sensor's wires of the simulated board.
//!
//! [`GyroPort`] is what the board sees of it. [`SingleAxis`] is a stabiliser of one axis, [`ThreeAxis`] a platform in gimbals with the exact kinematics of
//! its attitude, [`Campaign`] a whole measurement on it without a firmware. [`earth`] is the Earth's rotation at a site, [`AngleSensor`] and [`Torquer`]
//! are the two ends of the wires. Angles in rad, rates in rad/s; formulas: theory.md §3.

pub mod attitude;
pub mod campaign;
pub mod earth;
mod line;
mod sensor;
mod single_axis;
mod three_axis;
mod torquer;

pub use campaign::{Campaign, Pattern};
pub use earth::Site;
pub use line::GyroLine;
pub use sensor::AngleSensor;
pub use single_axis::{OwnDrift, Place, SingleAxis};
pub use three_axis::{OneAxis, ThreeAxis};
pub use torquer::Torquer;

/// One arcsecond, rad.
pub const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// One degree per hour, rad/s: as many rad/s as an arcsecond has rad.
pub const DEG_H: f64 = ARCSEC;

/// A gyro of one axis from a TOML file.
///
/// # Errors
/// Not TOML, a word that no gyro has, a number that makes no sense; with its line.
pub fn read(text: &str) -> Result<SingleAxis, String> {
    let gyro: SingleAxis =
        toml::from_str(text).map_err(|e| e.to_string().lines().next().unwrap_or_default().to_owned() + ": " + e.message())?;
    let checks = [
        ("site.latitude_rad", gyro.site.latitude_rad, -std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2),
        ("torquer.gain_rad_s_A", gyro.torquer.gain_rad_s_A, 1e-9, 1e3),
        ("torquer.lag_s", gyro.torquer.lag_s, 0.0, 10.0),
        ("torquer.inequality", gyro.torquer.inequality, -0.5, 0.5),
        ("torquer.gain_inequality", gyro.torquer.gain_inequality, -0.5, 0.5),
        ("torquer.limit_A", gyro.torquer.limit_A, 1e-9, 1e3),
        ("sensor.gain_V_rad", gyro.sensor.gain_V_rad, 1e-6, 1e9),
        ("sensor.noise_rad", gyro.sensor.noise_rad, 0.0, 1.0),
        ("sensor.step_rad", gyro.sensor.step_rad, 0.0, 1.0),
        ("vibration.frequency_Hz", gyro.vibration.frequency_Hz, 0.0, 1e5),
    ];
    for (name, value, least, most) in checks {
        stand_firmware::config::within(name, value, least, most).map_err(|e| e.to_string())?;
    }
    Ok(gyro)
}

/// What the board sees of a gyro.
pub trait GyroPort: Send {
    /// Time passes with this current given to the torquer's amplifier, A; the platform that carries it all stands at `platform_rad`.
    fn advance(&mut self, given_A: f64, platform_rad: f64, dt_s: f64);
    /// The angle sensor's output now, V, noise drawn.
    fn sensor_V(&mut self) -> f64;
    /// The current through the torquer, mean over the last `advance`, A.
    fn torquer_A(&self) -> f64;
    /// The roll about the rotor's axis, rad, where a sensor of its own shows it.
    fn roll_rad(&self) -> Option<f64> {
        None
    }
    /// Somebody turns the gyro by hand. A gyro may have no such places.
    fn put(&mut self, _place: Place) {}
    /// The amplifier gives no more than this from now on, A; `None`: what it is made for. A gyro may have no such amplifier.
    fn limit(&mut self, _limit_A: Option<f64>) {}
}
