//! Gyroscopes on the torquer and the angle sensor of the simulated board.
//!
//! [`GyroPort`] is the interface to the board. [`SingleAxis`] is a stabiliser of one axis, [`ThreeAxis`] a platform in gimbals with exact
//! attitude kinematics, [`Campaign`] a complete measurement on it without firmware. [`earth`] is the Earth rate at a site, [`AngleSensor`]
//! and [`Torquer`] are sensor and actuator. Angles in rad, rates in rad/s.

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
pub use single_axis::{Orientation, OwnDrift, SingleAxis};
pub use three_axis::{OneAxis, ThreeAxis};
pub use torquer::Torquer;

/// One arcsecond, rad.
pub const ARCSEC: f64 = std::f64::consts::PI / 180.0 / 3600.0;
/// One degree per hour, rad/s: numerically equal to an arcsecond in rad.
pub const DEG_H: f64 = ARCSEC;

/// A single-axis gyroscope from a TOML file.
///
/// # Errors
/// Not TOML, an unknown key, or an invalid number; with its line.
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
        ("own.flicker_rad_s", gyro.own.flicker_rad_s, 0.0, 1.0),
        ("own.random_walk_rad_s_sqrt_s", gyro.own.random_walk_rad_s_sqrt_s, 0.0, 1.0),
        ("own.ramp_rad_s2", gyro.own.ramp_rad_s2, -1.0, 1.0),
        ("level_error_rad", gyro.level_error_rad, 0.0, 0.1),
        ("vibration.frequency_Hz", gyro.vibration.frequency_Hz, 0.0, 1e5),
    ];
    for (name, value, least, most) in checks {
        stand_firmware::config::within(name, value, least, most).map_err(|e| e.to_string())?;
    }
    Ok(gyro)
}

/// The interface of a gyroscope to the board.
pub trait GyroPort: Send {
    /// Advances by `dt_s` with this current command of the torquer amplifier, A; the platform under the gyroscope is at `platform_rad`.
    fn advance(&mut self, command_A: f64, platform_rad: f64, dt_s: f64);
    /// Present output of the angle sensor with noise, V.
    fn sensor_V(&mut self) -> f64;
    /// Current through the torquer, mean over the last `advance`, A.
    fn torquer_A(&self) -> f64;
    /// Roll about the rotor axis, rad, where a sensor measures it.
    fn roll_rad(&self) -> Option<f64> {
        None
    }
    /// Sets the orientation, as by hand. A gyroscope may ignore this.
    fn set_orientation(&mut self, _orientation: Orientation) {}
    /// Limits the current of the amplifier, A; `None`: its nominal limit. A gyroscope may ignore this.
    fn limit(&mut self, _limit_A: Option<f64>) {}
}
