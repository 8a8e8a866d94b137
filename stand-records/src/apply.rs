//! Results of a calibration in a model or in the settings of a stand.
//!
//! A model and the settings contain the parameters of the drive and of the stand's rate sensor. Results for another device have no place in
//! them.

use super::record::CalibrationRecord;
use identification::model::{Model, ModelError};
use identification::parameters::NamesParameters;
use stand_acquire::connection::{ConnectionError, StandConnection};
use stand_acquire::preparation::query_number;
use stand_analysis::calibrate::DutKind;

/// Results of the drive that are parameters of a model: effect (empty for a base parameter) and name.
const DRIVE_PARAMETERS: [(&str, &str); 6] = [
    ("", "inertia_kg_m2"),
    ("", "motor_constant_N_m_A"),
    ("", "resistance_ohm"),
    ("inductance", "inductance_H"),
    ("viscous", "viscous_N_m_s"),
    ("coulomb", "coulomb_N_m"),
];
/// Results of the drive that are settings of the stand.
const DRIVE_SETTINGS: [&str; 3] = ["resistance_ohm", "motor_constant_N_m_A", "inertia_kg_m2"];
/// Setting with the scale of the stand's rate sensor.
const RATE_SCALE_SETTING: &str = "rate_rad_s_per_code";

/// Why results are not written into a model.
#[derive(Debug, thiserror::Error)]
pub enum ApplyError {
    /// A model does not contain the device.
    #[error(
        "a model contains the drive and the rate sensor of the stand (a session with column = \"omega_rad_s\"), but no {} under test",
        .0.name()
    )]
    Device(DutKind),
    /// The model rejects an effect or a value.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl NamesParameters for ApplyError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            ApplyError::Device(_) => vec!["model"],
            _ => Vec::new(),
        }
    }
}

/// The device under test is the rate sensor of the stand.
fn is_rate_sensor(record: &CalibrationRecord) -> bool {
    record.session.dut_kind == DutKind::Gyro && record.session.column.as_deref() == Some("omega_rad_s")
}

/// Writes the results into a model: parameters of the drive, or effects of the rate sensor. Missing effects are added.
///
/// # Errors
/// The model does not contain the device, or rejects a value.
pub fn apply_to_model(record: &CalibrationRecord, model: &mut Model) -> Result<(), ApplyError> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    let values: Vec<(&str, &str, Option<f64>)> = match record.session.dut_kind {
        DutKind::Drive => DRIVE_PARAMETERS.into_iter().map(|(effect, name)| (effect, name, get(name))).collect(),
        DutKind::Gyro if is_rate_sensor(record) => {
            vec![("rate-scale", "rate_scale", get("scale").map(|s| s - 1.0)), ("rate-bias", "rate_bias_rad_s", get("bias_rad_s"))]
        }
        kind => return Err(ApplyError::Device(kind)),
    };
    for (effect, name, value) in values {
        let Some(value) = value else { continue };
        if !effect.is_empty() && !model.effect_names().iter().any(|known| known == effect) {
            model.add(effect)?;
        }
        model.set(name, value)?;
    }
    Ok(())
}

/// Writes the results into the settings of a stand and saves them. Returns the changed settings and their new values; without any, nothing
/// is saved.
///
/// # Errors
/// The connection fails, or the stand rejects a value.
pub async fn apply_to_stand(
    record: &CalibrationRecord,
    stand: &mut impl StandConnection,
) -> Result<Vec<(&'static str, f64)>, ConnectionError> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    let mut values: Vec<(&'static str, f64)> = Vec::new();
    if record.session.dut_kind == DutKind::Drive {
        values.extend(DRIVE_SETTINGS.into_iter().filter_map(|name| get(name).map(|value| (name, value))));
    } else if is_rate_sensor(record)
        && let Some(scale) = get("scale")
    {
        let present = query_number(stand, &format!("SETTings:{RATE_SCALE_SETTING}?")).await?;
        values.push((RATE_SCALE_SETTING, present / scale));
    }
    for (setting, value) in &values {
        stand.command(&format!("SETTings:{setting} {value:e}")).await?;
    }
    if !values.is_empty() {
        stand.command("SETTings:SAVE").await?;
    }
    Ok(values)
}
