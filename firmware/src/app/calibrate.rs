//! The stand's own calibration as the console starts it: beside the rows that run for ever, with the sums in the app's memory.

use super::state::{Request, Running, State};
use crate::board::{Clock, TICKS_PER_ROW};
use crate::calibration::{Course, Found, Map, Measuring, Refused};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::status::OPERATION_COMPLETE;
use crate::console::text::Writer;
use crate::speed_loop::{Config, LessonWriter, Limits};
use crate::words::words;
use core::cell::Cell;

/// Waits for a calibration to be asked for, runs it, and learns what it found; for ever. It is also who hands the speed loop what was
/// learnt otherwise (`state.learn`).
pub async fn run<'a, C: Clock>(
    state: &State<'_>,
    clock: &C,
    map: &'a mut Map,
    measuring: &Cell<Option<Measuring<'a>>>,
    lessons: &mut LessonWriter<'_>,
) -> ! {
    let mut room = Some(map);
    loop {
        clock.until(clock.now() + TICKS_PER_ROW).await;
        if state.learn.take()
            && let Ok(config) = Config::new(&state.kept.get().settings, &state.hardware)
        {
            lessons.post(&config.learnt());
        }
        if state.calibrate.take()
            && let Some(map) = room.take()
        {
            let settings = state.kept.get().settings;
            let outcome = match Course::usual(&settings) {
                Ok(course) => {
                    measuring.set(Some(Measuring::new(course, map, &settings)));
                    state.request.set(Some(Request::Calibration(course)));
                    let over = turn(state, clock, measuring).await;
                    let sums = measuring.take();
                    state.calibration_from.set(None);
                    let outcome = match (over, &sums) {
                        (Ok(()), Some(sums)) => sums.answer(&settings, &state.hardware).await,
                        (Err(why), _) => Err(why),
                        (Ok(()), None) => Err(Refused::Aborted),
                    };
                    room = sums.map(Measuring::into_map);
                    outcome
                }
                Err(wrong) => {
                    room = Some(map);
                    state.running.set(Running::None);
                    Err(Refused::Settings(wrong))
                }
            };
            end(state, outcome);
        }
    }
}

/// Until the course is over.
async fn turn<C: Clock>(state: &State<'_>, clock: &C, measuring: &Cell<Option<Measuring<'_>>>) -> Result<(), Refused> {
    loop {
        clock.until(clock.now() + TICKS_PER_ROW).await;
        if let Some(why) = state.calibration.refused() {
            state.request.set(Some(Request::End));
            return Err(why);
        }
        let sums = measuring.take();
        let is_over = sums.as_ref().is_none_or(Measuring::is_over);
        measuring.set(sums);
        if is_over {
            return Ok(());
        }
    }
}

fn end(state: &State<'_>, outcome: Result<Found, Refused>) {
    match &outcome {
        Ok(found) => {
            let mut kept = state.kept.get();
            kept.settings.compensation = found.compensation;
            state.kept.set(kept);
            state.learn.set(true);
        }
        Err(why) => {
            let mut entry = ErrorEntry::new(Code::CALIBRATION);
            say(why, &mut entry.detail.writer());
            state.report(entry);
        }
    }
    state.calibrated.set(Some(outcome));
    state.calibrating.set(false);
    if state.completes.replace(false) {
        state.status.happened(OPERATION_COMPLETE);
    }
}

/// Why there is no answer, in words.
pub fn say(why: &Refused, out: &mut Writer<'_>) {
    match why {
        Refused::NoIndex => drop(out.words(words!("no index within a turn and a quarter; check its channel"))),
        Refused::Aborted => drop(out.words(words!("aborted; the compensation is as it was"))),
        Refused::Fault(fault) => drop(out.words(words!("the drive was switched off: ")).text(fault.name())),
        Refused::NotHeld(limits) => {
            out.words(words!("the rate was not held; limited by:"));
            for (bit, name) in Limits::NAMES.iter().enumerate() {
                if limits.contains(Limits(1 << bit)) {
                    out.byte(b' ').text(name);
                }
            }
        }
        Refused::NoCurrent => drop(out.words(words!("rows without a current"))),
        Refused::Settings(wrong) => super::commands::say_wrong(wrong, out),
    }
}
