//! A session: what is run on a stand for a calibration, step by step, unattended where no person is needed.
//!
//! In: a file in TOML ([`Session`]) and a stand. Out: a folder with a raw log for each step, and a journal ([`journal`]) that says after each step what was done,
//! with the log's SHA-256; so a session that was broken off goes on with the step that is not done ([`run`]). What the stand cannot do is refused before
//! anything moves ([`check`]).

pub mod check;
pub mod journal;
mod plan;
mod ready;
pub mod run;
pub mod simulated;
mod stable;
mod step;

pub use check::check;

use super::{Known, Mounted};
use crate::statistics::uncertainty::CONFIDENCE;
use serde::{Deserialize, Serialize};
use stand_firmware::speed_loop::Mode;
use std::collections::BTreeMap;

/// What is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum What {
    /// A rate gyro.
    Gyro,
    /// An accelerometer, as a rate sensor at a radius.
    Accel,
    /// The stand's own drive.
    Drive,
}

impl What {
    /// Its name on the command line and in records.
    pub fn name(self) -> &'static str {
        match self {
            What::Gyro => "gyro",
            What::Accel => "accel",
            What::Drive => "drive",
        }
    }

    /// The usual session, as a file with comments.
    pub fn usual(self) -> &'static str {
        match self {
            What::Gyro => include_str!("gyro.toml"),
            What::Accel => include_str!("accel.toml"),
            What::Drive => include_str!("drive.toml"),
        }
    }
}

/// How the drive is regulated in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum How {
    /// Not at all: the platform rests, or coasts.
    Off,
    /// The speed loop holds the profile's rate.
    Rate,
    /// The profile is the voltage.
    Voltage,
}

impl How {
    /// As the firmware has it.
    pub fn mode(self) -> Mode {
        match self {
            How::Off => Mode::Off,
            How::Rate => Mode::Rate,
            How::Voltage => Mode::Voltage,
        }
    }
}

/// A session's file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Session {
    /// What is calibrated.
    pub what: What,
    /// The part's type.
    #[serde(default)]
    pub sensor: String,
    /// Its serial number.
    #[serde(default)]
    pub serial: String,
    /// Who runs it.
    #[serde(default)]
    pub operator: String,
    /// The sensor's column; the usual one by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub column: Option<String>,
    /// Rate to which per cents refer, rad/s; else the greatest that was run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub full_scale_rad_s: Option<f64>,
    /// Left out at the begin of each plateau, s.
    #[serde(default = "settle")]
    pub settle_s: f64,
    /// What no log shows.
    #[serde(default)]
    pub known: Known,
    /// What no step may pass, beside the stand's own limits.
    #[serde(default)]
    pub limits: Limits,
    /// What is run, in this order.
    pub steps: Vec<StepPlan>,
}

fn settle() -> f64 {
    0.5
}

/// What no step may pass.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Greatest rate, rad/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_rad_s: Option<f64>,
    /// Greatest voltage, V.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voltage_V: Option<f64>,
}

/// One step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StepPlan {
    /// Its name, which is part of its log's.
    pub name: String,
    /// What a person must do first.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ask: Option<String>,
    /// How the part is mounted from this step on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mounted: Option<Mounted>,
    /// How the drive is regulated.
    pub mode: How,
    /// Length of the record, s.
    pub seconds: f64,
    /// The step ends before that, once the part's temperature (a drive's: the winding's) has changed by less than this a minute, K/min.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stable_K_min: Option<f64>,
    /// The drive goes off after so long, while the record goes on, s: the platform runs out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drive_s: Option<f64>,
    /// Which profile; none where the drive is off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub profile: Option<String>,
    /// A moment of inertia that was added to the platform for this step, kg m².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub added_inertia_kg_m2: Option<f64>,
    /// The profile's parameters by the firmware's names.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, toml::Value>,
}

/// Why a session cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// Not TOML, or keys that no session has.
    #[error("{0}")]
    Toml(String),
    /// A step that makes no sense.
    #[error("step {number} `{name}`: {says}")]
    Step {
        /// From 1.
        number: usize,
        /// Its name.
        name: String,
        /// What is wrong.
        says: String,
    },
    /// A value of the whole.
    #[error("{0}")]
    Whole(String),
}

impl Session {
    /// Reads a file's text and checks all that can be checked without a stand.
    ///
    /// # Errors
    /// The first thing that is wrong, with its step and parameter.
    pub fn parse(text: &str) -> Result<Self, PlanError> {
        let session: Self = toml::from_str(text).map_err(|e| PlanError::Toml(e.to_string().lines().collect::<Vec<_>>().join(" ")))?;
        let whole = |says: String| Err(PlanError::Whole(says));
        if session.steps.is_empty() {
            return whole("steps: there is none".into());
        }
        if !(0.0..=3600.0).contains(&session.settle_s) {
            return whole(format!("settle_s: {} is outside 0 … 3600", session.settle_s));
        }
        if let Some(fs) = session.full_scale_rad_s.filter(|fs| !(*fs > 0.0 && fs.is_finite())) {
            return whole(format!("full_scale_rad_s: {fs} must be above 0"));
        }
        if let Some(latitude) = session.known.latitude_deg.filter(|l| !(-90.0..=90.0).contains(l)) {
            return whole(format!("known.latitude_deg: {latitude} is outside -90 … 90"));
        }
        let known = &session.known;
        let halves = [
            ("crystal_ppm", known.crystal_ppm),
            ("misalignment_deg", known.misalignment_deg),
            ("level_deg", known.level_deg),
            ("radius_error_m", known.radius_error_m),
            ("current_percent", known.current_percent),
            ("supply_percent", known.supply_percent),
            ("temperature_K", known.temperature_K),
            ("scale_percent", known.scale_percent),
        ];
        if let Some((name, value)) = halves.iter().find(|(_, v)| !(*v >= 0.0 && v.is_finite())) {
            return whole(format!("known.{name}: {value} must be 0 or more"));
        }
        for (k, step) in session.steps.iter().enumerate() {
            let doubled = session.steps[..k].iter().any(|s| s.name == step.name);
            let says = if doubled {
                Err("another step has this name".to_owned())
            } else if step.stable_K_min.is_some() && session.temperature().is_none() {
                Err("stable_K_min: the logs of this session have no temperature".to_owned())
            } else {
                step.config().map(|_| ())
            };
            says.map_err(|says| PlanError::Step { number: k + 1, name: step.name.clone(), says })?;
        }
        Ok(session)
    }

    /// Time that all steps take, s.
    pub fn seconds(&self) -> f64 {
        self.steps.iter().map(|s| s.seconds).sum()
    }

    /// The logs' column with the temperature of what is calibrated; `None`: there is none.
    pub fn temperature(&self) -> Option<&'static str> {
        match self.what {
            What::Drive => Some("temp_C"),
            What::Gyro if self.column.as_deref() != Some("omega_rad_s") => Some("sensor_C"),
            What::Gyro | What::Accel => None,
        }
    }

    /// How the part is mounted in each step.
    pub fn mounted(&self) -> Vec<Mounted> {
        let mut now = Mounted::default();
        self.steps
            .iter()
            .map(|step| {
                now = step.mounted.unwrap_or(now);
                now
            })
            .collect()
    }

    /// Said in each record.
    pub fn statement() -> String {
        format!("Expanded uncertainties hold with a probability of {} %. This is not an accredited certificate.", CONFIDENCE * 100.0)
    }
}

#[cfg(test)]
mod tests;
