//! Checks a session against the limits of a stand before anything moves.

use super::{DriveMode, DutKind, PlanError, Session, StepPlan};
use crate::connection::{ConnectionError, StandConnection};
use crate::preparation::query_number;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use std::f64::consts::TAU;

/// Part of the overspeed limit that a profile may reach: the speed loop overshoots a step by less than 5 %.
const MAX_RATE_PART: f64 = 0.95;

/// Limits of a stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandLimits {
    /// Rate above which the stand switches off, rad/s.
    pub overspeed_rad_s: f64,
    /// Greatest acceleration of the speed loop, rad/s².
    pub acceleration_rad_s2: f64,
    /// Greatest voltage of the bridge, V.
    pub voltage_V: f64,
    /// A device under test delivers samples.
    pub has_dut: bool,
}

impl StandLimits {
    /// Queries the limits of a stand.
    ///
    /// # Errors
    /// The serial line; an answer that is not a number.
    pub async fn query(stand: &mut impl StandConnection) -> Result<Self, ConnectionError> {
        let mut numbers = [0.0; 3];
        for (number, name) in numbers.iter_mut().zip(["overspeed_rad_s", "acceleration_rad_s2", "voltage_limit_V"]) {
            *number = query_number(stand, &format!("SETTings:{name}?")).await?;
        }
        let [overspeed_rad_s, acceleration_rad_s2, voltage_V] = numbers;
        let has_dut = stand.query("IMU?").await?.contains("RUNNING");
        Ok(Self { overspeed_rad_s, acceleration_rad_s2, voltage_V, has_dut })
    }
}

/// Checks that a stand can run a session.
///
/// # Errors
/// The session needs a device under test and none runs; or the first step that the stand cannot run, with the reason.
pub fn check(session: &Session, stand: &StandLimits) -> Result<(), PlanError> {
    if session.uses_sensor_under_test() && !stand.has_dut {
        let instead = match session.dut_kind {
            DutKind::Gyro => "; column = \"omega_rad_s\" calibrates the rate sensor of the stand",
            _ => "",
        };
        let reason = format!("the stand has no running device under test (`IMU?` in `stand console` gives the reason){instead}");
        return Err(PlanError::Session(reason));
    }
    for (k, step) in session.steps.iter().enumerate() {
        let checked = step.config().and_then(|config| config.map_or(Ok(()), |config| check_step(step, &config, session, stand)));
        checked.map_err(|message| PlanError::Step { number: k + 1, name: step.name.clone(), message })?;
    }
    Ok(())
}

fn check_step(step: &StepPlan, config: &ProfileConfig, session: &Session, stand: &StandLimits) -> Result<(), String> {
    let greatest = config.amplitude.abs() + config.offset.abs();
    let within = |limit: f64, whose: &str, unit: &str| {
        if greatest > limit { Err(format!("amplitude and offset: {greatest} {unit} exceeds {whose} of {limit} {unit}")) } else { Ok(()) }
    };
    match step.mode {
        DriveMode::Off => Ok(()),
        DriveMode::Voltage => {
            within(stand.voltage_V, "the stand's limit", "V")?;
            session.limits.voltage_V.map_or(Ok(()), |limit| within(limit, "the session's limit", "V"))
        }
        DriveMode::Rate => {
            let whose = format!("{} % of the overspeed limit, that is", 100.0 * MAX_RATE_PART);
            within(MAX_RATE_PART * stand.overspeed_rad_s, &whose, "rad/s")?;
            session.limits.rate_rad_s.map_or(Ok(()), |limit| within(limit, "the session's limit", "rad/s"))?;
            let fastest_Hz = match config.kind {
                ProfileKind::Sine => config.frequency_Hz,
                ProfileKind::Chirp | ProfileKind::ChirpLinear => config.to_Hz,
                _ => return Ok(()),
            };
            let acceleration = TAU * fastest_Hz * config.amplitude.abs();
            if acceleration > stand.acceleration_rad_s2 {
                return Err(format!(
                    "frequency: a rate amplitude of {} rad/s at {fastest_Hz} Hz needs {acceleration:.0} rad/s², the speed loop allows {}; use mode = \"voltage\"",
                    config.amplitude.abs(),
                    stand.acceleration_rad_s2
                ));
            }
            Ok(())
        }
    }
}
