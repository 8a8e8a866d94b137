//! Keeps the stream of the live plots running: at the start, after a stop, after a recording.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::thread::JoinHandle;
use std::time::Duration;

use super::control::NOBODY;
use super::jobs::Jobs;
use super::line::Line;
use stand_acquire::link::REPLY_TIMEOUT;

/// Time without rows after which the stream is started.
const SILENCE: Duration = Duration::from_millis(400);
/// Ten channels at 1 kHz.
const COMMANDS: [&str; 4] = ["STReam:CHANnels u_V", "STReam:DECimation 1", "STReam:CHANnels DEFault", "STReam ON"];

/// The thread that keeps the stream.
pub struct StreamKeeper {
    ends: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl StreamKeeper {
    /// Ends the thread.
    pub fn end(mut self) {
        self.ends.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Starts the stream whenever no rows come and no recording runs.
pub fn keep(line: Line, jobs: Jobs) -> StreamKeeper {
    let ends = Arc::new(AtomicBool::new(false));
    let ended = ends.clone();
    let run = move || {
        let rows = line.tap();
        while !ended.load(Ordering::Relaxed) {
            match rows.recv_timeout(SILENCE) {
                Ok(_) => while rows.try_recv().is_ok() {},
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) if jobs.has_stream() => {}
                Err(RecvTimeoutError::Timeout) => {
                    // A failure shows in the state of the line; the next silence is the next attempt.
                    let _ = COMMANDS.iter().try_for_each(|command| line.exchange(NOBODY, command, REPLY_TIMEOUT).map(drop));
                }
            }
        }
    };
    let thread = std::thread::Builder::new().name("stream".to_owned()).spawn(run).ok();
    StreamKeeper { ends, thread }
}
