//! The work of the panel that takes seconds: one job at a time, on its own thread, with progress and cancel.
//!
//! In: a closure that calls the library. Out: [`JobState`] for the page. A job that drives ends with the stop of the drive; a job that
//! computes ends through the switch [`CANCELLED`], which its deadline watches.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use serde::Serialize;

use super::lock::locked;
use super::stage::{Request, Stage};

/// Ends the computation that runs. Static, as [`identification::deadline::Deadline`] requires; there is one panel in a process and one job
/// in a panel.
pub static CANCELLED: AtomicBool = AtomicBool::new(false);

/// Interval between looks at the switch that cancels, and for the reply of a person.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// An error as the line of text that the page shows.
pub fn message(error: impl std::fmt::Display) -> String {
    error.to_string()
}

/// Why a job gave no answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum JobError {
    /// It was cancelled, and nothing else is to be said.
    Cancelled,
    /// An error of the program, a line of text.
    Failed(String),
}

impl JobError {
    /// An error of the library, which may be that of an interruption.
    pub fn of<E: std::fmt::Display>(error: E, is_interruption: impl Fn(&E) -> bool) -> Self {
        if is_interruption(&error) { JobError::Cancelled } else { JobError::Failed(error.to_string()) }
    }
}

impl From<String> for JobError {
    fn from(text: String) -> Self {
        JobError::Failed(text)
    }
}

/// A job, as the page shows it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct JobState {
    /// Number of the job; 0: none so far.
    pub number: u64,
    /// Its kind: `record`, `compare`, `fit`, `explain`, …
    pub kind: String,
    /// It runs.
    pub is_running: bool,
    /// It has the stand: its commands and its stream are the job's.
    pub uses_stand: bool,
    /// Present stage.
    pub stage: Stage,
    /// What the person at the page is asked to do, before the job goes on; empty: nothing.
    pub asks: Vec<Request>,
    /// Completed fraction, 0 … 1; `None`: unknown.
    pub fraction: Option<f64>,
    /// Why it failed; empty: it did not, or was cancelled and there is nothing else to say.
    pub error: String,
    /// It was cancelled before it had an answer.
    pub is_cancelled: bool,
    /// Name of its answer in the session; empty: none.
    pub answer: String,
}

/// The job that runs, or the last one.
#[derive(Clone)]
pub struct Jobs {
    state: Arc<Mutex<JobState>>,
    /// The reply to [`JobState::asks`].
    reply: Arc<Mutex<Option<String>>>,
    changed: Arc<dyn Fn(JobState) + Send + Sync>,
}

/// A job's view of itself.
#[derive(Clone)]
pub struct Job(Jobs);

impl Job {
    /// Shows the stage.
    pub fn stage(&self, stage: Stage, fraction: Option<f64>) {
        self.0.change(|state| (state.stage, state.fraction) = (stage, fraction));
    }

    /// Asks the person at the page to do something and waits for the reply; `None`: the job was cancelled, or the stand stopped.
    pub fn ask(&self, requests: Vec<Request>, is_stopped: impl Fn() -> bool) -> Option<String> {
        locked(&self.0.reply).take();
        self.0.change(|state| state.asks = requests);
        let reply = loop {
            let reply = locked(&self.0.reply).take();
            if reply.is_some() || self.is_cancelled() || is_stopped() {
                break reply;
            }
            std::thread::sleep(POLL_INTERVAL);
        };
        self.0.change(|state| state.asks.clear());
        reply
    }

    /// Runs what reads files, which no switch ends: when the job is cancelled, the thread that reads is left to its end and its result is
    /// dropped.
    ///
    /// # Errors
    /// The job is cancelled, or the system has no thread.
    pub fn while_reading<T: Send + 'static>(&self, read: impl FnOnce() -> T + Send + 'static) -> Result<T, JobError> {
        let (done, result) = mpsc::channel();
        std::thread::Builder::new().name("reading".to_owned()).spawn(move || drop(done.send(read()))).map_err(message)?;
        loop {
            match result.recv_timeout(POLL_INTERVAL) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) if self.is_cancelled() => return Err(JobError::Cancelled),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(JobError::Failed("the file could not be read: internal error".to_owned()));
                }
            }
        }
    }

    /// It has been cancelled.
    pub fn is_cancelled(&self) -> bool {
        CANCELLED.load(Ordering::Relaxed)
    }
}

impl Jobs {
    /// No job; `changed` receives each new state.
    pub fn new(changed: impl Fn(JobState) + Send + Sync + 'static) -> Self {
        Jobs { state: Arc::default(), reply: Arc::default(), changed: Arc::new(changed) }
    }

    /// The state now.
    pub fn state(&self) -> JobState {
        locked(&self.state).clone()
    }

    /// A job has the stream.
    pub fn has_stream(&self) -> bool {
        let state = locked(&self.state);
        state.is_running && state.uses_stand
    }

    /// Starts a job, which returns the name of its answer; `uses_stand`: it has the stream until its end. `claim` is made before the
    /// request is answered, so that it does not depend on when the job begins.
    ///
    /// # Errors
    /// In words for the page: another job runs, the claim is refused, or the system has no thread.
    pub fn start(
        &self,
        kind: &str,
        uses_stand: bool,
        claim: impl FnOnce() -> Result<(), String>,
        work: impl FnOnce(&Job) -> Result<String, JobError> + Send + 'static,
    ) -> Result<u64, String> {
        let number = {
            let mut state = locked(&self.state);
            if state.is_running {
                return Err(format!("another job runs ({}); cancel it or wait for its end", state.kind));
            }
            CANCELLED.store(false, Ordering::Relaxed);
            *state = JobState { number: state.number + 1, kind: kind.to_owned(), is_running: true, uses_stand, ..JobState::default() };
            state.number
        };
        if let Err(error) = claim() {
            self.change(|state| (state.is_running, state.error) = (false, error.clone()));
            return Err(error);
        }
        (self.changed)(self.state());
        let jobs = self.clone();
        let run = move || {
            let job = Job(jobs.clone());
            // A panic of an analysis is a failed job, not a job that runs forever.
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&job)));
            let result = result.unwrap_or_else(|_| Err(JobError::Failed("the analysis failed with an internal error".to_owned())));
            jobs.change(|state| {
                state.is_running = false;
                match result {
                    Ok(answer) => state.answer = answer,
                    Err(JobError::Cancelled) => state.is_cancelled = true,
                    Err(JobError::Failed(error)) => (state.error, state.is_cancelled) = (error, job.is_cancelled()),
                }
            });
        };
        match std::thread::Builder::new().name(format!("job {kind}")).spawn(run) {
            Ok(_) => Ok(number),
            Err(error) => {
                self.change(|state| (state.is_running, state.error) = (false, error.to_string()));
                Err(error.to_string())
            }
        }
    }

    /// The person at the page has done what the job asks.
    pub fn reply(&self, text: String) {
        *locked(&self.reply) = Some(text);
    }

    /// Cancels the job that runs.
    pub fn cancel(&self) {
        CANCELLED.store(true, Ordering::Relaxed);
    }

    fn change(&self, change: impl FnOnce(&mut JobState)) {
        change(&mut locked(&self.state));
        (self.changed)(self.state());
    }
}
