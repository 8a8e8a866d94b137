//! Logs of a work from a real stand: the session, profiles or drift measurement of the simulated work, over a connection.
//!
//! The recordings are those of `stand calibrate`, `stand record` and `stand drift run`. A recording that ends early is an error, and its
//! logs are not used: a work has complete logs or none. The platform is brought to rest before each profile, after the last log, and after
//! every error that leaves the line alive.

use std::cell::RefCell;
use std::path::Path;

use hal_sim::gyro::Orientation;
use hal_sim::session::SessionRequest;
use stand_firmware::profile::ProfileConfig;
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::Channels;

use super::LabError;
use super::course::{Lab, Task};
use super::measurement::{self, DRIFT_LOG, Hidden};
use super::real_stand::StandIdentity;
use super::{drift_task, friction_task, once_per_turn_task};
use identification::log::Notes;
use stand_acquire::calibration_session::PreparedSession;
use stand_acquire::calibration_session::error::RunError;
use stand_acquire::calibration_session::journal::Journal;
use stand_acquire::calibration_session::run::{Operator, Progress, run_session};
use stand_acquire::connection::StandConnection;
use stand_acquire::drift_session::{DriftSessionError, DriftSessionProgress, measure};
use stand_acquire::preparation::bring_to_rest;
use stand_acquire::profile_recording::{ProfileRecordingRequest, early_end, record_profile};
use stand_acquire::recording::{RecordingEnd, RecordingMonitor, RecordingProgress};

/// Who mounts, turns and changes what is on the stand; a `false` ends the recording.
pub trait WorkOperator: Operator {
    /// Turns the gyroscope of a drift measurement into a position.
    fn turn_gyroscope(&mut self, place: &Orientation) -> bool;
    /// Prepares the stand for a log of a hunt, as the reference describes it.
    fn prepare_log(&mut self, hidden: &Hidden) -> bool;
}

/// Refuses a work that a real stand cannot have.
///
/// # Errors
/// The reason.
pub(super) fn check_possible(lab: &Lab) -> Result<(), LabError> {
    let reason = match &lab.task {
        Task::Session(_) | Task::Friction(_) | Task::OncePerTurn(_) | Task::Drift(_) | Task::Hunt(_) => return Ok(()),
        Task::Observers(_) => {
            "its quantities are defined by the exact parameters of the simulated element. Those of a real element are known with an uncertainty that neither the \
             answers nor the reference procedure contain"
        }
    };
    Err(LabError::NotOnRealStand { lab: lab.id.to_owned(), reason })
}

/// The identity of a stand.
///
/// # Errors
/// The connection fails.
pub(super) async fn identity(stand: &mut impl StandConnection) -> Result<StandIdentity, LabError> {
    stand.command("STReam OFF").await.map_err(RunError::from)?;
    Ok(StandIdentity::of(&stand.query("*IDN?").await.map_err(RunError::from)?))
}

/// Records the logs of a work into `folder`; their file names in order. `hidden` is what the logs of a hunt hide. `on_progress` receives
/// the part that is done, 0 to 1; the recording ends when it returns false.
///
/// # Errors
/// The stand refuses or ends the recording; interrupted; the operator does not confirm; a file cannot be written.
pub(super) async fn record(
    lab: &Lab,
    stand: &mut impl StandConnection,
    folder: &Path,
    hidden: &[Hidden],
    operator: &mut impl WorkOperator,
    on_progress: impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    std::fs::create_dir_all(folder).map_err(|source| LabError::file(folder, "create", source))?;
    let recorded = record_task(lab, stand, folder, hidden, operator, on_progress).await;
    if recorded.is_err() {
        // Ends what the recording may have left running; a stand that does not answer stops by itself when its host is silent.
        for command in ["DRIFt:ABORt", "PROFile:STOP", "STReam OFF"] {
            let _ = stand.command(command).await;
        }
    }
    let _ = bring_to_rest(stand).await;
    let _ = stand.command("OUTPut OFF").await;
    recorded
}

async fn record_task(
    lab: &Lab,
    stand: &mut impl StandConnection,
    folder: &Path,
    hidden: &[Hidden],
    operator: &mut impl WorkOperator,
    mut on_progress: impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    match &lab.task {
        Task::Session(task) => record_session(&lab.session(task.device)?, stand, folder, operator, on_progress).await,
        Task::Friction(task) => {
            let runs = friction_task::LOGS.iter().enumerate().map(|(k, log)| Run {
                log: (*log).to_owned(),
                mode: Mode::Rate,
                profile: friction_task::profile(task, k),
                seconds: task.runs[k].seconds,
                find_index: false,
            });
            record_runs(&runs.collect::<Vec<_>>(), stand, folder, |_| Ok(()), &mut on_progress).await
        }
        Task::OncePerTurn(task) => {
            // Phases count from the index.
            let runs = once_per_turn_task::LOGS.iter().enumerate().map(|(k, log)| Run {
                log: (*log).to_owned(),
                mode: Mode::Voltage,
                profile: once_per_turn_task::profile(task, k),
                seconds: task.seconds,
                find_index: true,
            });
            record_runs(&runs.collect::<Vec<_>>(), stand, folder, |_| Ok(()), &mut on_progress).await
        }
        Task::Hunt(task) => {
            // The public profiles of the simulated hunt; a real stand has no seed.
            let runs = task.logs.iter().enumerate().map(|(k, log)| {
                let SessionRequest { mode, profile, seconds, .. } = measurement::request(task, k, 0);
                Run { log: format!("{log}.parquet"), mode, profile, seconds, find_index: false }
            });
            let runs: Vec<Run> = runs.collect();
            let prepare = |k: usize| match hidden.get(k) {
                Some(hidden) if operator.prepare_log(hidden) => Ok(()),
                _ => Err(LabError::NotPrepared { log: runs[k].log.clone() }),
            };
            record_runs(&runs, stand, folder, prepare, &mut on_progress).await
        }
        Task::Drift(task) => {
            let request = drift_task::request();
            let (operator, on_progress) = (RefCell::new(operator), RefCell::new(on_progress));
            let turn = async |place: &Orientation, _: &mut _| {
                let confirmed = operator.borrow_mut().turn_gyroscope(place);
                confirmed
                    .then_some(())
                    .ok_or_else(|| DriftSessionError::NotTurned("the position of the gyroscope was not confirmed".to_owned()))
            };
            let progress = |p: DriftSessionProgress| on_progress.borrow_mut()((p.visit as f64 - 1.0) / p.visits as f64);
            let recording = measure(stand, &request, turn, progress).await?;
            let path = folder.join(DRIFT_LOG);
            recording.log(&path, &request.plan, Some(task.latitude_deg))?.write(&path)?;
            Ok(vec![DRIFT_LOG.to_owned()])
        }
        Task::Observers(_) => check_possible(lab).map(|()| Vec::new()),
    }
}

async fn record_session(
    prepared: &PreparedSession,
    stand: &mut impl StandConnection,
    folder: &Path,
    operator: &mut impl WorkOperator,
    mut on_progress: impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    let session_folder = tempfile::tempdir_in(folder).map_err(|source| LabError::file(folder, "create a temporary folder in", source))?;
    let seconds = prepared.session.seconds();
    run_session(stand, prepared, session_folder.path(), operator, |p: Progress| on_progress(1.0 - p.left_s / seconds)).await?;
    let (journal, _) = Journal::read(session_folder.path()).map_err(RunError::from)?;
    let mut files = Vec::new();
    for step in journal.steps {
        let to = folder.join(&step.log);
        std::fs::rename(session_folder.path().join(&step.log), &to).map_err(|source| LabError::file(&to, "write", source))?;
        files.push(step.log);
    }
    Ok(files)
}

/// A profile of a work.
struct Run {
    log: String,
    mode: Mode,
    profile: ProfileConfig,
    seconds: f64,
    find_index: bool,
}

/// Records the runs, each from rest; `prepare` is asked before each.
async fn record_runs(
    runs: &[Run],
    stand: &mut impl StandConnection,
    folder: &Path,
    mut prepare: impl FnMut(usize) -> Result<(), LabError>,
    on_progress: &mut impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    for (k, run) in runs.iter().enumerate() {
        prepare(k)?;
        let ended = |reason: String| LabError::EndedEarly { log: run.log.clone(), reason };
        if !bring_to_rest(stand).await.map_err(RunError::from)? {
            return Err(ended("the platform did not come to rest before it".to_owned()));
        }
        let request = ProfileRecordingRequest {
            mode: run.mode,
            profile: run.profile,
            seconds: run.seconds,
            decimation: 1,
            find_index: run.find_index,
            additional_channels: Channels::default(),
            notes: Notes::default(),
            path: &folder.join(&run.log),
        };
        let part = |at_s: f64| (k as f64 + (at_s / run.seconds).clamp(0.0, 1.0)) / runs.len() as f64;
        let mut monitor = Monitor { part, on_progress: &mut *on_progress };
        let recording = record_profile(stand, &request, &mut monitor).await?;
        match &recording.end {
            RecordingEnd::Complete => {}
            RecordingEnd::Interrupted => return Err(RunError::Interrupted.into()),
            end => return Err(ended(early_end(end).unwrap_or_default())),
        }
    }
    Ok(runs.iter().map(|run| run.log.clone()).collect())
}

/// Passes the part that is done on.
struct Monitor<'a, P, F> {
    part: P,
    on_progress: &'a mut F,
}

impl<P: Fn(f64) -> f64, F: FnMut(f64) -> bool> RecordingMonitor for Monitor<'_, P, F> {
    fn progress(&mut self, progress: RecordingProgress) -> bool {
        (self.on_progress)((self.part)(progress.at_s))
    }
}
