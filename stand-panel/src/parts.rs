//! What all requests and pages of a panel share.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use super::control::ClientId;
use super::hub::Hub;
use super::jobs::Jobs;
use super::line::Line;
use super::lock::locked;
use super::security::Gate;
use super::session::Session;
use super::stage::StopReason;

/// Presses of STOP that are remembered.
const MAX_PRESSES: usize = 64;

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
    /// The latest presses of STOP, by the numbers that the pages draw for them.
    pub presses: Mutex<VecDeque<u64>>,
}

impl Panel {
    /// Stops the drive and says why.
    pub fn stop(&self, reason: StopReason) {
        self.line.stop(reason);
        self.hub.note("0x18", &[], &[format!("stopped: {reason}")]);
    }

    /// STOP on a page. A page sends each press by its WebSocket and by a request, because either may be down or delayed. Both have the
    /// number of the press, and the later one does nothing: one press is one 0x18 on the line, and a request that was delayed does not stop
    /// what was begun after it. A press without a number always stops.
    pub fn press_stop(&self, press: Option<u64>) {
        if let Some(press) = press {
            let mut presses = locked(&self.presses);
            if presses.contains(&press) {
                return;
            }
            if presses.len() == MAX_PRESSES {
                presses.pop_front();
            }
            presses.push_back(press);
        }
        self.stop(StopReason::Pressed);
    }

    /// A page leaves; if it may have set the drive in motion, the drive is stopped.
    pub fn leave(&self, client: ClientId, reason: StopReason) {
        let must_stop = self.line.control().leave(client, Instant::now());
        if must_stop {
            self.stop(reason);
        }
    }
}
