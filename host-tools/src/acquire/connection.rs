//! A stand at the end of a line, for a session: asked, told, listened to; a port ([`SerialLink`]) or the simulated controller in virtual time
//! ([`Simulated`]). One session, one code.

use crate::acquire::link::{LinkError, Received, Receiver, SerialLink, with_checksum};
use hal_sim::board::PlantPort;
use hal_sim::controller::Controller;
use stand_firmware::board::{Clock, TICKS_PER_S};
use stand_firmware::telemetry::RowFrame;
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How long a simulated stand may take for a reply, s.
const REPLY_S: f64 = 1.0;

/// Why a session ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionError {
    /// The line.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The stand refuses, with its own words.
    #[error("the stand refuses {order}: {says}")]
    Refused {
        /// What was told.
        order: String,
        /// What it said.
        says: String,
    },
    /// No reply, or one that is none.
    #[error("the stand does not answer {query} as it should: {says:?}")]
    Reply {
        /// What was asked.
        query: String,
        /// What came.
        says: String,
    },
}

/// A stand that is asked and told.
#[allow(async_fn_in_trait)] // one thread
pub trait StandConnection {
    /// The one line of a reply.
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError>;
    /// Makes sure that it was taken.
    async fn command(&mut self, order: &str) -> Result<(), ConnectionError>;
    /// Lets time pass; the rows that came meanwhile, where a stream is on.
    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError>;
}

impl StandConnection for SerialLink {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        Ok(SerialLink::query(self, query)?)
    }

    async fn command(&mut self, order: &str) -> Result<(), ConnectionError> {
        Ok(SerialLink::command(self, order)?)
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        let until = Instant::now() + Duration::from_secs_f64(seconds);
        let mut rows = Vec::new();
        loop {
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Ok(rows);
            }
            if let Some(Received::Row(row)) = self.next(left)? {
                rows.push(row);
            }
        }
    }
}

/// The simulated controller from the host's end of its line, in virtual time.
pub struct SimulatedConnection<'h, 'c, P> {
    controller: &'h Controller<'c, P>,
    receiver: Receiver,
    heard: VecDeque<Received>,
}

impl<'h, 'c, P: PlantPort> SimulatedConnection<'h, 'c, P> {
    /// At the end of this one's line.
    pub fn new(controller: &'h Controller<'c, P>) -> Self {
        Self { controller, receiver: Receiver::default(), heard: VecDeque::new() }
    }

    async fn pass(&mut self, seconds: f64) {
        let clock = self.controller.clock();
        clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        let mut bytes = Vec::new();
        self.controller.line().receive(&mut bytes);
        self.receiver.take(&bytes, &mut self.heard);
    }

    async fn line(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.heard.retain(|heard| !matches!(heard, Received::Line(_)));
        self.controller.line().send(with_checksum(query).as_bytes());
        let mut waited = 0.0;
        while waited < REPLY_S {
            self.pass(0.002).await;
            waited += 0.002;
            let is_reply = |heard: &Received| matches!(heard, Received::Line(line) if !line.starts_with("ERROR "));
            if let Some(at) = self.heard.iter().position(is_reply)
                && let Some(Received::Line(line)) = self.heard.remove(at)
            {
                return Ok(line);
            }
        }
        Err(ConnectionError::Reply { query: query.to_owned(), says: String::new() })
    }
}

impl<P: PlantPort> StandConnection for SimulatedConnection<'_, '_, P> {
    async fn query(&mut self, query: &str) -> Result<String, ConnectionError> {
        self.line(query).await
    }

    async fn command(&mut self, order: &str) -> Result<(), ConnectionError> {
        // What is refused leaves the rest of its line undone, so the error is asked for by itself.
        self.controller.line().send(with_checksum(order).as_bytes());
        self.pass(0.005).await;
        let says = self.line("SYSTem:ERRor?").await?;
        if says.starts_with("0,") { Ok(()) } else { Err(ConnectionError::Refused { order: order.to_owned(), says }) }
    }

    async fn wait_s(&mut self, seconds: f64) -> Result<Vec<RowFrame>, ConnectionError> {
        // The line holds 22 ms of a stream.
        let mut rows = Vec::new();
        let mut left = seconds;
        while left > 0.0 {
            self.pass(left.min(0.05)).await;
            left -= 0.05;
            self.heard.retain(|heard| match heard {
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
