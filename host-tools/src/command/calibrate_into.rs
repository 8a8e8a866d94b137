//! Where a calibration goes: into a model file, into the stand's settings.

use super::error::CliError;
use crate::calibrate::record::Record;
use crate::calibrate::session::What;
use crate::model::Model;

/// What becomes of a setting.
pub(super) enum Setting {
    /// It is this.
    Is(f64),
    /// It is what it was, over this.
    Over(f64),
}

/// Settings of the firmware that are what was calibrated.
pub(super) fn settings(record: &Record) -> Vec<(&'static str, Setting)> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    match record.session.what {
        What::Drive => ["resistance_ohm", "motor_constant_N_m_A", "inertia_kg_m2"]
            .into_iter()
            .filter_map(|name| get(name).map(|value| (name, Setting::Is(value))))
            .collect(),
        What::Gyro if record.session.column.as_deref() == Some("omega_rad_s") => {
            get("scale").map(|scale| ("rate_rad_s_per_code", Setting::Over(scale))).into_iter().collect()
        }
        What::Gyro | What::Accel => Vec::new(),
    }
}

/// Writes it into a model: the drive's parameters, or the effects of the rate sensor.
///
/// # Errors
/// What was calibrated is no part of such a model.
pub(super) fn model(record: &Record, model: &mut Model) -> Result<(), CliError> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    let values: Vec<(&str, &str, f64)> = match record.session.what {
        What::Drive => [
            ("", "inertia_kg_m2"),
            ("", "motor_constant_N_m_A"),
            ("", "resistance_ohm"),
            ("inductance", "inductance_H"),
            ("viscous", "viscous_N_m_s"),
            ("coulomb", "coulomb_N_m"),
        ]
        .into_iter()
        .filter_map(|(effect, name)| get(name).map(|value| (effect, name, value)))
        .collect(),
        What::Gyro if record.session.column.as_deref() == Some("omega_rad_s") => {
            [("rate-scale", "rate_scale", get("scale").map(|s| s - 1.0)), ("rate-bias", "rate_bias_rad_s", get("bias_rad_s"))]
                .into_iter()
                .filter_map(|(effect, name, value)| value.map(|value| (effect, name, value)))
                .collect()
        }
        what => {
            let says = "--into-model: a model of the drive has the stand's own rate sensor (a session with column = \"omega_rad_s\") and the drive";
            return Err(CliError::Input(format!("{says}, and no {} under test", what.name())));
        }
    };
    for (effect, name, value) in values {
        if !effect.is_empty() && !model.effect_names().iter().any(|known| known == effect) {
            model.add(effect)?;
        }
        model.set(name, value)?;
    }
    Ok(())
}
