//! Notes of the log of a step.

use super::error::RunError;
use super::{DutKind, Mounting, RESTART_NOTE, Session, StepPlan};
use crate::connection::{ConnectionError, StandConnection};
use crate::link::reply_number;
use crate::preparation::ColumnSettings;
use identification::log::{Note, Notes};
use stand_firmware::profile::Parameter;

/// Notes of the log (docs/logs-and-models.md).
pub(super) async fn notes(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    mounting: &Mounting,
    has_index: bool,
) -> Result<Notes, RunError> {
    let mut notes = Notes::from_iter([Note::Stand(stand.query("*IDN?").await?), Note::Date, Note::Text("step", plan.name.clone())]);
    let texts = [("sensor", &session.sensor), ("serial", &session.serial), ("operator", &session.operator)];
    notes.extend(texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(key, text)| Note::Text(key, text.clone())));
    notes.extend([
        Note::Mode(format!("{:?}", plan.mode).to_lowercase()),
        Note::Number("radius_m", mounting.radius_m),
        Note::Number("tilt_deg", mounting.tilt_deg),
    ]);
    if let Some(config) = plan.config().ok().flatten() {
        notes.push(Note::Profile(config.kind.name().to_owned()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        notes.extend(parameters.map(|p| Note::ProfileParameter { name: p.name, value: (p.read)(&config) }));
    }
    notes.replace(ColumnSettings::query(stand).await?.notes(has_index));
    // Low-pass of the chip, whose gain and phase are known.
    let column = match session.dut_kind {
        DutKind::Gyro if session.column.as_deref() != Some("omega_rad_s") => Some(0),
        DutKind::Accel => Some(1),
        _ => None,
    };
    if let Some(column) = column {
        let query = "IMU:FILTer?";
        let reply = stand.query(query).await?;
        let number = reply.split(',').nth(column).and_then(reply_number);
        let cutoff_Hz = number.ok_or_else(|| ConnectionError::Reply { query: query.to_owned(), reply })?;
        notes.push(Note::Number("sensor_filter_Hz", cutoff_Hz));
    }
    notes.extend(plan.restart_sensor.then(|| Note::Text(RESTART_NOTE, "software reset and set-up, supply on".to_owned())));
    notes.extend(plan.drive_s.map(|drive_s| Note::Number("drive_s", drive_s)));
    Ok(notes)
}
