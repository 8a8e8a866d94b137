//! A log of a gyrotheodolite's sensitive element on a vibrating base: the rigid body of `hal-sim`, read by the converters of the stand, in
//! virtual time.
//!
//! Input: the element, the vibration, the azimuth at the start. Output: a log with the angle sensor, the roll, and the exact rates for
//! comparison, 1000 rows per second. The converters round; each has white noise of one code. The nutation of the start decays before the
//! log begins. The firmware takes no part: its observer is designed for the log afterwards (`stand vibration compensate`).

use std::path::Path;

use hal_sim::element::{BaseVibration, FourState, RigidBody};
use hal_sim::peripherals::Noise;
use stand_firmware::board::Hardware;

use identification::log::{Column, Format, Log, LogError, Note, Notes};

/// Interval of the rows, s.
const STEP_S: f64 = 1e-3;
/// Time before the log, in which the nutation of the start decays, s.
const SETTLING_S: f64 = 60.0;
/// Gain of the angle sensor, V/rad: ± 33 mrad in the range of the converter.
const ANGLE_GAIN_V_RAD: f64 = 50.0;
/// Streams of the noise.
const ANGLE_STREAM: u32 = 70;
const ROLL_STREAM: u32 = 71;

/// What is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VibrationSimulation {
    /// The sensitive element.
    pub element: FourState,
    /// Vibration of its base.
    pub vibration: BaseVibration,
    /// Azimuth at the start, rad; the mean under vibration leaves no precession.
    pub start_rad: f64,
    /// Duration of the log, s.
    pub seconds: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Why there is no log.
#[derive(Debug, thiserror::Error)]
pub enum VibrationSimulationError {
    /// The azimuth leaves the range of the angle sensor.
    #[error("the azimuth leaves the range of the angle sensor, ± {range_mrad:.0} mrad, at {t_s:.1} s; reduce the vibration")]
    OutOfRange {
        /// Time before or in the log, s.
        t_s: f64,
        /// Range, mrad.
        range_mrad: f64,
    },
    /// Simulation ended by the caller.
    #[error("interrupted")]
    Interrupted,
    /// The name of the log is invalid, or it cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
}

impl VibrationSimulation {
    /// Simulates and writes the log. `goes_on` is asked with the time of each row, s.
    ///
    /// # Errors
    /// As [`VibrationSimulationError`]; no file remains.
    pub fn write(&self, path: &Path, mut goes_on: impl FnMut(f64) -> bool) -> Result<Log, VibrationSimulationError> {
        // Checked first: a wrong ending must not cost the simulation.
        Format::of(path)?;
        let hardware = Hardware::default();
        let range_V = hardware.angle_zero_code * hardware.angle_V_per_code;
        let mut noise = [ANGLE_STREAM, ROLL_STREAM].map(|stream| Noise::new(self.seed, stream, 1.0));
        let mut read = |channel: usize, value: f64, code: f64| (value / code + noise[channel].draw()).round() * code;
        let mut body = RigidBody::new(self.element, self.vibration, self.start_rad);
        let steps = |seconds: f64| (seconds / STEP_S).round() as usize;
        let mut columns: [Vec<f64>; 5] = Default::default();
        for k in 0..steps(SETTLING_S) + steps(self.seconds) {
            let now = body.attitude();
            let volts = ANGLE_GAIN_V_RAD * now.alpha_rad;
            if volts.is_nan() || volts.abs() >= range_V {
                return Err(VibrationSimulationError::OutOfRange {
                    t_s: body.t_s() - SETTLING_S,
                    range_mrad: 1e3 * range_V / ANGLE_GAIN_V_RAD,
                });
            }
            if let Some(row) = k.checked_sub(steps(SETTLING_S)) {
                let t_s = row as f64 * STEP_S;
                if !goes_on(t_s) {
                    return Err(VibrationSimulationError::Interrupted);
                }
                let angle = read(0, volts, hardware.angle_V_per_code);
                let roll = read(1, now.gamma_rad, hardware.roll_rad_per_code);
                let values = [t_s, angle, roll, now.alpha_rate_rad_s, now.beta_rate_rad_s];
                columns.iter_mut().zip(values).for_each(|(column, value)| column.push(value));
            }
            body.advance(0.0, STEP_S);
        }
        let names = ["t_s", "angle_sensor_V", "gamma_rad", "alpha_rate_rad_s", "beta_rate_rad_s"];
        let columns = names.into_iter().zip(columns).map(|(name, values)| Column { name: name.to_owned(), values }).collect();
        let notes = Notes::from_iter([
            Note::Number("angle_gain_V_rad", ANGLE_GAIN_V_RAD),
            Note::Number("vibration_g", self.vibration.overload_g),
            Note::Number("vibration_Hz", self.vibration.rate_rad_s / std::f64::consts::TAU),
        ]);
        let log = Log::new(path, columns, notes)?;
        log.write(path)?;
        Ok(log)
    }
}
