//! The serial line of the panel, owned by one thread.
//!
//! The thread sends 0x18 before anything that waits, gives signs of life only while [`Control`] allows it, and stops the drive itself when
//! the lease expires: no other thread is needed for a stop. In: lines to send, each answered once; a request to stop. Out: replies, rows of
//! the stream in blocks, the state of the drive.
//!
//! Latency: the thread waits for bytes for at most [`READ_WAIT`], and one exchange at a time is on the wire, so a stop waits for no queue.

use std::collections::VecDeque;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, Receiver as Queue, Sender, SyncSender, TryRecvError};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::{Duration, Instant};

use stand_firmware::app::commands::SIGN_OF_LIFE;
use stand_firmware::telemetry::RowFrame;

use super::control::{ClientId, Control, ControlError};
use super::lock::locked;
use super::stage::StopReason;
use stand_acquire::link::{
    END_QUERY, Exchange, ExchangeStep, LineLosses, LinkError, MAX_ATTEMPTS, MAX_LINE, Port, REPLY_TIMEOUT, Received, Receiver, Reply,
    SerialLink, drives, with_checksum,
};

/// Longest wait for bytes; bounds the time between a request to stop and its byte.
const READ_WAIT: Duration = Duration::from_millis(2);
/// Interval of the signs of life; the stand waits for [`HOST_ARM_S`].
const FEED_INTERVAL: Duration = Duration::from_millis(120);
/// Silence after which the firmware switches the drive off while the panel drives, s.
const HOST_ARM_S: f64 = 0.5;
/// Interval of the empty lines that keep a stream alive without being signs of life.
const STREAM_INTERVAL: Duration = Duration::from_secs(1);
/// Interval of the query of the drive's state.
const POLL_INTERVAL: Duration = Duration::from_millis(400);
/// Rows are passed on in blocks of this duration.
const BLOCK_INTERVAL: Duration = Duration::from_millis(40);
/// State of the drive: output, latched fault, limits in force.
const POLL_QUERY: &str = "OUTPut?;:SOURce:MODE?;:FAULt:LIMits?;:FAULt?";

/// Why a line has no reply.
#[derive(Debug, Clone, thiserror::Error)]
pub enum LineError {
    /// A stop discarded it.
    #[error("stopped")]
    Stopped,
    /// The client may not drive.
    #[error(transparent)]
    Control(#[from] ControlError),
    /// The line is down.
    #[error("{0}")]
    Down(String),
}

/// State of the drive, as last reported.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct DriveState {
    /// The drive is on.
    pub is_on: bool,
    /// Control mode.
    pub mode: String,
    /// Limits in force.
    pub limits: String,
    /// Latched fault: `number,name,advice`; empty: none.
    pub fault: String,
    /// Why the line is down; empty: it is up.
    pub line_error: String,
    /// Why the panel stopped the drive last; `None`: it did not.
    pub stopped_because: Option<StopReason>,
}

/// Receives what arrives: rows, and the state of the drive after each change.
pub trait LineObserver: Send {
    /// Rows of the stream, in order.
    fn rows(&mut self, rows: &[RowFrame]);
    /// A changed state.
    fn state(&mut self, state: &DriveState);
}

/// A line to send.
struct Request {
    /// The page that has to drive if the line has a command of a program that drives; `None`: the panel itself, which then restores
    /// settings.
    client: Option<ClientId>,
    line: String,
    timeout: Duration,
    reply: SyncSender<Result<Reply, LineError>>,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    ends: AtomicBool,
    stops: AtomicU64,
    reason: Mutex<Option<StopReason>>,
    control: Mutex<Control>,
    losses: Mutex<LineLosses>,
    taps: Mutex<Vec<Sender<RowFrame>>>,
}

/// The line, for all other threads.
#[derive(Debug, Clone)]
pub struct Line {
    shared: Arc<Shared>,
    requests: Sender<Request>,
    name: Arc<str>,
}

impl std::fmt::Debug for Request {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Request").field("line", &self.line).finish_non_exhaustive()
    }
}

impl Line {
    /// Opens the port, identifies the stand and starts the thread; it ends when `ends` is called.
    ///
    /// # Errors
    /// The port does not exist, is in use, or has no stand behind it.
    pub fn open(path: &Path, observer: Box<dyn LineObserver>) -> Result<(Line, std::thread::JoinHandle<()>), LinkError> {
        // A SerialLink gives signs of life by itself, so it only identifies the stand.
        let name = SerialLink::open(path)?.name();
        let port = Port::open(path)?;
        let shared = Arc::new(Shared::default());
        let (requests, queue) = mpsc::channel();
        let line = Line { shared: shared.clone(), requests, name: name.into() };
        let mut owner = Owner::new(port, shared, queue, observer);
        let thread = std::thread::Builder::new().name("line".to_owned()).spawn(move || owner.run());
        let thread = thread.map_err(|source| LinkError::Other { port: line.name.to_string(), source })?;
        Ok((line, thread))
    }

    /// Name of the port.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Puts 0x18 on the wire ahead of all waiting lines, and revokes the control. `reason` is shown.
    pub fn stop(&self, reason: StopReason) {
        *locked(&self.shared.reason) = Some(reason);
        locked(&self.shared.control).revoke();
        self.shared.stop.store(true, Ordering::SeqCst);
    }

    /// Number of stops so far: a job that sees another number has been stopped.
    pub fn stops(&self) -> u64 {
        self.shared.stops.load(Ordering::SeqCst)
    }

    /// The control; held only for the moment of a change.
    pub fn control(&self) -> MutexGuard<'_, Control> {
        locked(&self.shared.control)
    }

    /// Sends a line for `client` and waits for its reply.
    ///
    /// # Errors
    /// The line is down, the client may not drive, or a stop discarded the line.
    pub fn exchange(&self, client: ClientId, line: &str, timeout: Duration) -> Result<Reply, LineError> {
        self.request(Some(client), line, timeout)
    }

    /// Sends a line that sets nothing in motion for the panel itself, without the control: settings are restored after a stop.
    ///
    /// # Errors
    /// The line is down, or a stop discarded the line.
    pub fn restore(&self, line: &str, timeout: Duration) -> Result<Reply, LineError> {
        self.request(None, line, timeout)
    }

    fn request(&self, client: Option<ClientId>, line: &str, timeout: Duration) -> Result<Reply, LineError> {
        let down = || LineError::Down("the line to the stand is closed".to_owned());
        let (reply, answer) = mpsc::sync_channel(1);
        self.requests.send(Request { client, line: line.to_owned(), timeout, reply }).map_err(|_| down())?;
        answer.recv().unwrap_or_else(|_| Err(down()))
    }

    /// All rows from now on. The queue grows without a limit, so that a slow disk loses no row.
    pub fn tap(&self) -> Queue<RowFrame> {
        let (rows, tap) = mpsc::channel();
        locked(&self.shared.taps).push(rows);
        tap
    }

    /// Losses on the line.
    pub fn losses(&self) -> LineLosses {
        *locked(&self.shared.losses)
    }

    /// Stops the drive if it may be on, and ends the thread.
    pub fn close(&self) {
        self.shared.ends.store(true, Ordering::SeqCst);
    }
}

/// An exchange on the wire.
struct Current {
    request: Request,
    exchange: Exchange,
    attempts: u32,
    deadline: Instant,
}

/// The thread.
struct Owner {
    port: Port,
    shared: Arc<Shared>,
    queue: Queue<Request>,
    observer: Box<dyn LineObserver>,
    receiver: Receiver,
    received: VecDeque<Received>,
    rows: Vec<RowFrame>,
    current: Option<Current>,
    /// The poll on the wire, and whether a command of a program that drives has been sent after it.
    poll: Option<(Exchange, Instant)>,
    driven_since_poll: bool,
    /// The firmware supervises the host with [`HOST_ARM_S`].
    is_host_armed: bool,
    fed_at: Instant,
    stream_kept_at: Instant,
    polled_at: Instant,
    passed_on_at: Instant,
    state: DriveState,
}

impl Owner {
    fn new(port: Port, shared: Arc<Shared>, queue: Queue<Request>, observer: Box<dyn LineObserver>) -> Self {
        let now = Instant::now();
        Owner {
            port,
            shared,
            queue,
            observer,
            receiver: Receiver::default(),
            received: VecDeque::new(),
            rows: Vec::new(),
            current: None,
            poll: None,
            driven_since_poll: false,
            is_host_armed: false,
            fed_at: now,
            stream_kept_at: now,
            polled_at: now,
            passed_on_at: now,
            state: DriveState::default(),
        }
    }

    fn run(&mut self) {
        while !self.shared.ends.load(Ordering::SeqCst) {
            if let Err(error) = self.turn() {
                let message = error.to_string();
                self.change(|state| state.line_error = message.clone());
                locked(&self.shared.control).revoke();
                self.refuse_until_the_end(&LineError::Down(message));
                return;
            }
        }
        if locked(&self.shared.control).is_armed() || self.state.is_on {
            let _ = self.port.write(&[0x18]);
        }
        let _ = self.port.write(with_checksum("HOST:RELease").as_bytes());
    }

    /// One turn of the loop. The stop comes first.
    fn turn(&mut self) -> Result<(), LinkError> {
        let now = Instant::now();
        if locked(&self.shared.control).expire(now) {
            *locked(&self.shared.reason) = Some(StopReason::Silent);
            self.shared.stop.store(true, Ordering::SeqCst);
        }
        if self.shared.stop.swap(false, Ordering::SeqCst) {
            self.stop()?;
        }
        self.feed(now)?;
        self.begin(now)?;
        let mut buffer = [0; 4096];
        let count = self.port.read(&mut buffer, READ_WAIT)?;
        let is_readable = self.receiver.take(&buffer[..count], &mut self.received);
        self.take_received()?;
        is_readable.map_err(|other| other.at(self.port.path().display().to_string()))?;
        self.end_overdue(Instant::now());
        if self.passed_on_at.elapsed() >= BLOCK_INTERVAL {
            self.passed_on_at = Instant::now();
            *locked(&self.shared.losses) = self.receiver.losses();
            if !self.rows.is_empty() {
                self.observer.rows(&self.rows);
                self.rows.clear();
            }
        }
        Ok(())
    }

    /// Sends 0x18 and discards everything that waits.
    fn stop(&mut self) -> Result<(), LinkError> {
        self.port.write(&[0x18])?;
        self.shared.stops.fetch_add(1, Ordering::SeqCst);
        let waiting = self.current.take().map(|current| current.request).into_iter();
        for request in waiting.chain(std::iter::from_fn(|| self.queue.try_recv().ok())) {
            let _ = request.reply.send(Err(LineError::Stopped));
        }
        self.poll = None;
        self.driven_since_poll = true;
        self.polled_at = Instant::now() - POLL_INTERVAL;
        let reason = *locked(&self.shared.reason);
        self.change(|state| state.stopped_because = reason);
        Ok(())
    }

    fn send(&mut self, line: &str) -> Result<(), LinkError> {
        self.port.write(with_checksum(line).as_bytes())
    }

    /// Signs of life while the lease holds; empty lines for the stream, which are none.
    fn feed(&mut self, now: Instant) -> Result<(), LinkError> {
        let feeds = locked(&self.shared.control).feeds(now);
        if feeds && now.duration_since(self.fed_at) >= FEED_INTERVAL {
            self.fed_at = now;
            self.send(SIGN_OF_LIFE)?;
        }
        if self.receiver.is_streaming() && now.duration_since(self.stream_kept_at) >= STREAM_INTERVAL {
            self.stream_kept_at = now;
            self.send("")?;
        }
        Ok(())
    }

    /// Begins the next exchange, or the query of the state when it is due.
    fn begin(&mut self, now: Instant) -> Result<(), LinkError> {
        if self.current.is_some() || self.poll.is_some() {
            return Ok(());
        }
        if now.duration_since(self.polled_at) >= POLL_INTERVAL {
            self.polled_at = now;
            self.driven_since_poll = false;
            self.poll = Some((Exchange::default(), now + REPLY_TIMEOUT));
            self.send(POLL_QUERY)?;
            return self.send(END_QUERY);
        }
        let mut request = match self.queue.try_recv() {
            Ok(request) => request,
            Err(TryRecvError::Empty) => return Ok(()),
            Err(TryRecvError::Disconnected) => {
                self.shared.ends.store(true, Ordering::SeqCst);
                return Ok(());
            }
        };
        let arming = format!("HOST:ARM {HOST_ARM_S};:");
        if with_checksum(&request.line).len() + arming.len() > MAX_LINE {
            let message = format!("the line is too long: the stand accepts {} characters", MAX_LINE - 10 - arming.len());
            let _ = request.reply.send(Err(LineError::Down(message)));
            return Ok(());
        }
        if let Some(client) = request.client
            && drives(&request.line)
        {
            // One lock for check and arming: a lease that expires in between would leave the drive unsupervised.
            let checked = {
                let mut control = locked(&self.shared.control);
                control.check(client, now).map(|()| control.arm())
            };
            if let Err(error) = checked {
                let _ = request.reply.send(Err(error.into()));
                return Ok(());
            }
            self.driven_since_poll = true;
            // In the same line: a damaged one is repeated as a whole.
            if !std::mem::replace(&mut self.is_host_armed, true) {
                request.line.insert_str(0, &arming);
            }
            self.fed_at = now;
        }
        self.send(&request.line)?;
        self.send(END_QUERY)?;
        self.current = Some(Current { deadline: now + request.timeout, request, exchange: Exchange::default(), attempts: 1 });
        Ok(())
    }

    fn take_received(&mut self) -> Result<(), LinkError> {
        while let Some(received) = self.received.pop_front() {
            match received {
                Received::Row(row) => {
                    locked(&self.shared.taps).retain(|tap| tap.send(row).is_ok());
                    self.rows.push(row);
                }
                Received::Line(line) => self.take_line(line)?,
                Received::StreamHeader(_) | Received::Beat(_) => {}
            }
        }
        Ok(())
    }

    fn take_line(&mut self, line: String) -> Result<(), LinkError> {
        if let Some((exchange, _)) = &mut self.poll {
            match exchange.take(line) {
                ExchangeStep::NextLine => {}
                ExchangeStep::AskAgain => self.send(END_QUERY)?,
                ExchangeStep::Complete => {
                    let reply = self.poll.take().map(|(exchange, _)| exchange.reply).unwrap_or_default();
                    self.take_state(&reply)?;
                }
            }
            return Ok(());
        }
        let Some(current) = &mut self.current else { return Ok(()) };
        match current.exchange.take(line) {
            ExchangeStep::NextLine => {}
            ExchangeStep::AskAgain => self.send(END_QUERY)?,
            ExchangeStep::Complete if current.exchange.reply.is_damaged() && current.attempts < MAX_ATTEMPTS => {
                current.attempts += 1;
                current.exchange = Exchange::default();
                let line = current.request.line.clone();
                self.send(&line)?;
                self.send(END_QUERY)?;
            }
            ExchangeStep::Complete => {
                if let Some(current) = self.current.take() {
                    let _ = current.request.reply.send(Ok(current.exchange.reply));
                }
            }
        }
        Ok(())
    }

    /// The reply to [`POLL_QUERY`].
    fn take_state(&mut self, reply: &Reply) -> Result<(), LinkError> {
        let Some(line) = reply.lines.last() else { return Ok(()) };
        let mut parts = line.splitn(4, ';').map(str::to_owned);
        let (Some(output), Some(mode), Some(limits), Some(fault)) = (parts.next(), parts.next(), parts.next(), parts.next()) else {
            return Ok(());
        };
        let is_on = output != "0";
        // Armed by a command after the query: its effect is not in the reply yet.
        if !is_on && !self.driven_since_poll {
            locked(&self.shared.control).disarm();
            if std::mem::take(&mut self.is_host_armed) {
                self.send("HOST:ARM 0")?;
            }
        }
        self.change(|state| {
            (state.is_on, state.mode, state.limits) = (is_on, mode, limits);
            state.line_error.clear();
            state.fault = if fault.starts_with("0,") { String::new() } else { fault };
            // The next fault may have another cause.
            state.stopped_because = state.stopped_because.filter(|_| !state.fault.is_empty());
        });
        Ok(())
    }

    /// Ends exchanges without a reply in time.
    fn end_overdue(&mut self, now: Instant) {
        if self.poll.as_ref().is_some_and(|(_, deadline)| now > *deadline) {
            self.poll = None;
            self.change(|state| state.line_error = "the stand does not reply".to_owned());
        }
        if self.current.as_ref().is_some_and(|current| now > current.deadline)
            && let Some(current) = self.current.take()
        {
            let message = format!("no reply to `{}`", current.request.line);
            let _ = current.request.reply.send(Err(LineError::Down(message)));
        }
    }

    fn change(&mut self, change: impl FnOnce(&mut DriveState)) {
        let before = self.state.clone();
        change(&mut self.state);
        if self.state != before {
            self.observer.state(&self.state);
        }
    }

    /// After the line has broken: every request gets the reason.
    fn refuse_until_the_end(&mut self, error: &LineError) {
        locked(&self.shared.taps).clear();
        if let Some(current) = self.current.take() {
            let _ = current.request.reply.send(Err(error.clone()));
        }
        while !self.shared.ends.load(Ordering::SeqCst) {
            if let Ok(request) = self.queue.recv_timeout(Duration::from_millis(100)) {
                let _ = request.reply.send(Err(error.clone()));
            }
        }
    }
}
