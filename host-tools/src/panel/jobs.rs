//! The work of the panel that takes seconds: one job at a time, on its own thread, with progress and cancel.
//!
//! In: a closure that calls the library. Out: [`JobState`] for the page. A job that drives ends with the stop of the drive; a job that computes ends through the switch
//! [`CANCELLED`], which its deadline watches.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

/// Ends the computation that runs. Static, as [`crate::identify::deadline::Deadline`] requires; there is one panel in a process and one job in a panel.
pub static CANCELLED: AtomicBool = AtomicBool::new(false);

/// A job, as the page shows it.
#[derive(Debug, Clone, Default, Serialize)]
pub struct JobState {
    /// Number of the job; 0: none so far.
    pub number: u64,
    /// Its kind: `record`, `compare`, `fit`, `explain`, …
    pub kind: String,
    /// It runs.
    pub is_running: bool,
    /// Stage in words.
    pub stage: String,
    /// Completed fraction, 0 … 1; `None`: unknown.
    pub fraction: Option<f64>,
    /// Why it failed; empty: it did not.
    pub error: String,
    /// Name of its answer in the session; empty: none.
    pub answer: String,
}

/// The job that runs, or the last one.
#[derive(Clone)]
pub struct Jobs {
    state: Arc<Mutex<JobState>>,
    changed: Arc<dyn Fn(JobState) + Send + Sync>,
}

/// A job's view of itself.
#[derive(Clone)]
pub struct Job(Jobs);

impl Job {
    /// Shows the stage.
    pub fn stage(&self, stage: &str, fraction: Option<f64>) {
        self.0.change(|state| (state.stage, state.fraction) = (stage.to_owned(), fraction));
    }

    /// It has been cancelled.
    pub fn is_cancelled(&self) -> bool {
        CANCELLED.load(Ordering::Relaxed)
    }
}

impl Jobs {
    /// No job; `changed` receives each new state.
    pub fn new(changed: impl Fn(JobState) + Send + Sync + 'static) -> Self {
        Jobs { state: Arc::default(), changed: Arc::new(changed) }
    }

    /// The state now.
    pub fn state(&self) -> JobState {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// A recording has the stream.
    pub fn is_recording(&self) -> bool {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.is_running && state.kind == "record"
    }

    /// Starts `work`, which returns the name of its answer; `Err`: another job runs, or the system has no thread.
    ///
    /// # Errors
    /// In words for the page.
    pub fn start(&self, kind: &str, work: impl FnOnce(&Job) -> Result<String, String> + Send + 'static) -> Result<u64, String> {
        let number = {
            let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
            if state.is_running {
                return Err(format!("another job runs ({}); cancel it or wait for its end", state.kind));
            }
            CANCELLED.store(false, Ordering::Relaxed);
            *state = JobState { number: state.number + 1, kind: kind.to_owned(), is_running: true, ..JobState::default() };
            state.number
        };
        (self.changed)(self.state());
        let jobs = self.clone();
        let run = move || {
            let job = Job(jobs.clone());
            // A panic of an analysis is a failed job, not a job that runs forever.
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| work(&job)));
            let result = result.unwrap_or_else(|_| Err("the analysis failed with an internal error".to_owned()));
            jobs.change(|state| {
                state.is_running = false;
                match result {
                    Ok(answer) => state.answer = answer,
                    Err(error) => state.error = error,
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

    /// Cancels the job that runs.
    pub fn cancel(&self) {
        CANCELLED.store(true, Ordering::Relaxed);
    }

    fn change(&self, change: impl FnOnce(&mut JobState)) {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner));
        (self.changed)(self.state());
    }
}
