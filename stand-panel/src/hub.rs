//! What every page sees: the rows of the last 30 s, the state, the commands. Pages subscribe; one that does not read loses blocks and
//! delays nobody.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use axum::body::Bytes;
use serde::Serialize;
use stand_firmware::telemetry::RowFrame;
use tokio::sync::broadcast;

use super::jobs::JobState;
use super::line::{DriveState, LineObserver};

/// Time that a page that has just opened is given, s.
const HISTORY_S: f64 = 30.0;
/// Blocks that a slow page may lag behind.
const BACKLOG: usize = 512;
/// Commands that a page that has just opened is given.
const MAX_COMMANDS: usize = 500;
/// Frequency of the clock in a row, Hz.
const CLOCK_HZ: f64 = 1e7;

/// First byte of a message to a page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MessageKind {
    /// Rows: eight bytes (kind, number of columns, zeros), then for each row the time (s) and the columns, float64 little-endian.
    Rows = 1,
    /// The names of the columns of the rows that follow, JSON.
    Columns = 2,
    /// State of drive, control and job, JSON.
    State = 3,
    /// A command, JSON.
    Command = 4,
}

/// A command that was sent, and its reply.
#[derive(Debug, Clone, Serialize)]
pub struct CommandNote {
    /// Time since the panel started, s.
    pub t_s: f64,
    /// The SCPI line or the command of the shell.
    pub line: String,
    /// Lines of the reply.
    pub replies: Vec<String>,
    /// Errors.
    pub errors: Vec<String>,
}

#[derive(Debug, Default)]
struct Contents {
    columns: Vec<&'static str>,
    blocks: VecDeque<(f64, Bytes)>,
    drive: DriveState,
    job: JobState,
    commands: VecDeque<Bytes>,
}

/// The hub.
#[derive(Debug)]
pub struct Hub {
    begun: Instant,
    contents: Mutex<Contents>,
    messages: broadcast::Sender<Bytes>,
}

/// A message of JSON.
pub fn json_message(kind: MessageKind, value: &impl Serialize) -> Bytes {
    let mut bytes = vec![kind as u8];
    // Values of this module have string keys and no cycles, so this cannot fail; an empty object is shown as unknown.
    if serde_json::to_writer(&mut bytes, value).is_err() {
        bytes.extend_from_slice(b"{}");
    }
    bytes.into()
}

impl Default for Hub {
    fn default() -> Self {
        Hub { begun: Instant::now(), contents: Mutex::default(), messages: broadcast::channel(BACKLOG).0 }
    }
}

impl Hub {
    fn contents(&self) -> MutexGuard<'_, Contents> {
        self.contents.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All messages so far that a new page needs, and those to come.
    pub fn subscribe(&self) -> (Vec<Bytes>, broadcast::Receiver<Bytes>) {
        let contents = self.contents();
        let mut first = vec![json_message(MessageKind::Columns, &contents.columns)];
        first.extend(contents.blocks.iter().map(|(_, block)| block.clone()));
        first.extend(contents.commands.iter().cloned());
        // Subscribed under the lock: no message is missing or doubled.
        (first, self.messages.subscribe())
    }

    /// State of the drive.
    pub fn drive(&self) -> DriveState {
        self.contents().drive.clone()
    }

    /// The job.
    pub fn job(&self) -> JobState {
        self.contents().job.clone()
    }

    /// The job has changed.
    pub fn set_job(&self, job: JobState) {
        self.contents().job = job;
    }

    /// A command was sent.
    pub fn note(&self, line: &str, replies: &[String], errors: &[String]) {
        let note = CommandNote {
            t_s: self.begun.elapsed().as_secs_f64(),
            line: line.to_owned(),
            replies: replies.to_vec(),
            errors: errors.to_vec(),
        };
        let message = json_message(MessageKind::Command, &note);
        let mut contents = self.contents();
        if contents.commands.len() == MAX_COMMANDS {
            contents.commands.pop_front();
        }
        contents.commands.push_back(message.clone());
        let _ = self.messages.send(message);
    }

    fn take_rows(&self, rows: &[RowFrame]) {
        let mut contents = self.contents();
        for run in rows.chunk_by(|a, b| a.channels == b.channels) {
            let columns: Vec<&'static str> = run[0].iter().map(|(channel, _)| channel.name).collect();
            if contents.columns != columns {
                contents.blocks.clear();
                let _ = self.messages.send(json_message(MessageKind::Columns, &columns));
                contents.columns = columns;
            }
            let mut block = Vec::with_capacity(8 + run.len() * (1 + contents.columns.len()) * 8);
            block.extend_from_slice(&[MessageKind::Rows as u8, contents.columns.len() as u8, 0, 0, 0, 0, 0, 0]);
            let mut t_s = 0.0;
            for row in run {
                t_s = row.at as f64 / CLOCK_HZ;
                block.extend_from_slice(&t_s.to_le_bytes());
                row.iter().for_each(|(_, value)| block.extend_from_slice(&value.to_le_bytes()));
            }
            let block = Bytes::from(block);
            contents.blocks.push_back((t_s, block.clone()));
            while contents.blocks.front().is_some_and(|(first_s, _)| *first_s < t_s - HISTORY_S || *first_s > t_s) {
                contents.blocks.pop_front();
            }
            // Without a page nobody receives.
            let _ = self.messages.send(block);
        }
    }
}

/// The line's view of the hub.
pub struct HubObserver(pub std::sync::Arc<Hub>);

impl LineObserver for HubObserver {
    fn rows(&mut self, rows: &[RowFrame]) {
        self.0.take_rows(rows);
    }

    fn state(&mut self, state: &DriveState) {
        self.0.contents().drive = state.clone();
    }
}
