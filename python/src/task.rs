//! A call into the library on a thread of its own: the interpreter's lock is released, signals are heard, progress is reported.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::time::Duration;

use identification::deadline::Deadline;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Interval at which signals are looked for.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Switches that no call uses. A [`Deadline`] needs one that lives for ever; there are as many as calls have run at the same time.
static FREE_SWITCHES: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

/// The switch that cancels one call, returned when the work has ended.
struct Switch(&'static AtomicBool);

impl Switch {
    fn take() -> Self {
        let free = FREE_SWITCHES.lock().ok().and_then(|mut free| free.pop());
        let switch = free.unwrap_or_else(|| Box::leak(Box::new(AtomicBool::new(false))));
        switch.store(false, Ordering::Relaxed);
        Switch(switch)
    }
}

impl Drop for Switch {
    fn drop(&mut self) {
        if let Ok(mut free) = FREE_SWITCHES.lock() {
            free.push(self.0);
        }
    }
}

enum Message<T> {
    Progress(String, Option<f64>),
    Done(PyResult<T>),
}

/// What the work sees of the call: whether it is cancelled, and whom to tell its progress.
pub struct Task {
    switch: Switch,
    report: Box<dyn Fn(String, Option<f64>) + Send + Sync>,
}

impl Task {
    /// Passes after so many seconds, or when the call is cancelled.
    pub fn deadline(&self, seconds: Option<f64>) -> Deadline {
        Deadline::after_s(seconds).or_when(self.switch.0)
    }

    /// The call is cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.switch.0.load(Ordering::Relaxed)
    }

    /// Reports the stage, and the completed fraction where it is known.
    pub fn progress(&self, stage: String, fraction: Option<f64>) {
        (self.report)(stage, fraction);
    }
}

/// Runs `work` on a thread of its own and waits for it. `progress` is called with the stage and the completed fraction, or `None`.
///
/// # Errors
/// That of the work; what `progress` raises, or `KeyboardInterrupt`: the work is then cancelled and left to its end, its result is dropped.
pub fn run<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&Task) -> PyResult<T> + Send + 'static,
) -> PyResult<T> {
    let (sender, mut receiver) = mpsc::channel::<Message<T>>();
    let switch = Switch::take();
    let cancel = switch.0;
    let stages: Sender<Message<T>> = sender.clone();
    let report = move |stage, fraction| drop(stages.send(Message::Progress(stage, fraction)));
    let task = Task { switch, report: Box::new(report) };
    let run = move || {
        let done = catch_unwind(AssertUnwindSafe(|| work(&task)));
        let result = done.unwrap_or_else(|_| Err(PyRuntimeError::new_err("internal error of the library; standard error has its message")));
        drop(sender.send(Message::Done(result)));
    };
    std::thread::Builder::new().name("rotary_stand".to_owned()).spawn(run).map_err(|e| PyRuntimeError::new_err(e.to_string()))?;
    let told = |stage: String, fraction: Option<f64>| progress.map_or(Ok(()), |progress| progress.call1((stage, fraction)).map(drop));
    loop {
        let waiting = &mut receiver;
        let message = py.detach(move || waiting.recv_timeout(SIGNAL_INTERVAL));
        let heard = match message {
            Ok(Message::Done(result)) => return result,
            Ok(Message::Progress(stage, fraction)) => told(stage, fraction).and_then(|()| py.check_signals()),
            Err(RecvTimeoutError::Timeout) => py.check_signals(),
            Err(RecvTimeoutError::Disconnected) => Err(PyRuntimeError::new_err("the thread of the library has ended without a result")),
        };
        if let Err(error) = heard {
            cancel.store(true, Ordering::Relaxed);
            return Err(error);
        }
    }
}
