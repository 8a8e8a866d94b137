//! The console's task: bytes to lines, lines to commands, commands to replies.
//!
//! Replies of one line are joined by `;`, as SCPI has it; a reply of many lines stands by itself. A command that is refused leaves the rest of
//! its line undone: what comes after may have relied on it. A line typed by hand (it ends with CR alone) has its errors shown at once, for there is
//! nobody to ask for them; a program's are kept until `SYSTem:ERRor?`.

use super::commands::{Answer, Job, List, execute, list_line};
use super::state::State;
use crate::board::{Clock, TICKS_PER_ROW};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::guard::CANCEL;
use crate::console::line::{BadLine, Lines, MOST_LINE};
use crate::console::parse::Commands;
use crate::console::text::Text;
use crate::settings::{Kept, Saved, Store, StoreError};
use crate::telemetry::frame::MOST_TEXT;
use crate::words::words;
use embedded_io_async::{Error, ErrorKind, Read};
use embedded_storage::nor_flash::NorFlash;

/// A line of a reply; in a stream it goes into one frame.
type Reply = Text<MOST_TEXT>;

/// Reads and answers, for ever.
pub async fn run<C: Clock, R: Read, F: NorFlash>(state: &State<'_>, clock: &C, mut receive: R, store: &mut Store<F>) -> ! {
    let mut lines = Lines::default();
    let mut bytes = [0; 64];
    loop {
        let count = match receive.read(&mut bytes).await {
            Ok(count) => count,
            // A break, a byte in pieces, bytes lost: what was begun is not whole. The pause lets others run if the line stays so.
            Err(error) => {
                lines.restart();
                if error.kind() == ErrorKind::Interrupted {
                    state.to_text();
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
                state.show_errors_at.set(None);
            }
            if *byte == CANCEL {
                // The guard in the interrupt has stopped the drive already.
                lines.restart();
                state.all_off();
                state.to_text();
                continue;
            }
            let mut copy = [0; MOST_LINE];
            let Some(line) = lines.push(*byte) else { continue };
            let (is_checked, by_hand) = (line.is_checked, line.by_hand);
            let text = copied(line.text, &mut copy);
            if is_checked {
                state.checked.set(Some(clock.now()));
            }
            match text {
                Ok(_) if !is_checked && !state.is_plain_allowed(clock.now()) => {
                    state.report(ErrorEntry::saying(Code::CHECKSUM, words!("no check, and a tool is on the line; Ctrl-X ends that")));
                }
                Ok(text) => {
                    state.heard.set(true);
                    obey(state, clock, text, store).await;
                }
                Err(bad) => state.report(bad_line(bad)),
            }
            if by_hand && state.error_count() > 0 {
                state.show_errors_at.set(Some(clock.now()));
            }
        }
    }
}

/// The line for as long as its commands take; the next may come in meanwhile.
fn copied<'c>(text: Result<&[u8], BadLine>, copy: &'c mut [u8; MOST_LINE]) -> Result<&'c [u8], BadLine> {
    let text = text?;
    let place = copy.get_mut(..text.len()).ok_or(BadLine::TooLong)?;
    place.copy_from_slice(text);
    Ok(place)
}

fn bad_line(bad: BadLine) -> ErrorEntry {
    match bad {
        BadLine::TooLong => ErrorEntry::saying(Code::TOO_MUCH_DATA, words!("a line has at most 200 bytes")),
        BadLine::NotText => ErrorEntry::saying(Code::INVALID_CHARACTER, words!("a line is printable ASCII; nothing of it was done")),
        BadLine::Check => ErrorEntry::saying(Code::CHECKSUM, words!("nothing of it was done; send it again")),
    }
}

/// Does all commands of a line.
async fn obey<C: Clock, F: NorFlash>(state: &State<'_>, clock: &C, line: &[u8], store: &mut Store<F>) {
    let mut reply = Reply::default();
    for command in Commands::new(line) {
        let mut said = Reply::default();
        let answer = execute(state, &command, &mut said.writer());
        let done = match answer {
            Ok(Answer::Done | Answer::Said) => Ok(()),
            Ok(Answer::List(list)) => {
                send(state, clock, &mut reply).await;
                send_list(state, clock, list).await;
                Ok(())
            }
            Ok(Answer::Job(job)) => {
                if matches!(job, Job::Wait | Job::WaitAndSay) {
                    // What was asked before is not held up by what runs.
                    wait(state, clock).await;
                }
                work(state, job, store, &mut said)
            }
            Err(wrong) => Err(wrong),
        };
        if !said.is_empty() && done.is_ok() {
            if reply.as_bytes().len() + 1 + said.as_bytes().len() > MOST_TEXT {
                send(state, clock, &mut reply).await;
            }
            let mut out = reply.writer();
            if out.length() > 0 {
                out.byte(b';');
            }
            out.bytes(said.as_bytes());
        }
        if let Err(wrong) = done {
            state.report(wrong);
            break;
        }
    }
    send(state, clock, &mut reply).await;
}

async fn send<C: Clock>(state: &State<'_>, clock: &C, reply: &mut Reply) {
    if !reply.is_empty() {
        state.out.line(clock, reply.as_str()).await;
        reply.clear();
    }
}

/// All lines of a list, then an empty one.
async fn send_list<C: Clock>(state: &State<'_>, clock: &C, list: List) {
    for line in 0.. {
        let mut text = Reply::default();
        let more = list_line(state, list, line, &mut text.writer());
        state.out.line(clock, text.as_str()).await;
        if more.is_none() {
            break;
        }
    }
}

/// Until nothing runs, or somebody stops it.
async fn wait<C: Clock>(state: &State<'_>, clock: &C) {
    while state.is_busy() {
        clock.until(clock.now() + TICKS_PER_ROW).await;
    }
}

fn work<F: NorFlash>(state: &State<'_>, job: Job, store: &mut Store<F>, said: &mut Reply) -> Result<(), ErrorEntry> {
    let failed = |why: StoreError| ErrorEntry::saying(Code::STORAGE, why.says());
    match job {
        Job::Wait => Ok(()),
        Job::WaitAndSay => {
            said.writer().byte(b'1');
            Ok(())
        }
        Job::Save => {
            super::commands::at_rest(state)?;
            store.save(&Saved { kept: state.kept.get(), observer: state.observer.numbers() }, Kept::layout()).map_err(failed)
        }
        Job::Load => {
            super::commands::at_rest(state)?;
            let saved: Option<Saved> = store.load(Kept::layout()).map_err(failed)?;
            state.observer.set(&saved.map_or_else(Default::default, |saved| saved.observer));
            state.tune(saved.map_or(state.defaults, |saved| saved.kept)).map_err(|wrong| super::commands::refused(&wrong))
        }
    }
}
