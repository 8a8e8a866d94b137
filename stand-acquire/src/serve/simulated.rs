//! The simulated stand behind a pseudo-terminal, on a thread of this process.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::plant::{Plant, Stand};

use super::pty::PtyError;
use super::{Pty, ServedLine, serve};

/// Angle of the platform at power-on, rad: not at the index, as on most stands.
const START_ANGLE_RAD: f64 = -2.0;

/// A simulated stand that runs until it is dropped.
#[derive(Debug)]
pub struct SimulatedStand {
    port: PathBuf,
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl SimulatedStand {
    /// Starts the stand.
    ///
    /// # Errors
    /// The operating system provides no pseudo-terminal.
    pub fn start(stand: Stand, seed: u64) -> Result<Self, PtyError> {
        let pty = Pty::open(None)?;
        let port = pty.path().to_owned();
        let ends = Arc::new(AtomicBool::new(false));
        let ended = ends.clone();
        let run = move || {
            if let Err(message) = run(&stand, seed, &mut ServedLine::Pty(pty), &ended) {
                eprintln!("stand: the simulated stand has ended: {message}");
            }
        };
        let thread = std::thread::Builder::new().name("simulated stand".to_owned()).spawn(run).map_err(PtyError::Open)?;
        Ok(SimulatedStand { port, ends, thread: Some(thread) })
    }

    /// Its port.
    pub fn port(&self) -> &Path {
        &self.port
    }
}

fn run(stand: &Stand, seed: u64, line: &mut ServedLine, ended: &AtomicBool) -> Result<(), String> {
    let clock = VirtualClock::default();
    let plant = Plant::new(stand, START_ANGLE_RAD).map_err(|error| error.to_string())?;
    let controller = Controller::new(&clock, &stand.setup(), plant, flash(seed), seed).map_err(|error| error.to_string())?;
    serve(&controller, line, 1.0, &|_| ended.load(Ordering::Relaxed), &mut |_| {}).map_err(|error| error.to_string())
}

impl Drop for SimulatedStand {
    fn drop(&mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
