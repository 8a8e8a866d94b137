//! Stage of a job and its requests to the person, as data: the page makes the sentences from its table of keys, in its language.

use serde::Serialize;

use identification::identify::explain::Progress;
use stand_acquire::calibration_session::Action;

/// The present stage of a job.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Stage {
    /// It has just begun.
    #[default]
    Started,
    /// Files are read.
    Reading,
    /// The model is simulated.
    Simulating,
    /// The parameters are fitted.
    Fitting,
    /// Every effect of the catalogue is tried.
    Trying,
    /// An effect was added, further ones are tried.
    TryingFurther {
        /// The effect.
        added: String,
    },
    /// What is left is examined.
    ExaminingRemainder,
    /// The model is fitted with an effect.
    FittingWith {
        /// The effect.
        effect: String,
    },
    /// The stand is prepared: index, rest.
    Preparing,
    /// Rows are recorded.
    Recording {
        /// Time of the latest row, s.
        at_s: f64,
        /// Duration of the log, s.
        seconds: f64,
        /// Latest rate, rad/s; NaN, which is `null`: not known yet.
        rate_rad_s: f64,
    },
    /// The settings of the stand are read.
    ReadingSettings,
    /// The platform turns before and after the change of the compensation.
    TurningTwice,
    /// The stand measures its cogging.
    MeasuringCogging {
        /// Reply of the stand; empty: none yet.
        progress: String,
    },
    /// Allan deviations are computed.
    Deviations,
    /// A position of a drift session is visited.
    Visit {
        /// Number of the visit, from 1.
        visit: usize,
        /// Number of visits.
        visits: usize,
        /// Number of the position, from 1.
        position: usize,
        /// The firmware's name of its state.
        state: String,
    },
    /// The drift is computed.
    Drift,
    /// A step of a calibration session is recorded.
    Step {
        /// Number of the step, from 1.
        number: usize,
        /// Number of steps.
        of: usize,
        /// Its name.
        step: String,
        /// Remaining time of the session, minutes and seconds.
        left: String,
        /// Latest rate, rad/s.
        rate_rad_s: f64,
    },
    /// The record of a calibration is computed.
    Record,
}

impl From<&Progress> for Stage {
    fn from(progress: &Progress) -> Self {
        match progress {
            Progress::FittingGiven => Stage::Fitting,
            Progress::Trying { added: None } => Stage::Trying,
            Progress::Trying { added: Some(effect) } => Stage::TryingFurther { added: effect.clone() },
            Progress::ExaminingRemainder => Stage::ExaminingRemainder,
        }
    }
}

/// What the person at the page is asked to do.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Request {
    /// Turn the gyroscope of a drift session and level it.
    TurnGyroscope {
        /// Position, degrees.
        turned_deg: f64,
    },
    /// An action of a calibration session.
    #[serde(untagged)]
    Session(Action),
}

/// Why the panel stopped the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum StopReason {
    /// STOP on a page.
    Pressed,
    /// The driving page sent no beat for a second.
    Silent,
    /// The driving page was closed.
    Closed,
    /// The driving page was hidden or gave up the control.
    Left,
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            StopReason::Pressed => "STOP on a page",
            StopReason::Silent => "the page that drives was silent for a second",
            StopReason::Closed => "the page that drives was closed",
            StopReason::Left => "the page that drives was hidden or gave up the control",
        })
    }
}
