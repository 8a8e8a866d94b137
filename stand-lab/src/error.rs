//! Errors of the laboratory course.

use std::io;
use std::path::{Path, PathBuf};

use identification::log::LogError;
use identification::words::nearest;
use stand_acquire::calibration_session::PlanError;
use stand_acquire::calibration_session::error::RunError;
use stand_acquire::drift_session::DriftSessionError;
use stand_acquire::hidden::HideError;
use stand_acquire::profile_recording::ProfileRecordingError;
use stand_acquire::simulation::SimulationError;
use stand_analysis::calibrate::CalibrateError;
use stand_analysis::drift::error::DriftError;
use stand_analysis::observer::ObserverError;
use stand_analysis::observer::recorded::TrackError;

/// Why a work cannot be started, checked or graded.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// No such work.
    #[error("`{name}` is not a work of the course{} (`stand lab list` lists all)", near.as_ref().map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// What was given.
        name: String,
        /// The nearest identifier.
        near: Option<String>,
    },
    /// A file cannot be read or written.
    #[error("{}: cannot {action}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What was tried: read, write, create.
        action: &'static str,
        /// Error of the system.
        source: io::Error,
    },
    /// A file has a wrong content.
    #[error("{}: {message}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// An argument is wrong.
    #[error("{0}")]
    Argument(String),
    /// `stand explain` on a log of a hunt before the student's own answers.
    #[error(
        "{}: this log belongs to the work `{lab}`, whose own answers are not recorded yet; nothing was explained or recorded. Fill in `before` and `reason` of every log and the questions before the measurement in {}, run `stand lab check {}` (Check in the panel) until it says that the answers before the measurement are complete, then explain again",
        log.display(), folder.join(super::answers::ANSWERS_FILE).display(), folder.display()
    )]
    ExplainedTooEarly {
        /// The log.
        log: PathBuf,
        /// Identifier of the work.
        lab: String,
        /// The work folder.
        folder: PathBuf,
    },
    /// A work that a real stand cannot have.
    #[error("the work `{lab}` is not available on a real stand: {reason}")]
    NotOnRealStand {
        /// Identifier of the work.
        lab: String,
        /// Why.
        reason: &'static str,
    },
    /// A log of a real stand is not complete.
    #[error("{log}: the recording ended early: {reason}; no work was started")]
    EndedEarly {
        /// The log.
        log: String,
        /// Why.
        reason: String,
    },
    /// The reference procedure does not give a quantity.
    #[error(
        "the reference procedure gives no {name} on the recorded logs, so that the work could not be judged: the steps do not suit this drive or device"
    )]
    NoReferenceValue {
        /// The quantity.
        name: String,
    },
    /// The stand was not prepared for a log of a hunt.
    #[error("{log}: it was not confirmed that the stand is prepared; no work was started")]
    NotPrepared {
        /// The log.
        log: String,
    },
    /// A profile cannot be recorded.
    #[error(transparent)]
    ProfileRecording(#[from] ProfileRecordingError),
    /// The answers were edited elsewhere while a form showed them.
    #[error("{}: the file was changed since these answers were loaded; nothing was written. Load it again and enter your changes anew", path.display())]
    AnswersChanged {
        /// The file.
        path: PathBuf,
    },
    /// The definition of a work is wrong: an error of this program, which a test excludes.
    #[error("the work `{lab}` is defined wrongly: {message}")]
    Definition {
        /// Its identifier.
        lab: String,
        /// What is wrong.
        message: String,
    },
    /// The session cannot be prepared.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The session on the simulated stand ended early.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A log cannot be simulated.
    #[error(transparent)]
    Simulation(#[from] SimulationError),
    /// An effect cannot be hidden.
    #[error(transparent)]
    Hide(#[from] HideError),
    /// A log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The drift session on the simulated stand ended early.
    #[error(transparent)]
    DriftSession(#[from] DriftSessionError),
    /// The reference procedure gives no result.
    #[error("the reference procedure gives no result: {0}")]
    Reference(#[from] CalibrateError),
    /// The reference procedure gives no friction law.
    #[error("the reference procedure gives no result: the plateaus do not determine the law of friction")]
    FrictionReference,
    /// The reference procedure gives no torque and no error of the encoder.
    #[error("the reference procedure gives no result: the logs do not separate the torque from the encoder")]
    OncePerTurnReference,
    /// An observer cannot be designed.
    #[error(transparent)]
    Observer(#[from] ObserverError),
    /// The observer of the reference procedure cannot run over the log.
    #[error("the reference procedure gives no result: {0}")]
    ObserverReference(#[from] TrackError),
    /// The reference procedure gives no drift.
    #[error("the reference procedure gives no drift: {0}")]
    DriftReference(#[from] DriftError),
}

impl LabError {
    pub(super) fn file(path: &Path, action: &'static str, source: io::Error) -> Self {
        LabError::File { path: path.to_owned(), action, source }
    }

    pub(super) fn invalid(path: &Path, message: impl Into<String>) -> Self {
        LabError::Invalid { path: path.to_owned(), message: message.into() }
    }

    pub(super) fn unknown<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Self {
        LabError::Unknown { name: name.to_owned(), near: nearest(name, known) }
    }
}
