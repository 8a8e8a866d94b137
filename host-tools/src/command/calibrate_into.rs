//! Writes the results of a calibration into a model file or into the settings of the stand.

use super::error::CliError;
use crate::calibrate::DutKind;
use crate::calibrate::record::CalibrationRecord;
use crate::model::Model;

/// How a result changes a setting.
pub(super) enum Setting {
    /// The setting takes this value.
    Value(f64),
    /// The setting is divided by this value.
    DividedBy(f64),
}

/// Settings of the firmware that the calibration determines.
pub(super) fn settings(record: &CalibrationRecord) -> Vec<(&'static str, Setting)> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    match record.session.dut_kind {
        DutKind::Drive => ["resistance_ohm", "motor_constant_N_m_A", "inertia_kg_m2"]
            .into_iter()
            .filter_map(|name| get(name).map(|value| (name, Setting::Value(value))))
            .collect(),
        DutKind::Gyro if record.session.column.as_deref() == Some("omega_rad_s") => {
            get("scale").map(|scale| ("rate_rad_s_per_code", Setting::DividedBy(scale))).into_iter().collect()
        }
        DutKind::Gyro | DutKind::Accel => Vec::new(),
    }
}

/// Writes the results into a model: parameters of the drive, or effects of the rate sensor.
///
/// # Errors
/// The model has no such device.
pub(super) fn model(record: &CalibrationRecord, model: &mut Model) -> Result<(), CliError> {
    let get = |name: &str| record.findings.get(name).map(|q| q.value);
    let values: Vec<(&str, &str, f64)> = match record.session.dut_kind {
        DutKind::Drive => [
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
        DutKind::Gyro if record.session.column.as_deref() == Some("omega_rad_s") => {
            [("rate-scale", "rate_scale", get("scale").map(|s| s - 1.0)), ("rate-bias", "rate_bias_rad_s", get("bias_rad_s"))]
                .into_iter()
                .filter_map(|(effect, name, value)| value.map(|value| (effect, name, value)))
                .collect()
        }
        kind => {
            let message =
                "--into-model: a model contains the drive and the rate sensor of the stand (a session with column = \"omega_rad_s\")";
            return Err(CliError::Input(format!("{message}, but no {} under test", kind.name())));
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
