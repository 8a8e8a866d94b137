//! A connection to a stand: commands, queries and the rows of its stream. Behind it is a serial port ([`SerialLink`]), or the simulated
//! controller or the emulated chip in virtual time ([`SimulatedConnection`]).

use crate::link::{BAUD, LineLosses, LinkError, Received, Receiver, SerialLink, drives, sign, with_checksum};
use chip_sim::machine::{Halt, Machine};
use chip_sim::time::of_seconds;
use hal_sim::controller::Controller;
use identification::deadline::Deadline;
use stand_firmware::board::{Clock, TICKS_PER_S};
use stand_firmware::telemetry::RowFrame;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Longest wait for a reply of the simulated stand, s.
const REPLY_TIMEOUT_S: f64 = 1.0;

/// Interval of the signs of life in virtual time, s.
const ALIVE_INTERVAL_S: f64 = 0.5;

/// Why a command or query failed.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionError {
    /// The serial line.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The stand rejected the command.
    #[error("the stand rejected `{command}`: {message}")]
    Rejected {
        /// The command.
        command: String,
        /// The stand's error.
        message: String,
    },
    /// No reply, or an unexpected one.
    #[error("unexpected reply to `{query}`: {reply:?}")]
    Reply {
        /// The query.
        query: String,
        /// The reply.
        reply: String,
    },
    /// The emulated program did something that the chip cannot do.
    #[error("the emulated chip halted: {0}")]
    Halt(#[from] Halt),
    /// The user interrupted a wait.
    #[error("interrupted by the user")]
    Interrupted,
}

/// A connection to a stand.
#[allow(async_fn_in_trait)] // one thread
pub trait StandConnection {
    /// Sends a query; the single line of the reply.
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError>;
    /// Sends a query; the lines of the reply.
    async fn query_lines(&mut self, query: &str) -> Result<Vec<String>, ConnectionError>;
    /// Sends a command and checks that the stand accepted it.
    async fn command(&mut self, command: &str) -> Result<(), ConnectionError>;
    /// Waits; the rows of the stream that arrived in this time. A connection that can be interrupted waits no longer then, and refuses the
    /// next wait: a loop with a monitor of its own asks that first, every other loop ends by [`ConnectionError::Interrupted`]. Commands
    /// that end a motion are still sent.
    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError>;
    /// Name of the port, for notes and messages.
    fn name(&self) -> String;
    /// Losses on the line since the last [`StandConnection::reset_losses`].
    fn losses(&self) -> LineLosses;
    /// Discards received data and sets the losses to zero.
    fn reset_losses(&mut self);
}

impl StandConnection for SerialLink {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        Ok(SerialLink::query(self, query)?)
    }

    async fn query_lines(&mut self, query: &str) -> Result<Vec<String>, ConnectionError> {
        Ok(SerialLink::query_lines(self, query)?)
    }

    async fn command(&mut self, command: &str) -> Result<(), ConnectionError> {
        Ok(SerialLink::command(self, command)?)
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        let until = Instant::now() + Duration::from_secs_f64(seconds);
        let mut rows = Vec::new();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(rows);
            }
            if let Some(Received::Row(row)) = self.receive(left)? {
                rows.push(row);
            }
        }
    }

    fn name(&self) -> String {
        SerialLink::name(self)
    }

    fn losses(&self) -> LineLosses {
        SerialLink::losses(self)
    }

    fn reset_losses(&mut self) {
        self.reset();
    }
}

/// The host's end of a serial line in virtual time.
#[allow(async_fn_in_trait)] // one thread
pub trait VirtualLine {
    /// Name for notes and messages.
    const NAME: &'static str;
    /// Sends bytes to the stand.
    fn send(&mut self, bytes: &[u8]);
    /// Lets time pass; the bytes that the stand has sent are appended.
    ///
    /// # Errors
    /// The simulation cannot go on.
    async fn pass(&mut self, seconds: f64, received: &mut Vec<u8>) -> Result<(), ConnectionError>;
}

impl VirtualLine for &Controller<'_> {
    const NAME: &'static str = "simulated stand";

    fn send(&mut self, bytes: &[u8]) {
        self.line().send(bytes);
    }

    async fn pass(&mut self, seconds: f64, received: &mut Vec<u8>) -> Result<(), ConnectionError> {
        let clock = self.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        self.line().receive(received);
        Ok(())
    }
}

impl VirtualLine for &mut Machine<'_> {
    const NAME: &'static str = "emulated chip";

    fn send(&mut self, bytes: &[u8]) {
        Machine::send(self, bytes, u64::from(BAUD));
    }

    async fn pass(&mut self, seconds: f64, received: &mut Vec<u8>) -> Result<(), ConnectionError> {
        self.run_until(self.now() + of_seconds(seconds))?;
        received.append(&mut self.take_sent());
        Ok(())
    }
}

/// A stand in virtual time.
pub struct SimulatedConnection<L> {
    stand: L,
    receiver: Receiver,
    received: VecDeque<Received>,
    /// This connection has sent a command of a program that drives.
    has_driven: bool,
    /// Time since the last [`sign`], s.
    signed_s: f64,
    /// Ends the waits.
    deadline: Deadline,
}

impl<L: VirtualLine> SimulatedConnection<L> {
    /// Connects to a stand.
    pub fn new(stand: L) -> Self {
        Self {
            stand,
            receiver: Receiver::default(),
            received: VecDeque::new(),
            has_driven: false,
            signed_s: 0.0,
            deadline: Deadline::NEVER,
        }
    }

    /// The same, interrupted by a deadline.
    pub fn until(self, deadline: Deadline) -> Self {
        Self { deadline, ..self }
    }

    fn send(&mut self, command: &str) {
        self.has_driven |= drives(command);
        self.stand.send(with_checksum(command).as_bytes());
    }

    async fn pass(&mut self, seconds: f64) -> Result<(), ConnectionError> {
        if let Some(sign) = sign(self.has_driven, self.receiver.is_streaming())
            && self.signed_s >= ALIVE_INTERVAL_S
        {
            self.signed_s = 0.0;
            self.stand.send(with_checksum(sign).as_bytes());
        }
        self.signed_s += seconds;
        let mut bytes = Vec::new();
        self.stand.pass(seconds, &mut bytes).await?;
        self.receiver.take(&bytes, &mut self.received).map_err(|other| other.at(L::NAME.to_owned()))?;
        Ok(())
    }

    async fn line(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.received.retain(|received| !matches!(received, Received::Line(_)));
        self.send(query);
        let mut waited = 0.0;
        while waited < REPLY_TIMEOUT_S {
            self.pass(0.002).await?;
            waited += 0.002;
            let is_reply = |received: &Received| matches!(received, Received::Line(line) if !line.starts_with("ERROR "));
            if let Some(at) = self.received.iter().position(is_reply)
                && let Some(Received::Line(line)) = self.received.remove(at)
            {
                return Ok(line);
            }
        }
        Err(ConnectionError::Reply { query: query.to_owned(), reply: String::new() })
    }
}

impl<L: VirtualLine> StandConnection for SimulatedConnection<L> {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.line(query).await
    }

    async fn query_lines(&mut self, query: &str) -> Result<Vec<String>, ConnectionError> {
        let mut lines = vec![self.line(query).await?];
        // The reply is complete when the stand has nothing more to say.
        loop {
            self.pass(0.01).await?;
            let before = lines.len();
            self.received.retain_mut(|received| match received {
                Received::Line(line) => {
                    lines.push(std::mem::take(line));
                    false
                }
                _ => true,
            });
            if lines.len() == before {
                return Ok(lines);
            }
        }
    }

    async fn command(&mut self, command: &str) -> Result<(), ConnectionError> {
        // A rejected command discards the rest of its line, so the error needs a line of its own.
        self.send(command);
        self.pass(0.005).await?;
        let message = self.line("SYSTem:ERRor?").await?;
        if message.starts_with("0,") { Ok(()) } else { Err(ConnectionError::Rejected { command: command.to_owned(), message }) }
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        if self.deadline.has_passed() {
            return Err(ConnectionError::Interrupted);
        }
        // The buffer of the line holds 22 ms of a stream.
        let mut rows = Vec::new();
        let mut left = seconds;
        while left > 0.0 && !self.deadline.has_passed() {
            self.pass(left.min(0.05)).await?;
            left -= 0.05;
            self.received.retain(|received| match received {
                Received::Row(row) => {
                    rows.push(*row);
                    false
                }
                _ => true,
            });
        }
        Ok(rows)
    }

    fn name(&self) -> String {
        L::NAME.to_owned()
    }

    fn losses(&self) -> LineLosses {
        self.receiver.losses()
    }

    fn reset_losses(&mut self) {
        self.received.clear();
        self.receiver.reset_losses();
    }
}
