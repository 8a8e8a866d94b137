//! One step: commands to the stand, and its rows into a log.

use super::clock;
use super::error::RunError;
use super::notes::notes;
use super::stable::StabilityDetector;
use super::{ClockReading, DriveMode, DutKind, Mounting, Session, StepPlan};
use crate::connection::StandConnection;
use crate::preparation::{bring_to_rest, find_index, is_rejected, latched_fault};
use crate::record::{LogFile, Recorder};
use crate::recording::{self, RecordingEnd, RecordingError, RecordingMonitor, RecordingProgress, RecordingRequest};
use identification::log::{Note, Notes};
use stand_firmware::telemetry::{Channels, RowFrame};
use std::path::Path;

/// Rows with a missing value after which a step ends.
const MAX_INCOMPLETE_ROWS: u64 = 500;
/// The profile lasts longer than the log by this time, s.
const PROFILE_MARGIN_S: f64 = 0.5;
/// Interval, s, and number of the queries of a sensor that starts again.
const RESTART_POLL_S: f64 = 0.1;
const RESTART_POLLS: u32 = 30;

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

/// What a step has recorded.
pub(super) struct RecordedStep {
    /// Number of rows.
    pub rows: u64,
    /// Rows lost on the serial line.
    pub lost_rows: u64,
    /// The crystal compared with the clock reference, where the session has one.
    pub clock: Option<ClockReading>,
}

/// Runs one step and writes its log. An early end leaves whole rows.
pub(super) async fn record(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    path: &Path,
    mounting: &Mounting,
    on_progress: &mut impl FnMut(f64, f64) -> bool,
) -> Result<RecordedStep, RunError> {
    let file = LogFile::of(path).map_err(|e| failed(&path.display().to_string(), e))?;
    let ended = record_into(stand, session, plan, &file, path, mounting, on_progress).await;
    let Err(error) = ended else { return ended };
    // A full disk leaves a partial row.
    let _ = file.cut_to_whole_rows();
    let step = plan.name.clone();
    Err(match &error {
        // The reason for a rejection may be a fault.
        RunError::Stand(rejection) if is_rejected(rejection) => match latched_fault(stand).await {
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
    file: &LogFile,
    path: &Path,
    mounting: &Mounting,
    on_progress: &mut impl FnMut(f64, f64) -> bool,
) -> Result<RecordedStep, RunError> {
    let step = || plan.name.clone();
    if let Some(fault) = latched_fault(stand).await? {
        return Err(RunError::Fault { step: step(), fault });
    }
    at_rest(stand, plan).await?;
    let has_index = find_index(stand, plan.mode != DriveMode::Off).await?;
    at_rest(stand, plan).await?;
    let config = plan.config().map_err(|message| RunError::Write { log: step(), message })?;
    let channels = channels(session, plan);
    let write_error = |e: std::io::Error| failed(&path.display().to_string(), e);
    if plan.restart_sensor {
        restart_sensor(stand, plan).await?;
    }
    let notes = notes(stand, session, plan, mounting, has_index).await?;
    let mut recorder = Recorder::new(file.create().map_err(write_error)?, channels, notes);
    let request = RecordingRequest {
        profile: config.as_ref().map(|config| (plan.mode.mode(), config)),
        profile_s: plan.drive_s.unwrap_or(plan.seconds + PROFILE_MARGIN_S),
        channels,
        decimation: 1,
        seconds: plan.seconds,
        max_incomplete_rows: Some(MAX_INCOMPLETE_ROWS),
    };
    let detector = plan.stable_K_min.zip(session.temperature_column());
    let mut monitor =
        StepMonitor { detector: detector.map(|(below_K_min, column)| StabilityDetector::new(column, below_K_min)), on_progress };
    if session.clock_reference.is_some() {
        clock::restart(stand).await?;
    }
    let recording = recording::record(stand, &request, &mut recorder, &mut monitor).await.map_err(|error| match error {
        RecordingError::Connection(error) => RunError::Stand(error),
        RecordingError::Write(error) => write_error(error),
    })?;
    match recording.end {
        RecordingEnd::Complete => {}
        RecordingEnd::Interrupted => return Err(RunError::Interrupted),
        RecordingEnd::Fault(fault) => return Err(RunError::Fault { step: step(), fault }),
        RecordingEnd::Silent => return Err(RunError::Silent { step: step() }),
        RecordingEnd::IncompleteRows => return Err(RunError::Sensor { step: step(), columns: "a column".into() }),
        RecordingEnd::Disconnected(error) => return Err(error.into()),
    }
    if !recorder.absent().is_empty() {
        return Err(RunError::Sensor { step: step(), columns: recorder.absent().join(", ") });
    }
    let rows = recorder.rows();
    let mut notes =
        Notes::from_iter([Note::LostRows(recording.lost_rows), Note::Number("since_power_on_s", recorder.first_since_power_on_s())]);
    notes.extend(monitor.detector.map(|detector| Note::Text("stable", detector.note(recorder.last_s()))));
    recorder.finish(&notes).map_err(write_error)?;
    file.close().map_err(|e| failed(&path.display().to_string(), e))?;
    let clock = match session.clock_reference {
        Some(_) => Some(clock::read(stand).await?),
        None => None,
    };
    Ok(RecordedStep { rows, lost_rows: recording.lost_rows, clock })
}

async fn at_rest(stand: &mut impl StandConnection, plan: &StepPlan) -> Result<(), RunError> {
    if bring_to_rest(stand).await? { Ok(()) } else { Err(RunError::Turning { step: plan.name.clone() }) }
}

/// Resets the sensor under test and sets it up anew by its present data rate; its supply stays on.
async fn restart_sensor(stand: &mut impl StandConnection, plan: &StepPlan) -> Result<(), RunError> {
    let data_rate = stand.query("IMU:DATarate?").await?;
    stand.command(&format!("IMU:DATarate {data_rate}")).await?;
    for _ in 0..RESTART_POLLS {
        stand.wait_s(RESTART_POLL_S).await?;
        if stand.query("IMU?").await?.contains("RUNNING") {
            return Ok(());
        }
    }
    Err(RunError::Sensor { step: plan.name.clone(), columns: "every column after its restart".into() })
}

/// Ends a step once its temperature is stable, and passes its progress on.
struct StepMonitor<'a, F> {
    detector: Option<StabilityDetector>,
    on_progress: &'a mut F,
}

impl<F: FnMut(f64, f64) -> bool> RecordingMonitor for StepMonitor<'_, F> {
    fn row(&mut self, t_s: f64, row: &RowFrame) -> bool {
        let Some(detector) = &mut self.detector else { return false };
        detector.add(t_s, row.value(detector.column).unwrap_or(f64::NAN));
        detector.is_reached()
    }

    fn progress(&mut self, progress: RecordingProgress) -> bool {
        (self.on_progress)(progress.at_s, progress.rate_rad_s)
    }
}
