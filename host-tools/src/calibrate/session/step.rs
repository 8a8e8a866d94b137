//! One step: commands to the stand, and its rows into a log.

use super::ready::{HOST_WATCHDOG, at_rest, fault, index, is_refused, notes};
use super::run::RunError;
use super::stable::StabilityDetector;
use super::{DriveMode, Session, StepPlan};
use crate::acquire::connection::{ConnectionError, StandConnection};
use crate::acquire::link::LinkError;
use crate::acquire::record::{LogFile, Recorder, RowOutcome};
use crate::calibrate::{DutKind, Mounting};
use crate::log::{Note, Notes};
use stand_firmware::profile::Parameter;
use stand_firmware::telemetry::{Channels, RowFrame};
use std::io::Write;
use std::path::Path;

/// Polling interval, s.
const POLL_S: f64 = 0.1;
/// Time without rows after which the step ends, s.
const SILENCE_TIMEOUT_S: f64 = 3.0;

/// Columns of the log of a step.
fn channels(session: &Session, plan: &StepPlan) -> Channels {
    // The serial line limits the columns at 1 kHz: the calibration of a sensor does without supply voltage and winding temperature.
    let mut names = vec!["u_V", "i_A", "theta_rad", "omega_rad_s", "limits", "fault"];
    match session.dut_kind {
        DutKind::Drive => names.extend(["supply_V", "temp_C"]),
        // The rate sensor of the stand, which may carry no other.
        DutKind::Gyro if session.column.as_deref() == Some("omega_rad_s") => {}
        DutKind::Gyro => names.extend(["gyro_rad_s", "sensor_C", "sensor_age_s"]),
        DutKind::Accel => names.extend(["gyro_rad_s", "accel_x_m_s2", "accel_y_m_s2"]),
    }
    // A drive that is switched off during the record has no rate setpoint.
    if plan.mode == DriveMode::Rate && plan.drive_s.is_none() {
        names.push("rate_cmd_rad_s");
    }
    names.iter().filter_map(|name| Channels::named(name)).fold(Channels::default(), Channels::and)
}

/// Renames the rows of an interrupted attempt at a step; returns the journal entry.
///
/// # Errors
/// The files cannot be changed.
pub(super) fn put_aside(folder: &Path, file: &str) -> Result<Option<String>, RunError> {
    let place = LogFile::of(&folder.join(file)).map_err(|e| failed(file, e))?;
    if !place.partial_path().exists() {
        return Ok(None);
    }
    // A killed program may leave a partial row.
    place.cut_to_whole_rows().map_err(|e| failed(file, e))?;
    let stem = file.trim_end_matches(".parquet");
    let name = (1..).map(|n| format!("{stem}.attempt-{n}.csv")).find(|name| !folder.join(name).exists()).unwrap_or_default();
    std::fs::rename(place.partial_path(), folder.join(&name)).map_err(|e| failed(&name, e))?;
    Ok(Some(format!("{name}: rows of an interrupted attempt at this step; not used in the results")))
}

fn failed(log: &str, message: impl std::fmt::Display) -> RunError {
    RunError::Write { log: log.to_owned(), message: message.to_string() }
}

/// Runs one step and writes its log; returns the number of rows and of lost rows. An early end leaves whole rows.
pub(super) async fn record(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    path: &Path,
    mounting: &Mounting,
    on_progress: &mut impl FnMut(f64, f64) -> bool,
) -> Result<(u64, u64), RunError> {
    let place = LogFile::of(path).map_err(|e| failed(&path.display().to_string(), e))?;
    let ended = record_into(stand, session, plan, &place, path, mounting, on_progress).await;
    let Err(error) = ended else { return ended };
    // A full disk leaves a partial row.
    let _ = place.cut_to_whole_rows();
    let step = plan.name.clone();
    Err(match &error {
        // The reason for a refusal may be a fault.
        RunError::Stand(refusal) if is_refused(refusal) => match fault(stand).await {
            Ok(Some(fault)) => RunError::Fault { step, fault },
            _ => error,
        },
        RunError::Silent { .. } => match stand.query("STReam?").await {
            Ok(reply) if reply.starts_with('0') => RunError::Restarted { step },
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
    mounting: &Mounting,
    on_progress: &mut impl FnMut(f64, f64) -> bool,
) -> Result<(u64, u64), RunError> {
    let name = &plan.name;
    if let Some(fault) = fault(stand).await? {
        return Err(RunError::Fault { step: name.clone(), fault });
    }
    at_rest(stand, name).await?;
    let has_index = index(stand, plan.mode != DriveMode::Off).await?;
    at_rest(stand, name).await?;
    let config = plan.config().map_err(|message| RunError::Write { log: name.clone(), message })?;
    let channels = channels(session, plan);
    let list: Vec<&str> = channels.iter().map(|c| c.name).collect();
    let written = |e: std::io::Error| failed(&path.display().to_string(), e);
    let notes = notes(stand, session, plan, mounting, has_index).await?;
    let mut recorder = Recorder::new(place.create().map_err(written)?, channels, notes);
    let mut commands = Vec::new();
    if let Some(config) = &config {
        commands.push(format!("PROFile:MODE {}", if plan.mode == DriveMode::Rate { "RATE" } else { "VOLTage" }));
        commands.push(format!("PROFile:TYPE {}", config.kind.name()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        commands.extend(parameters.map(|p| format!("PROFile:{} {}", p.name, (p.read)(config))));
        commands.push(format!("PROFile:DURation {}", plan.drive_s.unwrap_or(plan.seconds + 0.5)));
    }
    commands.push(format!("STReam:CHANnels {}", list.join(",")));
    commands.push("STReam:DECimation 1".into());
    commands.push("STReam ON".into());
    commands.push(HOST_WATCHDOG.into());
    if config.is_some() {
        commands.push("PROFile:STARt".into());
    }
    for command in &commands {
        stand.command(command).await?;
    }
    let mut detector =
        plan.stable_K_min.zip(session.temperature_column()).map(|(below_K_min, column)| StabilityDetector::new(column, below_K_min));
    let sequence = rows(stand, plan, &mut recorder, detector.as_mut(), path, on_progress).await?;
    let lost_rows =
        sequence.map_or(0, |(first, last)| u64::from(last.wrapping_sub(first)) + 1).saturating_sub(recorder.rows() + recorder.left_out());
    for command in ["PROFile:STOP", "HOST:ARM 0 S", "STReam OFF"] {
        stand.command(command).await?;
    }
    if !recorder.absent().is_empty() {
        return Err(RunError::Sensor { step: name.clone(), columns: recorder.absent().join(", ") });
    }
    let written_rows = recorder.rows();
    let mut notes = Notes::from_iter([Note::LostRows(lost_rows)]);
    notes.extend(detector.map(|detector| Note::Text("stable", detector.note(recorder.last_s()))));
    recorder.finish(&notes).map_err(written)?;
    place.close().map_err(|e| failed(&path.display().to_string(), e))?;
    Ok((written_rows, lost_rows))
}

/// Records rows until the step is long enough or the temperature stable; returns the numbers of the first and the last row.
async fn rows<W: Write>(
    stand: &mut impl StandConnection,
    plan: &StepPlan,
    recorder: &mut Recorder<W>,
    mut detector: Option<&mut StabilityDetector>,
    path: &Path,
    on_progress: &mut impl FnMut(f64, f64) -> bool,
) -> Result<Option<(u32, u32)>, RunError> {
    let written = |e: std::io::Error| failed(&path.display().to_string(), e);
    let (mut silent_s, mut since_s) = (0.0, 0.0);
    let mut numbers: Option<(u32, u32)> = None;
    let mut rate = f64::NAN;
    loop {
        let received: Vec<RowFrame> = stand.wait_s(POLL_S).await?;
        since_s += POLL_S;
        silent_s = if received.is_empty() { silent_s + POLL_S } else { 0.0 };
        if silent_s > SILENCE_TIMEOUT_S {
            recorder.flush().map_err(written)?;
            return Err(RunError::Silent { step: plan.name.clone() });
        }
        for row in &received {
            match recorder.take(row).map_err(written)? {
                RowOutcome::Fault(_) => {
                    recorder.flush().map_err(written)?;
                    // The stand may refuse this because of the fault.
                    let _ = stand.command("STReam OFF").await;
                    let fault = fault(stand).await?.unwrap_or_else(|| "a fault that has been cleared".to_owned());
                    return Err(RunError::Fault { step: plan.name.clone(), fault });
                }
                RowOutcome::Written | RowOutcome::LeftOut => {
                    numbers = Some((numbers.map_or(row.sequence, |(first, _)| first), row.sequence));
                    if let Some(detector) = &mut detector {
                        let temp_C = row.value(detector.column).unwrap_or(f64::NAN);
                        detector.add(recorder.last_s(), temp_C);
                    }
                    if recorder.last_s() + 0.5e-3 >= plan.seconds - 1e-3 || detector.as_ref().is_some_and(|detector| detector.is_reached())
                    {
                        return Ok(numbers);
                    }
                }
                RowOutcome::NotYet => {}
            }
        }
        if let Some(row) = received.last() {
            rate = row.value("omega_rad_s").unwrap_or(rate);
        }
        if recorder.left_out() > 500 {
            recorder.flush().map_err(written)?;
            return Err(RunError::Sensor { step: plan.name.clone(), columns: "a column".into() });
        }
        if !on_progress(recorder.last_s(), rate) {
            recorder.flush().map_err(written)?;
            return Err(RunError::Interrupted);
        }
        if since_s >= 1.0 {
            since_s = 0.0;
            recorder.flush().map_err(written)?;
            match stand.command(HOST_WATCHDOG).await {
                // No answer while no rows arrive: the timeout above decides.
                Err(error) if silent_s > 0.0 && !is_refused(&error) && !is_unplugged(&error) => {}
                other => other?,
            }
        }
    }
}

fn is_unplugged(error: &ConnectionError) -> bool {
    matches!(error, ConnectionError::Link(LinkError::Unplugged { .. } | LinkError::Other { .. }))
}
