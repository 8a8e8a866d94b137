//! A stand at a serial port, real or simulated.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use embassy_futures::block_on;
use identification::log::Notes;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use stand_acquire::link::SerialLink;
use stand_acquire::profile_recording::{ProfileRecordingError, ProfileRecordingRequest, early_end, record_profile};
use stand_acquire::recording::{RecordingMonitor, RecordingProgress};
#[cfg(unix)]
use stand_acquire::serve::SimulatedStand;
use stand_firmware::telemetry::Channels;

use crate::error::{log_error, stand_error};
use crate::sim::{profile_of, stand_of};
use crate::task::{self, Task};

/// Longest wait for a row while nothing else is done.
const WAIT: Duration = Duration::from_millis(100);

/// A stand. Every wait gives the stand the signs of life without which it switches its drive off.
#[pyclass(frozen, module = "rotary_stand._native")]
pub struct Stand {
    /// `None` after `close`.
    link: Arc<Mutex<Option<SerialLink>>>,
    #[cfg(unix)]
    simulated: Mutex<Option<SimulatedStand>>,
    #[pyo3(get)]
    identity: String,
    #[pyo3(get)]
    port: String,
}

/// The link; a call that has panicked leaves it as it is.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Stand {
    fn opened(link: SerialLink) -> Self {
        let (identity, port) = (link.identity().to_owned(), link.name());
        let link = Arc::new(Mutex::new(Some(link)));
        Stand {
            link,
            #[cfg(unix)]
            simulated: Mutex::new(None),
            identity,
            port,
        }
    }

    /// Runs `work` with the link, without the interpreter's lock.
    fn with<T: Send + 'static>(
        &self,
        py: Python<'_>,
        progress: Option<&Bound<'_, PyAny>>,
        work: impl FnOnce(&mut SerialLink, &Task) -> PyResult<T> + Send + 'static,
    ) -> PyResult<T> {
        let link = self.link.clone();
        task::run(py, progress, move |task| match locked(&link).as_mut() {
            Some(link) => work(link, task),
            None => Err(stand_error("the connection to the stand is closed")),
        })
    }
}

#[pymethods]
impl Stand {
    /// Opens the port and identifies the stand.
    #[staticmethod]
    fn open(py: Python<'_>, port: PathBuf) -> PyResult<Stand> {
        task::run(py, None, move |_| SerialLink::open(&port).map(Stand::opened).map_err(stand_error))
    }

    /// Starts a simulated stand in real time behind a pseudo-terminal and opens it.
    #[cfg(unix)]
    #[staticmethod]
    fn simulated(py: Python<'_>, seed: u64, description: Option<&str>) -> PyResult<Stand> {
        let description = stand_of(description)?;
        task::run(py, None, move |_| {
            let simulated = SimulatedStand::start(description, seed).map_err(stand_error)?;
            let stand = Stand::opened(SerialLink::open(simulated.port()).map_err(stand_error)?);
            locked(&stand.simulated).replace(simulated);
            Ok(stand)
        })
    }

    /// Sends a command and checks that the stand accepted it.
    fn write(&self, py: Python<'_>, command: String) -> PyResult<()> {
        self.with(py, None, move |link, _| link.command(&command).map_err(stand_error))
    }

    /// Sends a query; the lines of the reply.
    fn query_lines(&self, py: Python<'_>, query: String) -> PyResult<Vec<String>> {
        self.with(py, None, move |link, _| link.query_lines(&query).map_err(stand_error))
    }

    /// Waits with signs of life.
    fn wait(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let length = Duration::try_from_secs_f64(seconds).map_err(|e| PyValueError::new_err(format!("seconds {seconds}: {e}")))?;
        self.with(py, None, move |link, task| {
            let begin = Instant::now();
            while let Some(left) = length.checked_sub(begin.elapsed()).filter(|left| !left.is_zero() && !task.is_cancelled()) {
                link.receive(left.min(WAIT)).map_err(stand_error)?;
            }
            Ok(())
        })
    }

    /// Runs a profile and records it into a file. Why the recording ended early, or `None`.
    #[expect(clippy::too_many_arguments, reason = "arguments of the Python function")]
    fn record(
        &self,
        py: Python<'_>,
        path: PathBuf,
        profile: &str,
        mode: &str,
        parameters: Vec<(String, f64)>,
        seconds: f64,
        seed: u64,
        decimation: u16,
        find_index: bool,
        also: Vec<String>,
        notes: Vec<(String, String)>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Option<String>> {
        let (mode, profile) = profile_of(profile, mode, seed, &parameters)?;
        if !(1e-3..=1e6).contains(&seconds) || !(1..=1000).contains(&decimation) {
            return Err(PyValueError::new_err("seconds must be 0.001 to 1000000, decimation 1 to 1000"));
        }
        let mut additional_channels = Channels::default();
        for name in &also {
            let channel = Channels::named(name).ok_or_else(|| PyValueError::new_err(format!("also: {name:?} is not a channel")))?;
            additional_channels = additional_channels.and(channel);
        }
        let notes = Notes::from(notes);
        self.with(py, progress.as_ref(), move |link, task| {
            let request =
                ProfileRecordingRequest { mode, profile, seconds, decimation, find_index, additional_channels, notes, path: &path };
            let recording = block_on(record_profile(link, &request, &mut Monitor { task, seconds })).map_err(|error| match error {
                ProfileRecordingError::Log(error) => log_error(&error),
                other => stand_error(other),
            })?;
            Ok(early_end(&recording.end))
        })
    }

    /// Stops the drive at once, by the byte 0x18.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, None, |link, _| link.stop().map_err(stand_error))
    }

    /// Switches the drive off and closes the port; a simulated stand ends.
    fn close(&self, py: Python<'_>) {
        let link = self.link.clone();
        py.detach(|| {
            if let Some(mut link) = locked(&link).take() {
                // Also where the stand runs unattended, and where a calibration refuses OUTPut OFF. The link reports what fails when it is
                // dropped.
                let _ = link.command("OUTPut OFF").or_else(|_| link.stop());
            }
            #[cfg(unix)]
            drop(locked(&self.simulated).take());
        });
    }

    /// Closes the connection of a simulated stand, which goes on: another program may open its port.
    fn release_port(&self, py: Python<'_>) {
        let link = self.link.clone();
        py.detach(|| drop(locked(&link).take()));
    }

    /// The connection is closed.
    #[getter]
    fn is_closed(&self, py: Python<'_>) -> bool {
        py.detach(|| locked(&self.link).is_none())
    }
}

/// Reports the progress of a recording to the caller and asks whether it goes on.
struct Monitor<'t> {
    task: &'t Task,
    seconds: f64,
}

impl RecordingMonitor for Monitor<'_> {
    fn progress(&mut self, progress: RecordingProgress) -> bool {
        self.task.progress(format!("recording, {:+.3} rad/s", progress.rate_rad_s), Some((progress.at_s / self.seconds).min(1.0)));
        !self.task.is_cancelled()
    }
}
