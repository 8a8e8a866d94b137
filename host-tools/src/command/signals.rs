//! Signals that interrupt a recording.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use super::error::CliError;

/// Counts SIGINT (Ctrl-C), SIGTERM and SIGHUP.
#[derive(Debug, Clone)]
pub(super) struct Interrupts(Arc<AtomicUsize>);

impl Interrupts {
    /// Installs the handlers. The first signal is counted; the second ends the program with exit status 1.
    pub(super) fn install() -> Result<Self, CliError> {
        let (count, second) = (Arc::new(AtomicUsize::new(0)), Arc::new(AtomicBool::new(false)));
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM, signal_hook::consts::SIGHUP] {
            let registered = signal_hook::flag::register_conditional_shutdown(signal, 1, second.clone())
                .and_then(|_| signal_hook::flag::register(signal, second.clone()))
                .and_then(|_| signal_hook::flag::register_usize(signal, count.clone(), 1));
            registered.map_err(|e| CliError::Other(format!("cannot install signal handlers: {e}")))?;
        }
        Ok(Self(count))
    }

    /// A signal has arrived.
    pub(super) fn any(&self) -> bool {
        self.0.load(Ordering::Relaxed) > 0
    }
}
