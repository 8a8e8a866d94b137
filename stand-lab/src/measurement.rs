//! The sealed measurement of an attempt: its logs, its true values, and the result of the reference procedure.
//!
//! The logs are those of the simulated stand, bit-identical for one build and one attempt. The true device and the noise have seeds of
//! their own. Notes that would give a seed away, and the date, are left out, so that the files can be compared by their hash.

use schemars::JsonSchema;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use hal_sim::session::SessionRequest;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

use super::LabError;
use super::course::{HuntTask, Lab, Task};
use super::hunt;
use super::seal::{Attempt, Key};
use super::{drift_task, friction_task, observers_task, once_per_turn_task};
use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use identification::log::{Log, Notes};
use stand_acquire::calibration_session::drawn_dut::{drawn_drive, drawn_sensor};
use stand_acquire::calibration_session::error::RunError;
use stand_acquire::calibration_session::journal::{Journal, JournalError};
use stand_acquire::calibration_session::run::Progress;
use stand_acquire::calibration_session::simulated::simulate as simulate_session;
use stand_acquire::calibration_session::{DutKind, PreparedSession, Step};
use stand_acquire::simulation::simulate;
use stand_analysis::calibrate::{Findings, accel, drive, gyro};
use stand_analysis::drift::compute::COLUMNS;

/// Folder of the logs in a work folder.
pub const LOGS_FOLDER: &str = "logs";
/// Name of the log of a drift work.
pub(super) const DRIFT_LOG: &str = "drift.parquet";
/// Name of the log of a work on observers, and the column of its measurement.
const ELEMENT_LOG: &str = "element.parquet";
const ANGLE_COLUMN: &str = "angle_sensor_V";
/// Notes that are not written: the date changes from run to run, the others contain a seed.
const LEFT_OUT_NOTES: [&str; 3] = ["date", "seed", "stand"];
/// Full scale of a drawn gyroscope, rad/s.
const FULL_SCALE_RAD_S: f64 = 10.0;

/// True values of an attempt.
#[derive(Debug, Clone, PartialEq)]
pub enum Truth {
    /// Quantities by name.
    Quantities(BTreeMap<String, f64>),
    /// What each log hides.
    Hidden(Vec<Hidden>),
}

/// What a log hides.
#[derive(Debug, Clone, PartialEq, serde::Serialize, JsonSchema)]
pub struct Hidden {
    /// Name of the log.
    pub log: String,
    /// The classes that are present.
    pub present: BTreeSet<String>,
    /// The effects with their parameters; empty where nothing is hidden.
    pub description: String,
}

/// The drawn device of a session, with its true values.
fn drawn(key: &Key, attempt: &Attempt, prepared: &PreparedSession) -> (Stand, BTreeMap<String, f64>) {
    let (seed, assumed) = (key.seed(attempt, "device"), &prepared.session.assumptions);
    let (stand, truth) = match prepared.session.dut_kind {
        DutKind::Drive => drawn_drive(seed, assumed),
        DutKind::Gyro | DutKind::Accel => {
            let (sensor, truth) = drawn_sensor(seed, assumed, prepared.session.full_scale_rad_s.unwrap_or(FULL_SCALE_RAD_S));
            // The bias of the gyro itself: the latitude is not stated, so that the Earth rate is a contribution to the uncertainty and no
            // part of the value.
            let truth =
                truth.into_iter().map(|(name, value)| (name, if name == "bias_rad_s" { sensor.gyro_bias_rad_s } else { value })).collect();
            (Stand { imu: Some(sensor), ..Stand::default() }, truth)
        }
    };
    // The drawn sensor is a gyroscope and an accelerometer; `scale` is that of the device of the session.
    let scale = match prepared.session.dut_kind {
        DutKind::Accel => truth.iter().find(|(name, _)| *name == "accel_scale").copied(),
        DutKind::Gyro | DutKind::Drive => None,
    };
    let truth = truth.into_iter().chain(scale.map(|(_, value)| ("scale", value)));
    (stand, truth.map(|(name, value)| (name.to_owned(), value)).collect())
}

/// The true values of an attempt.
///
/// # Errors
/// The definition of the work is wrong.
pub fn truth(lab: &Lab, key: &Key, attempt: &Attempt) -> Result<Truth, LabError> {
    let asked = |all: BTreeMap<String, f64>| -> Result<Truth, LabError> {
        let of = |name: &String| {
            let missing = || LabError::Definition { lab: lab.id.to_owned(), message: format!("{name} has no true value") };
            all.get(name).map(|value| (name.clone(), *value)).ok_or_else(missing)
        };
        lab.quantities().iter().map(|q| of(&q.name)).collect::<Result<_, _>>().map(Truth::Quantities)
    };
    match &lab.task {
        Task::Session(task) => asked(drawn(key, attempt, &lab.session(task.device)?).1),
        Task::Friction(task) => asked(friction_task::truth(task, key.seed(attempt, "device"))),
        Task::OncePerTurn(task) => asked(once_per_turn_task::truth(task, key.seed(attempt, "device"))),
        Task::Observers(task) => asked(observers_task::truth(task, key.seed(attempt, "device"))?),
        Task::Drift(task) => asked(drift_task::truth(task, key.seed(attempt, "device"))),
        Task::Hunt(task) => {
            let cases = hunt::cases(task, key.seed(attempt, "device"))?;
            Ok(Truth::Hidden(cases.into_iter().map(|c| Hidden { log: c.log, present: c.present, description: c.description }).collect()))
        }
    }
}

/// Records the logs of an attempt into `folder`; their file names in order. `on_progress` receives the part that is done, 0 to 1; the
/// recording ends when it returns false.
///
/// # Errors
/// A file cannot be written; interrupted.
pub fn record(
    lab: &Lab,
    key: &Key,
    attempt: &Attempt,
    folder: &Path,
    mut on_progress: impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    std::fs::create_dir_all(folder).map_err(|source| LabError::file(folder, "create", source))?;
    match &lab.task {
        Task::Session(task) => record_session(&lab.session(task.device)?, key, attempt, folder, on_progress),
        Task::Friction(task) => {
            let device = key.seed(attempt, "device");
            record_each(&friction_task::LOGS, key, attempt, folder, on_progress, |k, noise, path| {
                friction_task::record(task, k, (device, noise), path)
            })
        }
        Task::OncePerTurn(task) => {
            let device = key.seed(attempt, "device");
            record_each(&once_per_turn_task::LOGS, key, attempt, folder, on_progress, |k, noise, path| {
                once_per_turn_task::record(task, k, (device, noise), path)
            })
        }
        Task::Observers(task) => {
            let device = key.seed(attempt, "device");
            record_each(&[ELEMENT_LOG], key, attempt, folder, on_progress, |_, noise, path| {
                observers_task::record(task, (device, noise), path)
            })
        }
        Task::Drift(task) => {
            let seeds = (key.seed(attempt, "device"), noise_seed(key, attempt));
            let path = folder.join(DRIFT_LOG);
            sealed_log(&drift_task::record(task, seeds, &path, on_progress)?)?.write(path)?;
            Ok(vec![DRIFT_LOG.to_owned()])
        }
        Task::Hunt(task) => {
            let cases = hunt::cases(task, key.seed(attempt, "device"))?;
            let mut files = Vec::new();
            for (k, case) in cases.iter().enumerate() {
                if !on_progress(k as f64 / cases.len() as f64) {
                    return Err(RunError::Interrupted.into());
                }
                let file = format!("{}.parquet", case.log);
                let noise = key.seed(attempt, &format!("noise {}", case.log));
                sealed_log(&simulate(&case.stand, request(task, k, noise), &folder.join(&file))?)?.write(folder.join(&file))?;
                files.push(file);
            }
            Ok(files)
        }
    }
}

/// The run of log number `k`, whose profile is public.
pub(super) fn request(task: &HuntTask, k: usize, noise: u64) -> SessionRequest {
    let profile = SessionRequest::usual_profile(Mode::Voltage, ProfileKind::MultiStep, task.amplitude_V, 1 + k as u64);
    SessionRequest { mode: Mode::Voltage, profile, seconds: task.seconds, seed: noise }
}

fn record_session(
    prepared: &PreparedSession,
    key: &Key,
    attempt: &Attempt,
    folder: &Path,
    mut on_progress: impl FnMut(f64) -> bool,
) -> Result<Vec<String>, LabError> {
    // The session's own journal has the seed of the noise; it is not handed out.
    let session_folder = tempfile::tempdir().map_err(|source| LabError::file(folder, "create a temporary folder beside", source))?;
    let (stand, _) = drawn(key, attempt, prepared);
    let seconds = prepared.session.seconds();
    let progress = |p: Progress| on_progress(1.0 - p.left_s / seconds);
    simulate_session(&stand, noise_seed(key, attempt), prepared, session_folder.path(), Deadline::NEVER, progress)?;
    let (journal, _) = Journal::read(session_folder.path()).map_err(journal_error)?;
    let mut files = Vec::new();
    for step in &journal.steps {
        sealed_log(&Log::read_all(session_folder.path().join(&step.log))?)?.write(folder.join(&step.log))?;
        files.push(step.log.clone());
    }
    Ok(files)
}

/// Seed of the noise. The angle at power-on is the fractional part of a multiple of it, which needs bits of its own in an f64: 40 of its 53
/// bits.
fn noise_seed(key: &Key, attempt: &Attempt) -> u64 {
    key.seed(attempt, "noise") >> 24
}

fn journal_error(error: JournalError) -> LabError {
    RunError::from(error).into()
}

/// Records the logs `files`, each by its number, the seed of its noise and its path.
fn record_each(
    files: &[&str],
    key: &Key,
    attempt: &Attempt,
    folder: &Path,
    mut on_progress: impl FnMut(f64) -> bool,
    record: impl Fn(usize, u64, &Path) -> Result<Log, LabError>,
) -> Result<Vec<String>, LabError> {
    for (k, file) in files.iter().enumerate() {
        if !on_progress(k as f64 / files.len() as f64) {
            return Err(RunError::Interrupted.into());
        }
        let path = folder.join(file);
        sealed_log(&record(k, key.seed(attempt, &format!("noise {file}")), &path)?)?.write(path)?;
    }
    Ok(files.iter().map(|file| (*file).to_owned()).collect())
}

/// The log without the notes that give a seed or the date.
fn sealed_log(log: &Log) -> Result<Log, LabError> {
    let notes: Vec<_> = log.notes().iter().filter(|(key, _)| !LEFT_OUT_NOTES.contains(&key.as_str())).cloned().collect();
    Ok(Log::new(log.path(), log.columns().to_vec(), Notes::from(notes))?)
}

fn read_each(files: &[&str], folder: &Path) -> Result<Vec<Log>, LabError> {
    files.iter().map(|file| Ok(Log::read(folder.join(file))?)).collect()
}

/// The result of the reference procedure on the logs in `folder`: value and expanded uncertainty by name; empty for a hunt.
///
/// # Errors
/// A log cannot be read, or the procedure gives no result.
pub fn reference(lab: &Lab, folder: &Path) -> Result<BTreeMap<String, (f64, f64)>, LabError> {
    let task = match &lab.task {
        Task::Session(task) => task,
        Task::Friction(task) => {
            let logs = read_each(&friction_task::LOGS, folder)?;
            return friction_task::reference(task, &logs).ok_or(LabError::FrictionReference);
        }
        Task::OncePerTurn(task) => {
            let logs = read_each(&once_per_turn_task::LOGS, folder)?;
            return once_per_turn_task::reference(task, &logs).ok_or(LabError::OncePerTurnReference);
        }
        Task::Observers(task) => return observers_task::reference(task, &Log::read_also(folder.join(ELEMENT_LOG), &[ANGLE_COLUMN])?),
        Task::Drift(_) => return drift_task::reference(Log::read_also(folder.join(DRIFT_LOG), &COLUMNS)?),
        Task::Hunt(_) => return Ok(BTreeMap::new()),
    };
    let session = lab.session(task.device)?.session;
    let steps = session.steps.iter().zip(session.mountings()).enumerate();
    let steps: Vec<Step> = steps
        .map(|(k, (plan, mounting))| {
            let log = Log::read(folder.join(plan.file(k + 1)))?;
            Ok(Step { name: plan.name.clone(), log, mounting, added_inertia_kg_m2: plan.added_inertia_kg_m2 })
        })
        .collect::<Result<_, LabError>>()?;
    let findings: Findings = match task.device {
        DutKind::Drive => drive::calibrate(&steps, &session, Deadline::NEVER),
        DutKind::Gyro => gyro::calibrate(&steps, &gyro::GyroSettings::of(&session)),
        DutKind::Accel => accel::calibrate(&steps, &session),
    }?;
    Ok(findings.quantities.iter().map(|q| (q.name.clone(), (q.value, q.expanded_u()))).collect())
}
