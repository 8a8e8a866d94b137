//! The task of the console: bytes to lines, lines to commands, commands to replies.
//!
//! The replies of one line are joined by `;`, as in SCPI; a list has lines of its own. After a refused command the rest of its line is not
//! executed, because it may depend on that command. Errors of a line typed by hand (it ends with CR alone) are shown at once; errors of a
//! program are kept until `SYSTem:ERRor?`.

use super::commands::fault;
use super::commands::{Job, List, Outcome, execute, list_line};
use super::state::State;
use crate::board::{Clock, TICKS_PER_ROW, TICKS_PER_S};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::guard::CANCEL;
use crate::console::line::{BadLine, Lines, MAX_LINE};
use crate::console::parse::Commands;
use crate::settings::{Kept, Saved, Store};
use crate::speed_loop::Mode;
use crate::status::Fault;
use crate::telemetry::frame::MAX_TEXT;
use embedded_io_async::{Error, ErrorKind, Read};
use embedded_storage::nor_flash::NorFlash;
use heapless::String;

/// A platform slower than this stands: in a stall of 0.5 s it turns by less than the encoder's counter resolves, a tenth of its half wrap.
const MAX_REST_RATE_RAD_S: f64 = 0.5;
/// Interval over which its rate is measured, and longest wait for it, board clock steps.
const REST_INTERVAL: u64 = 10 * TICKS_PER_ROW;
const MAX_REST_WAIT: u64 = 3 * TICKS_PER_S;

/// A line of a reply; in a stream it fits into one frame.
type Reply = String<MAX_TEXT>;

/// Reads lines and executes them, for ever.
pub async fn run<C: Clock, R: Read, F: NorFlash>(state: &State<'_>, clock: &C, mut receive: R, store: &mut Store<F>) -> ! {
    let mut lines = Lines::default();
    let mut bytes = [0; 64];
    loop {
        let count = match receive.read(&mut bytes).await {
            Ok(count) => count,
            // Break, framing error or overrun: the line is incomplete. The pause lets other tasks run if the error persists.
            Err(error) => {
                lines.restart();
                if error.kind() == ErrorKind::Interrupted {
                    state.set_text_mode();
                }
                clock.until(clock.now() + TICKS_PER_ROW).await;
                continue;
            }
        };
        if count == 0 {
            clock.until(clock.now() + TICKS_PER_ROW).await;
        }
        for byte in bytes.get(..count).unwrap_or_default() {
            if *byte == b'\n' {
                state.status.show_errors_at.set(None);
            }
            if *byte == CANCEL {
                // The guard in the interrupt has already stopped the drive.
                lines.restart();
                state.all_off();
                state.set_text_mode();
                continue;
            }
            let Some(line) = lines.push(*byte) else { continue };
            if line.is_checked {
                state.supervision.checked_line_at.set(Some(clock.now()));
            }
            match line.text {
                Ok(_) if !line.is_checked && !state.is_unchecked_line_allowed(clock.now()) => {
                    let detail = "a program uses check sums on this line and this line has none; Ctrl-X ends that mode";
                    state.report(ErrorEntry::with(Code::CHECKSUM, detail));
                }
                Ok(text) => {
                    state.supervision.host_heard.set(true);
                    execute_line(state, clock, text, store).await;
                }
                Err(bad) => state.report(bad_line(bad)),
            }
            if line.by_hand && state.status.error_count() > 0 {
                state.status.show_errors_at.set(Some(clock.now()));
            }
        }
    }
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
async fn execute_line<C: Clock, F: NorFlash>(state: &State<'_>, clock: &C, line: &[u8], store: &mut Store<F>) {
    let mut replies = Reply::new();
    for command in Commands::new(line) {
        let mut reply = Reply::new();
        let result = match execute(state, &command, &mut reply) {
            Ok(Outcome::Done) => Ok(()),
            Ok(Outcome::List(list)) => {
                send(state, clock, &mut replies).await;
                send_list(state, clock, list).await
            }
            Ok(Outcome::Job(job)) => match job {
                Job::Wait | Job::WaitAndReply => {
                    wait(state, clock).await;
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
            if replies.len() + 1 + reply.len() > MAX_TEXT {
                send(state, clock, &mut replies).await;
            }
            // There is room for both.
            _ = if replies.is_empty() { Ok(()) } else { replies.push(';') };
            _ = replies.push_str(&reply);
        }
        if let Err(error) = result {
            state.report(error);
            break;
        }
    }
    send(state, clock, &mut replies).await;
}

async fn send<C: Clock>(state: &State<'_>, clock: &C, replies: &mut Reply) {
    if !replies.is_empty() {
        state.out.line(clock, replies).await;
        replies.clear();
    }
}

/// Sends all lines of a list, then an empty one.
async fn send_list<C: Clock>(state: &State<'_>, clock: &C, list: List) -> Result<(), ErrorEntry> {
    for line in 0.. {
        let mut text = Reply::new();
        let is_written = list_line(state, list, line, &mut text)?;
        state.out.line(clock, &text).await;
        if !is_written {
            break;
        }
    }
    Ok(())
}

/// Waits until no activity runs.
async fn wait<C: Clock>(state: &State<'_>, clock: &C) {
    while state.is_busy() {
        clock.until(clock.now() + TICKS_PER_ROW).await;
    }
}

/// Waits until the bridge brakes and the platform stands: an erase of the flash stalls the core for up to 0.5 s (DS10693, table 48), in which no
/// tick holds the drive and the encoder's counter of 16 bits may advance by half a wrap at most.
///
/// # Errors
/// The drive is on, or the platform still turns after three seconds.
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

/// Time in which the control interrupt clears a fault and reports it, rows: the next command, the next report and the next row take three.
const CLEAR_TIMEOUT_ROWS: u64 = 8;

/// Clears the latched fault and waits until the rows show it, so that the next command of the line may start something. A fault whose cause is present
/// stays.
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
        Job::ClearFault => {} // [`clear_fault`] waits for the control interrupt
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
