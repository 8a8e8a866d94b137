//! What this stand cannot do is refused before anything moves, with the reason.

use super::{How, PlanError, Session, StepPlan, What};
use crate::acquire::connection::{ConnectionError, StandConnection};
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use std::f64::consts::TAU;

/// The limits of a stand that matter here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Able {
    /// Above it the stand switches off, rad/s.
    pub overspeed_rad_s: f64,
    /// Its speed loop's, rad/s².
    pub acceleration_rad_s2: f64,
    /// The bridge's, V.
    pub voltage_V: f64,
    /// A sensor under test answers.
    pub has_sensor: bool,
}

impl Able {
    /// Asks the stand.
    ///
    /// # Errors
    /// The line; a firmware that does not answer.
    pub async fn of(stand: &mut impl StandConnection) -> Result<Self, ConnectionError> {
        let mut numbers = [0.0; 3];
        for (number, name) in numbers.iter_mut().zip(["overspeed_rad_s", "acceleration_rad_s2", "voltage_limit_V"]) {
            let query = format!("SETTings:{name}?");
            let says = stand.query(&query).await?;
            let word = says.split([' ', ',']).next().unwrap_or_default().parse();
            *number = word.map_err(|_| ConnectionError::Reply { query, says })?;
        }
        let [overspeed_rad_s, acceleration_rad_s2, voltage_V] = numbers;
        let has_sensor = stand.query("IMU?").await?.contains("RUNNING");
        Ok(Self { overspeed_rad_s, acceleration_rad_s2, voltage_V, has_sensor })
    }
}

/// Whether this stand can run this session.
///
/// # Errors
/// The first step that it cannot run, and why.
pub fn check(session: &Session, able: &Able) -> Result<(), PlanError> {
    let needs_sensor = match session.what {
        What::Gyro => session.column.as_deref().is_none_or(|c| c != "omega_rad_s"),
        What::Accel => true,
        What::Drive => false,
    };
    if needs_sensor && !able.has_sensor {
        return Err(PlanError::Whole("the stand has no sensor under test that runs (`IMU?` in `stand console` says why); column = \"omega_rad_s\" calibrates its own".into()));
    }
    for (k, step) in session.steps.iter().enumerate() {
        let can = step.config().and_then(|config| config.map_or(Ok(()), |config| can_run(step, &config, session, able)));
        can.map_err(|says| PlanError::Step { number: k + 1, name: step.name.clone(), says })?;
    }
    Ok(())
}

fn can_run(step: &StepPlan, config: &ProfileConfig, session: &Session, able: &Able) -> Result<(), String> {
    let most = config.amplitude.abs() + config.offset.abs();
    let within = |limit: f64, whose: &str, unit: &str| {
        if most > limit { Err(format!("amplitude and offset: {most} {unit} is beyond {whose} of {limit} {unit}")) } else { Ok(()) }
    };
    match step.mode {
        How::Off => Ok(()),
        How::Voltage => {
            within(able.voltage_V, "the stand's limit", "V")?;
            session.limits.voltage_V.map_or(Ok(()), |limit| within(limit, "the session's limit", "V"))
        }
        How::Rate => {
            // What overshoots must not switch off.
            within(0.95 * able.overspeed_rad_s, "95 % of the overspeed limit, that is", "rad/s")?;
            session.limits.rate_rad_s.map_or(Ok(()), |limit| within(limit, "the session's limit", "rad/s"))?;
            let fastest_Hz = match config.kind {
                ProfileKind::Sine => config.frequency_Hz,
                ProfileKind::Chirp | ProfileKind::ChirpLinear => config.to_Hz,
                _ => return Ok(()),
            };
            let needs = TAU * fastest_Hz * config.amplitude.abs();
            if needs > able.acceleration_rad_s2 {
                return Err(format!(
                    "frequency: a rate of ± {} rad/s at {fastest_Hz} Hz takes {needs:.0} rad/s², and the speed loop allows {}; run it as a voltage",
                    config.amplitude.abs(),
                    able.acceleration_rad_s2
                ));
            }
            Ok(())
        }
    }
}
