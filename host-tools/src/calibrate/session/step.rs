//! One step: what is asked of the stand, and its rows into a log.

use super::ready::{WATCH, at_rest, fault, index, is_refused, notes};
use super::run::RunError;
use super::stable::Stable;
use super::{How, Session, StepPlan};
use crate::acquire::connection::{ConnectionError, StandConnection};
use crate::acquire::link::LinkError;
use crate::acquire::record::{LogFile, Recorder, RowOutcome};
use crate::calibrate::Mounted;
use stand_firmware::profile::Parameter;
use stand_firmware::telemetry::{Channels, RowFrame};
use std::io::Write;
use std::path::Path;

/// How often is looked for rows, s.
const LOOK_S: f64 = 0.1;
/// A stand that says nothing for this long has gone, s.
const SILENCE_S: f64 = 3.0;

/// The columns of a session's logs.
fn channels(session: &Session, plan: &StepPlan) -> Channels {
    // As many as the line carries at 1 kHz: a sensor's calibration goes without supply and winding.
    let mut names = vec!["u_V", "i_A", "theta_rad", "omega_rad_s", "limits", "fault"];
    match session.what {
        super::What::Drive => names.extend(["supply_V", "temp_C"]),
        // The stand's own rate sensor: it may carry no other.
        super::What::Gyro if session.column.as_deref() == Some("omega_rad_s") => {}
        super::What::Gyro => names.extend(["gyro_rad_s", "sensor_C", "sensor_age_s"]),
        super::What::Accel => names.extend(["gyro_rad_s", "accel_x_m_s2", "accel_y_m_s2"]),
    }
    // Where the drive goes off in mid-record there is no command any more.
    if plan.mode == How::Rate && plan.drive_s.is_none() {
        names.push("rate_cmd_rad_s");
    }
    names.iter().filter_map(|name| Channels::named(name)).fold(Channels::default(), Channels::and)
}

/// What an earlier attempt at a step left is kept under a name of its own; what is to be said of it.
///
/// # Errors
/// The disk.
pub(super) fn put_aside(folder: &Path, file: &str) -> Result<Option<String>, RunError> {
    let place = LogFile::of(&folder.join(file)).map_err(|e| failed(file, e))?;
    if !place.partial_path().exists() {
        return Ok(None);
    }
    // What was killed in the middle of a row leaves half of one.
    place.cut_to_whole_rows().map_err(|e| failed(file, e))?;
    let stem = file.trim_end_matches(".parquet");
    let name = (1..).map(|n| format!("{stem}.attempt-{n}.csv")).find(|name| !folder.join(name).exists()).unwrap_or_default();
    std::fs::rename(place.partial_path(), folder.join(&name)).map_err(|e| failed(&name, e))?;
    Ok(Some(format!("{name}: what was recorded of this step before it was broken off; not in the results")))
}

fn failed(log: &str, says: impl std::fmt::Display) -> RunError {
    RunError::Write { log: log.to_owned(), says: says.to_string() }
}

/// Runs one step and writes its log; rows, and rows lost. What ends it before its time leaves whole rows.
pub(super) async fn record(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    path: &Path,
    mounted: &Mounted,
    goes: &mut impl FnMut(f64, f64) -> bool,
) -> Result<(u64, u64), RunError> {
    let place = LogFile::of(path).map_err(|e| failed(&path.display().to_string(), e))?;
    let ended = record_into(stand, session, plan, &place, path, mounted, goes).await;
    let Err(error) = ended else { return ended };
    // A full disk takes a part of a row.
    let _ = place.cut_to_whole_rows();
    let step = plan.name.clone();
    Err(match &error {
        // Refused may be because the drive went off.
        RunError::Stand(says) if is_refused(says) => match fault(stand).await {
            Ok(Some(fault)) => RunError::Fault { step, fault },
            _ => error,
        },
        RunError::Silent { .. } => match stand.query("STReam?").await {
            Ok(says) if says.starts_with('0') => RunError::Restarted { step },
            _ => error,
        },
        _ => error,
    })
}

async fn record_into(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    place: &LogFile,
    path: &Path,
    mounted: &Mounted,
    goes: &mut impl FnMut(f64, f64) -> bool,
) -> Result<(u64, u64), RunError> {
    let name = &plan.name;
    if let Some(fault) = fault(stand).await? {
        return Err(RunError::Fault { step: name.clone(), fault });
    }
    at_rest(stand, name).await?;
    let has_index = index(stand, plan.mode != How::Off).await?;
    at_rest(stand, name).await?;
    let config = plan.config().map_err(|says| RunError::Write { log: name.clone(), says })?;
    let channels = channels(session, plan);
    let list: Vec<&str> = channels.iter().map(|c| c.name).collect();
    let written = |e: std::io::Error| failed(&path.display().to_string(), e);
    let notes = notes(stand, session, plan, mounted, has_index).await?;
    let mut recorder = Recorder::new(place.create().map_err(written)?, channels, notes);
    let mut orders = Vec::new();
    if let Some(config) = &config {
        orders.push(format!("PROFile:MODE {}", if plan.mode == How::Rate { "RATE" } else { "VOLTage" }));
        orders.push(format!("PROFile:TYPE {}", config.kind.name()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        orders.extend(parameters.map(|p| format!("PROFile:{} {}", p.name, (p.read)(config))));
        orders.push(format!("PROFile:DURation {}", plan.drive_s.unwrap_or(plan.seconds + 0.5)));
    }
    orders.push(format!("STReam:CHANnels {}", list.join(",")));
    orders.push("STReam:DECimation 1".into());
    orders.push("STReam ON".into());
    orders.push(WATCH.into());
    if config.is_some() {
        orders.push("PROFile:STARt".into());
    }
    for order in &orders {
        stand.command(order).await?;
    }
    let mut stable = plan.stable_K_min.zip(session.temperature()).map(|(below_K_min, column)| Stable::new(column, below_K_min));
    let sequence = rows(stand, plan, &mut recorder, stable.as_mut(), path, goes).await?;
    let lost_rows =
        sequence.map_or(0, |(first, last)| u64::from(last.wrapping_sub(first)) + 1).saturating_sub(recorder.rows() + recorder.left_out());
    for order in ["PROFile:STOP", "HOST:ARM 0 S", "STReam OFF"] {
        stand.command(order).await?;
    }
    if !recorder.absent().is_empty() {
        return Err(RunError::Sensor { step: name.clone(), lacking: recorder.absent().join(", ") });
    }
    let written_rows = recorder.rows();
    let mut notes = vec![("lost_rows".to_owned(), lost_rows.to_string())];
    notes.extend(stable.map(|stable| ("stable".to_owned(), stable.says(recorder.last_s()))));
    recorder.finish(&notes).map_err(written)?;
    place.close().map_err(|e| failed(&path.display().to_string(), e))?;
    Ok((written_rows, lost_rows))
}

/// Takes rows until the step is long enough, or the temperature stable; the numbers of the first and the last.
async fn rows<W: Write>(
    stand: &mut impl StandConnection,
    plan: &StepPlan,
    recorder: &mut Recorder<W>,
    mut stable: Option<&mut Stable>,
    path: &Path,
    goes: &mut impl FnMut(f64, f64) -> bool,
) -> Result<Option<(u32, u32)>, RunError> {
    let written = |e: std::io::Error| failed(&path.display().to_string(), e);
    let (mut silent_s, mut since_s) = (0.0, 0.0);
    let mut numbers: Option<(u32, u32)> = None;
    let mut rate = f64::NAN;
    loop {
        let came: Vec<RowFrame> = stand.wait_s(LOOK_S).await?;
        since_s += LOOK_S;
        silent_s = if came.is_empty() { silent_s + LOOK_S } else { 0.0 };
        if silent_s > SILENCE_S {
            recorder.flush().map_err(written)?;
            return Err(RunError::Silent { step: plan.name.clone() });
        }
        for row in &came {
            match recorder.take(row).map_err(written)? {
                RowOutcome::Fault(_) => {
                    recorder.flush().map_err(written)?;
                    // What is refused here is refused because of the fault.
                    let _ = stand.command("STReam OFF").await;
                    let fault = fault(stand).await?.unwrap_or_else(|| "a fault that is gone again".to_owned());
                    return Err(RunError::Fault { step: plan.name.clone(), fault });
                }
                RowOutcome::Written | RowOutcome::LeftOut => {
                    numbers = Some((numbers.map_or(row.sequence, |(first, _)| first), row.sequence));
                    if let Some(stable) = &mut stable {
                        let temp_C = row.named().find(|(name, _)| *name == stable.column).map_or(f64::NAN, |(_, value)| value);
                        stable.take(recorder.last_s(), temp_C);
                    }
                    if recorder.last_s() + 0.5e-3 >= plan.seconds - 1e-3 || stable.as_ref().is_some_and(|stable| stable.is_reached()) {
                        return Ok(numbers);
                    }
                }
                RowOutcome::NotYet => {}
            }
        }
        if let Some(row) = came.last() {
            rate = row.named().find(|(name, _)| *name == "omega_rad_s").map_or(rate, |(_, rate)| rate);
        }
        if recorder.left_out() > 500 {
            recorder.flush().map_err(written)?;
            return Err(RunError::Sensor { step: plan.name.clone(), lacking: "a column".into() });
        }
        if !goes(recorder.last_s(), rate) {
            recorder.flush().map_err(written)?;
            return Err(RunError::Interrupted);
        }
        if since_s >= 1.0 {
            since_s = 0.0;
            recorder.flush().map_err(written)?;
            match stand.command(WATCH).await {
                // No answer while nothing comes: how long that lasts is counted above.
                Err(error) if silent_s > 0.0 && !is_refused(&error) && !is_unplugged(&error) => {}
                told => told?,
            }
        }
    }
}

fn is_unplugged(error: &ConnectionError) -> bool {
    matches!(error, ConnectionError::Link(LinkError::Unplugged { .. } | LinkError::Other { .. }))
}
