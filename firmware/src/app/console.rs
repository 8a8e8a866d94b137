//! The task of the console: bytes to lines, lines to commands, commands to replies.
//!
//! The replies of one line are joined by `;`, as in SCPI; a list is a definite-length block (IEEE 488.2 §8.7.9) of lines. After a refused
//! command the rest of its line is not executed, because it may depend on that command. Errors of a line typed by hand (it ends with CR
//! alone) are shown at once; errors of a program are kept until `SYSTem:ERRor?`.

use super::commands::fault;
use super::commands::{Job, List, Outcome, SIGN_OF_LIFE, execute, is_sign_of_life, is_stop, list_line};
use super::out::LINE_END;
use super::state::State;
use crate::board::{Clock, TICKS_PER_ROW, TICKS_PER_S};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::guard::CANCEL;
use crate::console::line::{BadLine, Line, Lines, MAX_LINE};
use crate::console::parse::Commands;
use crate::settings::{Kept, Saved, Store};
use crate::speed_loop::Mode;
use crate::status::Fault;
use crate::telemetry::frame::MAX_TEXT;
use core::fmt::Write;
use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embedded_io_async::{Error, ErrorKind, Read};
use embedded_storage::nor_flash::NorFlash;
use heapless::{Deque, String};

/// A platform slower than this stands: in a stall of 0.5 s it turns by 0.25 rad, 796 counts of the default encoder, of which the counter
/// distinguishes ± 32 768. A million counts per turn would be 39 789: such an encoder needs a slower limit.
const MAX_REST_RATE_RAD_S: f64 = 0.5;
/// Interval over which its rate is measured, and longest wait for it, board clock steps.
const REST_INTERVAL: u64 = 10 * TICKS_PER_ROW;
const MAX_REST_WAIT: u64 = 3 * TICKS_PER_S;

/// Bytes read at once.
const CHUNK: usize = 64;
/// Bytes kept while the console waits for the end of an activity; at least two lines.
const KEPT: usize = 512;

/// A line of a reply; in a stream it fits into one frame.
type Reply = String<MAX_TEXT>;

/// Received bytes, kept while the console waits.
struct Input<R> {
    receive: R,
    bytes: Deque<u8, KEPT>,
    /// More came than can be kept; the rest of the line under way is left out.
    has_overrun: bool,
    skips_line: bool,
}

impl<R: Read> Input<R> {
    fn new(receive: R) -> Self {
        Self { receive, bytes: Deque::new(), has_overrun: false, skips_line: false }
    }

    /// The next byte.
    async fn next<C: Clock>(&mut self, clock: &C) -> Result<u8, ErrorKind> {
        loop {
            if let Some(byte) = self.bytes.pop_front() {
                return Ok(byte);
            }
            let mut bytes = [0; CHUNK];
            let count = self.receive.read(&mut bytes).await.map_err(|error| error.kind())?;
            for byte in bytes.iter().take(count) {
                self.keep(*byte);
            }
            if count == 0 {
                clock.until(clock.now() + TICKS_PER_ROW).await;
            }
        }
    }

    /// Keeps a byte; without room its line is left out. The stop byte leaves out what came before it. Returns whether the line is kept so
    /// far.
    #[inline(never)] // for the size of the image
    fn keep(&mut self, byte: u8) -> bool {
        if byte == CANCEL {
            self.bytes.clear();
            self.skips_line = false;
        }
        if !self.skips_line && self.bytes.push_back(byte).is_err() {
            self.drop_partial_line();
            (self.has_overrun, self.skips_line) = (true, true);
        }
        let is_kept = !self.skips_line;
        self.skips_line &= !is_line_end(byte);
        is_kept
    }

    /// Leaves out the last line, which is complete.
    fn drop_line(&mut self) {
        self.bytes.pop_back();
        self.drop_partial_line();
    }

    /// Whether another line end would make an empty line: no byte of the present line is kept, and none was left out.
    fn is_at_line_start(&self) -> bool {
        !self.skips_line && self.bytes.back().is_none_or(|byte| is_line_end(*byte))
    }

    /// Leaves out an incomplete line at the end.
    fn drop_partial_line(&mut self) {
        while self.bytes.back().is_some_and(|byte| !is_line_end(*byte)) {
            self.bytes.pop_back();
        }
    }
}

fn is_line_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

/// Reads lines and executes them, for ever.
pub async fn run<C: Clock, R: Read, F: NorFlash>(state: &State<'_>, clock: &C, receive: R, store: &mut Store<F>) -> ! {
    let mut lines = Lines::default();
    let mut input = Input::new(receive);
    loop {
        let byte = match input.next(clock).await {
            Ok(byte) => byte,
            // Break, framing error or overrun: the line is incomplete. The pause lets other tasks run if the error persists.
            Err(kind) => {
                lines.restart();
                if kind == ErrorKind::Interrupted {
                    state.set_text_mode();
                }
                clock.until(clock.now() + TICKS_PER_ROW).await;
                continue;
            }
        };
        if byte == b'\n' {
            state.status.show_errors_at.set(None);
        }
        if byte == CANCEL {
            // The guard in the interrupt has already stopped the drive.
            lines.restart();
            state.all_off();
            state.set_text_mode();
            continue;
        }
        let Some(line) = lines.push(byte) else { continue };
        if line.is_checked {
            state.supervision.checked_line_at.set(Some(clock.now()));
        }
        match line.text {
            Ok(_) if !is_allowed(state, clock, &line) => {
                let detail = "a program uses check sums on this line and this line has none; Ctrl-X ends that mode";
                state.report(ErrorEntry::with(Code::CHECKSUM, detail));
            }
            Ok(text) => execute_line(state, clock, text, store, &mut input).await,
            Err(bad) => state.report(bad_line(bad)),
        }
        if line.by_hand && state.status.error_count() > 0 {
            state.status.show_errors_at.set(Some(clock.now()));
        }
    }
}

fn is_allowed<C: Clock>(state: &State<'_>, clock: &C, line: &Line<'_>) -> bool {
    line.is_checked || state.is_unchecked_line_allowed(clock.now())
}

fn bad_line(bad: BadLine) -> ErrorEntry {
    match bad {
        BadLine::TooLong => {
            ErrorEntry::with(Code::TOO_MUCH_DATA, format_args!("a line has at most {MAX_LINE} bytes; the line was not executed"))
        }
        BadLine::NotText => ErrorEntry::with(Code::INVALID_CHARACTER, "a line is printable ASCII; the line was not executed"),
        BadLine::Check => ErrorEntry::with(Code::CHECKSUM, "the line was not executed; send it again"),
    }
}

/// Executes the commands of a line.
async fn execute_line<C: Clock, R: Read, F: NorFlash>(
    state: &State<'_>,
    clock: &C,
    line: &[u8],
    store: &mut Store<F>,
    input: &mut Input<R>,
) {
    let mut replies = Reply::new();
    for command in Commands::new(line) {
        let mut reply = Reply::new();
        let result = match execute(state, &command, &mut reply) {
            Ok(Outcome::Done) => Ok(()),
            Ok(Outcome::List(List::Errors)) => add_errors(state, clock, &mut replies, &mut reply).await,
            Ok(Outcome::List(list)) => add_block(state, clock, &mut replies, &mut reply, list).await,
            Ok(Outcome::Job(job)) => match job {
                Job::Wait | Job::WaitAndReply => {
                    wait(state, clock, input).await;
                    work(state, job, store, &mut reply)
                }
                Job::Save => wait_for_rest(state, clock).await.and_then(|()| work(state, job, store, &mut reply)),
                Job::Load => work(state, job, store, &mut reply),
                Job::ClearFault => {
                    clear_fault(state, clock).await;
                    Ok(())
                }
            },
            Err(error) => Err(error),
        };
        if result.is_ok() && !reply.is_empty() {
            let separator = if replies.is_empty() { "" } else { ";" };
            add(state, clock, &mut replies, separator, &reply).await;
        }
        match result {
            Ok(()) if is_sign_of_life(&command) => state.supervision.host_heard.set(true),
            Ok(()) => {}
            Err(error) => {
                state.report(error);
                break;
            }
        }
    }
    if !replies.is_empty() {
        send(state, clock, &mut replies, LINE_END).await;
    }
}

/// Sends what was collected of a reply, with `end` behind it.
async fn send<C: Clock>(state: &State<'_>, clock: &C, replies: &mut Reply, end: &str) {
    state.out.text(clock, replies, end).await;
    replies.clear();
}

/// Adds a text to the reply; sends what there is so far if there is no room for both.
async fn add<C: Clock>(state: &State<'_>, clock: &C, replies: &mut Reply, separator: &str, text: &str) {
    if replies.len() + separator.len() + text.len() > MAX_TEXT {
        send(state, clock, replies, separator).await;
    } else {
        _ = replies.push_str(separator);
    }
    _ = replies.push_str(text);
}

/// Adds all errors of the queue, with commas between them, to the reply. `text` is used for one at a time and left empty.
async fn add_errors<C: Clock>(state: &State<'_>, clock: &C, replies: &mut Reply, text: &mut Reply) -> Result<(), ErrorEntry> {
    let mut separator = if replies.is_empty() { "" } else { ";" };
    for line in 0.. {
        text.clear();
        if !list_line(state, List::Errors, line, text)? {
            break;
        }
        add(state, clock, replies, separator, text).await;
        separator = ",";
    }
    text.clear();
    Ok(())
}

/// Adds a list as a definite-length block to the reply: `#`, the number of digits of the length, the length, and the lines with CR LF
/// between them. `text` is used for one line at a time and left empty.
async fn add_block<C: Clock>(state: &State<'_>, clock: &C, replies: &mut Reply, text: &mut Reply, list: List) -> Result<(), ErrorEntry> {
    let mut length = 0_usize;
    for line in 0.. {
        text.clear();
        if !list_line(state, list, line, text)? {
            break;
        }
        length += text.len() + if line > 0 { LINE_END.len() } else { 0 };
        // The rows are not kept waiting until all is counted.
        yield_now().await;
    }
    let (mut digits, mut power) = (1, 10);
    while length >= power {
        (digits, power) = (digits + 1, power.saturating_mul(10));
    }
    let separator = if replies.is_empty() { "" } else { ";" };
    text.clear();
    write!(text, "#{digits}{length}")?;
    add(state, clock, replies, separator, text).await;
    let mut left = length;
    for line in 0.. {
        text.clear();
        let end = if line > 0 { LINE_END.len() } else { 0 };
        // An activity may have changed the list since it was counted: the block has the length that it stated.
        if !list_line(state, list, line, text)? || text.len() + end > left {
            break;
        }
        if line > 0 {
            send(state, clock, replies, LINE_END).await;
        }
        add(state, clock, replies, "", text).await;
        left -= text.len() + end;
    }
    for _ in 0..left {
        add(state, clock, replies, "", " ").await;
    }
    text.clear();
    Ok(())
}

/// Waits until no activity runs. Lines that come meanwhile are executed afterwards, in order; their commands that stop act at once, too.
/// Lines that only give a sign of life are not kept: a program may wait for hours.
async fn wait<C: Clock, R: Read>(state: &State<'_>, clock: &C, input: &mut Input<R>) {
    let mut lines = Lines::default();
    // Whether the byte ends a line that has been dealt with: it gives signs of life only.
    let look_at = |lines: &mut Lines, byte: u8| {
        if let Some(line) = lines.push(byte)
            && let Ok(text) = line.text
            && is_allowed(state, clock, &line)
        {
            if line.is_checked {
                state.supervision.checked_line_at.set(Some(clock.now()));
            }
            stop_by(state, text);
            return Commands::new(text).all(|command| command.is(SIGN_OF_LIFE) && !command.is_query);
        }
        false
    };
    for byte in &input.bytes {
        look_at(&mut lines, *byte);
    }
    while state.is_busy() {
        let mut bytes = [0; CHUNK];
        match select(input.receive.read(&mut bytes), clock.until(clock.now() + TICKS_PER_ROW)).await {
            Either::First(Ok(count)) => {
                if count == 0 {
                    clock.until(clock.now() + TICKS_PER_ROW).await;
                }
                for byte in bytes.iter().take(count) {
                    let is_done = look_at(&mut lines, *byte);
                    if is_line_end(*byte) && input.is_at_line_start() {
                        continue;
                    }
                    if input.keep(*byte) && is_done {
                        input.drop_line();
                    }
                }
            }
            Either::First(Err(error)) => {
                lines.restart();
                input.drop_partial_line();
                if error.kind() == ErrorKind::Interrupted {
                    state.set_text_mode();
                }
                clock.until(clock.now() + TICKS_PER_ROW).await;
            }
            Either::Second(()) => {}
        }
    }
    if core::mem::take(&mut input.has_overrun) {
        state.report(ErrorEntry::with(Code::INPUT_OVERRUN, format_args!("more than {KEPT} bytes came while *OPC? or *WAI waited")));
    }
}

/// Executes the commands of a line that stop, and takes its signs of life.
#[inline(never)] // for the size of the image
fn stop_by(state: &State<'_>, line: &[u8]) {
    for command in Commands::new(line) {
        if is_stop(&command) {
            // Its errors are reported when the line is executed in its turn.
            _ = execute(state, &command, &mut Reply::new());
        }
        if is_sign_of_life(&command) {
            state.supervision.host_heard.set(true);
        }
    }
}

/// Waits until the bridge brakes and the platform stands: an erase of the flash stalls the core for up to 0.5 s (DS10693, table 48), in
/// which no tick holds the drive and the encoder's counter of 16 bits may advance by half a wrap at most.
///
/// # Errors
/// The drive is on, a measurement of the drift runs, or the platform still turns after three seconds.
async fn wait_for_rest<C: Clock>(state: &State<'_>, clock: &C) -> Result<(), ErrorEntry> {
    let begun = clock.now();
    loop {
        let before = state.measured.row.get();
        clock.until(clock.now() + REST_INTERVAL).await;
        // After the wait, in which another task may have switched the drive on; the caller erases without a suspension.
        state.require_at_rest()?;
        let row = state.measured.row.get();
        let is_off = row.mode == Mode::Off || row.fault != Fault::None;
        let seconds = (row.at - before.at) as f64 / TICKS_PER_S as f64;
        if is_off && seconds > 0.0 && (row.theta_rad - before.theta_rad).abs() < MAX_REST_RATE_RAD_S * seconds {
            return Ok(());
        }
        if clock.now() - begun > MAX_REST_WAIT {
            return Err(ErrorEntry::with(Code::SETTINGS_CONFLICT, "the platform still turns: wait until it stands"));
        }
    }
}

/// Time in which the control interrupt clears a fault and reports it, rows: the next command, the next report and the next row take three;
/// rows may wait behind replies.
const CLEAR_TIMEOUT_ROWS: u64 = 8;

/// Clears the latched fault and waits until the rows show it, so that the next command of the line may start something. A fault whose cause
/// is present stays.
async fn clear_fault<C: Clock>(state: &State<'_>, clock: &C) {
    fault::clear(state);
    let from = clock.now();
    while state.measured.row.get().fault != Fault::None && clock.now() - from < CLEAR_TIMEOUT_ROWS * TICKS_PER_ROW {
        clock.until(clock.now() + TICKS_PER_ROW).await;
    }
}

fn work<F: NorFlash>(state: &State<'_>, job: Job, store: &mut Store<F>, reply: &mut Reply) -> Result<(), ErrorEntry> {
    let storage_error = |error| ErrorEntry::with(Code::STORAGE, error);
    match job {
        Job::Wait => {}
        Job::WaitAndReply => reply.push('1').map_err(|_| ErrorEntry::new(Code::TOO_MUCH_DATA))?,
        Job::Save => {
            let saved = Saved { kept: state.settings.kept.get(), observer: state.gyro.observer.parameters() };
            store.save(&saved, Kept::layout()).map_err(storage_error)?;
        }
        Job::ClearFault => {} // done by [`clear_fault`]
        Job::Load => {
            state.require_at_rest()?;
            let saved: Option<Saved> = store.load(Kept::layout()).map_err(storage_error)?;
            state.gyro.observer.set_parameters(&saved.map(|saved| saved.observer).unwrap_or_default());
            let kept = saved.map_or(state.settings.defaults, |saved| saved.kept);
            state.apply(kept).map_err(|error| ErrorEntry::with(Code::SETTING, error))?;
        }
    }
    Ok(())
}
