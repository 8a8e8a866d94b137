//! What all requests and pages of a panel share.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::time::Instant;

use super::control::ClientId;
use super::hub::Hub;
use super::jobs::Jobs;
use super::line::Line;
use super::security::Gate;
use super::session::Session;

/// All parts of a panel.
pub struct Panel {
    /// The line to the stand.
    pub line: Line,
    /// What pages see.
    pub hub: Arc<Hub>,
    /// The folder.
    pub session: Arc<Session>,
    /// The work.
    pub jobs: Jobs,
    /// The checks.
    pub gate: Gate,
    /// Number of the next page.
    pub next_client: AtomicU64,
    /// Pages that are open.
    pub clients: AtomicUsize,
}

impl Panel {
    /// Stops the drive and says why.
    pub fn stop(&self, reason: &str) {
        self.line.stop(reason);
        self.hub.note("0x18", &[], &[format!("stopped: {reason}")]);
    }

    /// A page leaves; if it may have set the drive in motion, the drive is stopped.
    pub fn leave(&self, client: ClientId, reason: &str) {
        let must_stop = self.line.control().leave(client, Instant::now());
        if must_stop {
            self.stop(reason);
        }
    }
}
