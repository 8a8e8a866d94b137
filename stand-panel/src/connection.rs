//! The line of the panel as a [`StandConnection`], for the recordings and sessions of [`stand_acquire`].

use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use stand_firmware::telemetry::RowFrame;

use super::control::ClientId;
use super::jobs::CANCELLED;
use super::line::{Line, LineError};
use stand_acquire::connection::{ConnectionError, StandConnection};
use stand_acquire::link::{LineLosses, LinkError, REPLY_TIMEOUT, Reply, drives};

/// Interval between looks at the switch that cancels.
const CANCEL_INTERVAL: Duration = Duration::from_millis(50);

/// A connection of one client. A stop ends it: every later call fails. A cancelled job waits no longer, but can still send what ends its
/// work. Where it has driven, the drive is off at its end, whatever that is.
pub struct PanelConnection {
    line: Line,
    client: ClientId,
    rows: Receiver<RowFrame>,
    stops: u64,
    losses: LineLosses,
    has_driven: bool,
}

impl PanelConnection {
    /// A connection that drives for `client`.
    pub fn new(line: Line, client: ClientId) -> Self {
        let (rows, stops, losses) = (line.tap(), line.stops(), line.losses());
        Self { line, client, rows, stops, losses, has_driven: false }
    }

    fn exchange(&mut self, command: &str) -> Result<Reply, ConnectionError> {
        self.check()?;
        self.has_driven |= drives(command);
        self.line.exchange(self.client, command, REPLY_TIMEOUT).map_err(|error| self.failed(error))
    }

    /// Fails once the drive has been stopped since the connection was made.
    fn check(&self) -> Result<(), ConnectionError> {
        if self.line.stops() == self.stops { Ok(()) } else { Err(self.failed(LineError::Stopped)) }
    }

    fn failed(&self, error: LineError) -> ConnectionError {
        let port = self.line.name().to_owned();
        ConnectionError::Link(LinkError::Other { port, source: std::io::Error::other(error.to_string()) })
    }
}

impl Drop for PanelConnection {
    fn drop(&mut self) {
        if self.has_driven && self.check().is_ok() {
            // A line that is down stops the drive by the supervision of the host.
            let _ = self.line.restore("OUTPut OFF", REPLY_TIMEOUT);
        }
    }
}

impl StandConnection for PanelConnection {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        let reply = self.exchange(query)?;
        match (reply.errors.into_iter().next(), reply.lines.into_iter().find(|line| !line.is_empty())) {
            (Some(message), _) => Err(LinkError::Rejected { command: query.to_owned(), message }.into()),
            (None, Some(line)) => Ok(line),
            (None, None) => Err(LinkError::NoReply { port: self.name(), query: query.to_owned() }.into()),
        }
    }

    async fn query_lines(&mut self, query: &str) -> Result<Vec<String>, ConnectionError> {
        let reply = self.exchange(query)?;
        match reply.errors.into_iter().next() {
            Some(message) => Err(LinkError::Rejected { command: query.to_owned(), message }.into()),
            None => Ok(reply.lines.into_iter().filter(|line| !line.is_empty()).collect()),
        }
    }

    async fn command(&mut self, command: &str) -> Result<(), ConnectionError> {
        match self.exchange(command)?.errors.into_iter().next() {
            Some(message) => Err(LinkError::Rejected { command: command.to_owned(), message }.into()),
            None => Ok(()),
        }
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        let is_cancelled = || CANCELLED.load(Ordering::Relaxed);
        if is_cancelled() {
            return Err(ConnectionError::Interrupted);
        }
        let until = Instant::now() + Duration::from_secs_f64(seconds);
        let mut rows = Vec::new();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            // While a stream runs, rows come without a break: a wait with a stream is short by itself.
            match self.rows.recv_timeout(left.min(CANCEL_INTERVAL)) {
                Ok(row) => rows.push(row),
                Err(RecvTimeoutError::Timeout) if left > CANCEL_INTERVAL && !is_cancelled() => {}
                // Rows until a stop belong to the log.
                Err(RecvTimeoutError::Timeout) if rows.is_empty() => return self.check().map(|()| rows),
                Err(RecvTimeoutError::Timeout) => return Ok(rows),
                Err(RecvTimeoutError::Disconnected) => return Err(self.failed(LineError::Down("the line to the stand is down".to_owned()))),
            }
        }
    }

    fn name(&self) -> String {
        self.line.name().to_owned()
    }

    fn losses(&self) -> LineLosses {
        let now = self.line.losses();
        LineLosses {
            frames: now.frames.saturating_sub(self.losses.frames),
            damaged: now.damaged.saturating_sub(self.losses.damaged),
            rows: now.rows.saturating_sub(self.losses.rows),
        }
    }

    fn reset_losses(&mut self) {
        self.losses = self.line.losses();
        while self.rows.try_recv().is_ok() {}
    }
}
