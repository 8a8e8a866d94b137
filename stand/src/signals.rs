//! Signals that interrupt a recording.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, LazyLock};

use super::error::CliError;

/// Signals of this process so far.
static SIGNALS: LazyLock<Arc<AtomicUsize>> = LazyLock::new(Arc::default);
/// A signal has arrived.
static ARRIVED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Counts SIGINT (Ctrl-C), SIGTERM and SIGHUP.
#[derive(Debug, Clone)]
pub(super) struct Interrupts;

impl Interrupts {
    /// Installs the handlers. The first signal is counted; the second ends the program with exit status 1.
    pub(super) fn install() -> Result<Self, CliError> {
        let second = ARRIVED.clone();
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM, signal_hook::consts::SIGHUP] {
            let registered = signal_hook::flag::register_conditional_shutdown(signal, 1, second.clone())
                .and_then(|_| signal_hook::flag::register(signal, second.clone()))
                .and_then(|_| signal_hook::flag::register_usize(signal, SIGNALS.clone(), 1));
            registered.map_err(|e| CliError::Other(format!("cannot install signal handlers: {e}")))?;
        }
        Ok(Self)
    }

    /// Becomes true when a signal arrives.
    pub(super) fn switch() -> &'static AtomicBool {
        &ARRIVED
    }

    /// A signal has arrived.
    pub(super) fn any(&self) -> bool {
        Self::any_so_far()
    }

    /// As [`Interrupts::any`], for a function pointer.
    pub(super) fn any_so_far() -> bool {
        SIGNALS.load(Ordering::Relaxed) > 0
    }
}
