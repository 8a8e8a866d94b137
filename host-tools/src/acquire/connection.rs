//! A connection to a stand: commands, queries and the rows of its stream. Behind it is a serial port ([`SerialLink`]) or the simulated
//! controller in virtual time ([`SimulatedConnection`]).

use crate::acquire::link::{LinkError, Received, Receiver, SerialLink, with_checksum};
use hal_sim::board::PlantPort;
use hal_sim::controller::Controller;
use stand_firmware::board::{Clock, TICKS_PER_S};
use stand_firmware::telemetry::RowFrame;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Longest wait for a reply of the simulated stand, s.
const REPLY_TIMEOUT_S: f64 = 1.0;

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
}

/// A connection to a stand.
#[allow(async_fn_in_trait)] // one thread
pub trait StandConnection {
    /// Sends a query; the single line of the reply.
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError>;
    /// Sends a command and checks that the stand accepted it.
    async fn command(&mut self, command: &str) -> Result<(), ConnectionError>;
    /// Waits; the rows of the stream that arrived in this time.
    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError>;
}

impl StandConnection for SerialLink {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        Ok(SerialLink::query(self, query)?)
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
}

/// The host's end of the simulated controller's serial line, in virtual time.
pub struct SimulatedConnection<'h, 'c, P> {
    controller: &'h Controller<'c, P>,
    receiver: Receiver,
    received: VecDeque<Received>,
}

impl<'h, 'c, P: PlantPort> SimulatedConnection<'h, 'c, P> {
    /// Connects to a controller.
    pub fn new(controller: &'h Controller<'c, P>) -> Self {
        Self { controller, receiver: Receiver::default(), received: VecDeque::new() }
    }

    async fn pass(&mut self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        let mut bytes = Vec::new();
        self.controller.line().receive(&mut bytes);
        self.receiver.take(&bytes, &mut self.received);
    }

    async fn line(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.received.retain(|received| !matches!(received, Received::Line(_)));
        self.controller.line().send(with_checksum(query).as_bytes());
        let mut waited = 0.0;
        while waited < REPLY_TIMEOUT_S {
            self.pass(0.002).await;
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

impl<P: PlantPort> StandConnection for SimulatedConnection<'_, '_, P> {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.line(query).await
    }

    async fn command(&mut self, command: &str) -> Result<(), ConnectionError> {
        // A rejected command discards the rest of its line, so the error needs a line of its own.
        self.controller.line().send(with_checksum(command).as_bytes());
        self.pass(0.005).await;
        let message = self.line("SYSTem:ERRor?").await?;
        if message.starts_with("0,") { Ok(()) } else { Err(ConnectionError::Rejected { command: command.to_owned(), message }) }
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        // The buffer of the line holds 22 ms of a stream.
        let mut rows = Vec::new();
        let mut left = seconds;
        while left > 0.0 {
            self.pass(left.min(0.05)).await;
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
}
