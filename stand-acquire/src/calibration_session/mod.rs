//! Calibration session: the steps that are run on a stand, unattended where no operator is needed.
//!
//! Input: a TOML file ([`Session`]) and a stand. Output: a folder with one raw log per step and a journal ([`journal`]), updated after each
//! step, with the SHA-256 of the log. An interrupted session continues with the first step that is not done ([`run`]). Steps that the stand
//! cannot run are refused before anything moves ([`check`]). The analysis of the logs is in `stand-analysis`, a higher layer.

pub mod check;
mod clock;
pub mod device;
pub mod drawn_dut;
pub mod error;
mod instruction;
pub mod journal;
mod notes;
mod plan;
mod prepared;
pub mod run;
pub mod simulated;
mod stable;
mod step;

pub use check::check;
pub use clock::{ClockReading, ClockReference};
pub use device::{Assumptions, DutKind, EARTH_RAD_S, MeasuredCrystal, Mounting, Orientation, RESTART_NOTE, Step};
pub use instruction::{Action, Instruction};
pub use prepared::{PreparedSession, SessionChanges, default_folder};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use stand_firmware::speed_loop::Mode;
use std::collections::BTreeMap;

/// Operating mode of the drive in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DriveMode {
    /// Off: the platform rests or coasts.
    Off,
    /// The speed loop follows the rate of the profile.
    Rate,
    /// The profile is the voltage.
    Voltage,
}

impl DriveMode {
    /// The mode of the firmware.
    pub fn mode(self) -> Mode {
        match self {
            DriveMode::Off => Mode::Off,
            DriveMode::Rate => Mode::Rate,
            DriveMode::Voltage => Mode::Voltage,
        }
    }
}

/// The content of a session file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Session {
    /// What is calibrated.
    #[serde(rename = "what")]
    pub dut_kind: DutKind,
    /// Type of the device under test.
    #[serde(default)]
    pub sensor: String,
    /// Its serial number.
    #[serde(default)]
    pub serial: String,
    /// The operator.
    #[serde(default)]
    pub operator: String,
    /// Log column of the device under test; `None` for the default one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Full scale, rad/s; `None` for the greatest rate that was run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_scale_rad_s: Option<f64>,
    /// Band about the final output at rest that ends the warm-up, rad/s; without it there is no warm-up time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warm_up_band_rad_s: Option<f64>,
    /// Settling time at the beginning of each plateau, s.
    #[serde(default = "default_settle_s")]
    pub settle_s: f64,
    /// Knowledge that no log contains.
    #[serde(default, rename = "known")]
    pub assumptions: Assumptions,
    /// Second clock at the stand's input for one pulse per second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_reference: Option<ClockReference>,
    /// Limits of all steps, beside those of the stand.
    #[serde(default)]
    pub limits: Limits,
    /// The steps, in their order.
    pub steps: Vec<StepPlan>,
}

fn default_settle_s() -> f64 {
    0.5
}

/// Limits of all steps.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Greatest rate, rad/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_rad_s: Option<f64>,
    /// Greatest voltage, V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voltage_V: Option<f64>,
}

/// One step of a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StepPlan {
    /// Name; part of the log's file name.
    pub name: String,
    /// Instruction to the operator before the step.
    #[serde(default, rename = "ask", skip_serializing_if = "Option::is_none")]
    pub instruction: Option<String>,
    /// Mounting of the device under test from this step on.
    #[serde(default, rename = "mounted", skip_serializing_if = "Option::is_none")]
    pub mounting: Option<Mounting>,
    /// Operating mode of the drive.
    pub mode: DriveMode,
    /// Duration of the record, s.
    pub seconds: f64,
    /// The step ends earlier once the temperature of the device under test (of a drive: of the winding) changes by less than this, K/min.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stable_K_min: Option<f64>,
    /// The sensor under test is reset and set up anew before the record, with its supply on.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub restart_sensor: bool,
    /// Time after which the drive is switched off while the record continues, s: the platform coasts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_s: Option<f64>,
    /// Profile; `None` where the drive is off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// Moment of inertia added to the platform for this step, kg m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_inertia_kg_m2: Option<f64>,
    /// Parameters of the profile by their names in the firmware.
    #[serde(flatten)]
    #[schemars(with = "BTreeMap<String, serde_json::Value>")]
    pub parameters: BTreeMap<String, toml::Value>,
}

/// Why a session is refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// Not TOML, or unknown keys.
    #[error("{0}")]
    Toml(String),
    /// An invalid step.
    #[error("step {number} `{name}`: {message}")]
    Step {
        /// From 1.
        number: usize,
        /// Its name.
        name: String,
        /// What is wrong.
        message: String,
    },
    /// An invalid value of the session, or a stand that cannot run it.
    #[error("{0}")]
    Session(String),
}

impl Session {
    /// Parses a session file and checks it as far as possible without a stand.
    ///
    /// # Errors
    /// The first error, with step and parameter.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        let session: Self = toml::from_str(text).map_err(|e| PlanError::Toml(e.to_string().lines().collect::<Vec<_>>().join(" ")))?;
        let invalid = |message: String| Err(PlanError::Session(message));
        if session.steps.is_empty() {
            return invalid("steps: the session has none".into());
        }
        if !(0.0..=3600.0).contains(&session.settle_s) {
            return invalid(format!("settle_s: {} is outside 0 … 3600", session.settle_s));
        }
        if let Some(fs) = session.full_scale_rad_s.filter(|fs| !(*fs > 0.0 && fs.is_finite())) {
            return invalid(format!("full_scale_rad_s: {fs} must be above 0"));
        }
        if let Some(band) = session.warm_up_band_rad_s.filter(|band| !(*band > 0.0 && band.is_finite())) {
            return invalid(format!("warm_up_band_rad_s: {band} must be above 0"));
        }
        if let Some(latitude) = session.assumptions.latitude_deg.filter(|l| !(-90.0..=90.0).contains(l)) {
            return invalid(format!("known.latitude_deg: {latitude} is outside -90 … 90"));
        }
        if let Some(reference) = &session.clock_reference {
            if reference.name.trim().is_empty() {
                return invalid("clock_reference.name: record and certificate need the name of the reference".into());
            }
            if !(0.0..=100.0).contains(&reference.error_ppm) {
                return invalid(format!("clock_reference.error_ppm: {} is outside 0 … 100", reference.error_ppm));
            }
        }
        let assumed = &session.assumptions;
        let half_widths = [
            ("crystal_ppm", assumed.crystal_ppm),
            ("misalignment_deg", assumed.misalignment_deg),
            ("level_deg", assumed.level_deg),
            ("radius_error_m", assumed.radius_error_m),
            ("current_percent", assumed.current_percent),
            ("supply_percent", assumed.supply_percent),
            ("temperature_K", assumed.temperature_K),
            ("scale_percent", assumed.scale_percent),
            ("g_sensitivity_deg_s_g", assumed.g_sensitivity_deg_s_g),
        ];
        if let Some((name, value)) = half_widths.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite())) {
            return invalid(format!("known.{name}: {value} must be 0 or more"));
        }
        for (k, step) in session.steps.iter().enumerate() {
            let is_duplicate = session.steps[..k].iter().any(|s| s.name == step.name);
            let checked = if is_duplicate {
                Err("another step has this name".to_owned())
            } else if step.restart_sensor && !session.uses_sensor_under_test() {
                Err("restart_sensor: the device of this session is not the sensor under test of the stand".to_owned())
            } else if step.stable_K_min.is_some() && session.temperature_column().is_none() {
                Err("stable_K_min: the logs of this session have no temperature".to_owned())
            } else {
                step.config().map(|_| ())
            };
            checked.map_err(|message| PlanError::Step { number: k + 1, name: step.name.clone(), message })?;
        }
        Ok(session)
    }

    /// Duration of all steps, s.
    pub fn seconds(&self) -> f64 {
        self.steps.iter().map(|s| s.seconds).sum()
    }

    /// The device of the session is the sensor under test of the stand.
    pub fn uses_sensor_under_test(&self) -> bool {
        match self.dut_kind {
            DutKind::Gyro => self.column.as_deref().is_none_or(|c| c != "omega_rad_s"),
            DutKind::Accel => true,
            DutKind::Drive => false,
        }
    }

    /// Log column with the temperature of the device under test; `None` where there is none.
    pub fn temperature_column(&self) -> Option<&'static str> {
        match self.dut_kind {
            DutKind::Drive => Some("temp_C"),
            DutKind::Gyro if self.column.as_deref() != Some("omega_rad_s") => Some("sensor_C"),
            DutKind::Gyro | DutKind::Accel => None,
        }
    }

    /// Mounting of the device under test in each step.
    pub fn mountings(&self) -> Vec<Mounting> {
        let mut current = Mounting::default();
        self.steps
            .iter()
            .map(|step| {
                current = step.mounting.unwrap_or(current);
                current
            })
            .collect()
    }
}

/// The default session, as a commented file.
pub fn default_session(kind: DutKind) -> &'static str {
    match kind {
        DutKind::Gyro => include_str!("gyro.toml"),
        DutKind::Accel => include_str!("accel.toml"),
        DutKind::Drive => include_str!("drive.toml"),
    }
}

#[cfg(test)]
mod tests;
