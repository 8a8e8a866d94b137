//! Hands what is asked for to the speed loop, millisecond by millisecond, always one ahead, for ever.
//!
//! At t_k it posts the segment of [t_{k+1}, t_{k+2}): of the profile that runs, or of the value that is held. In voltage mode a value holds for
//! its millisecond; in rate mode the command goes straight from one value to the next. A profile that is over leaves the drive off. Every
//! order carries what clears a fault and what trips one, so that both are with the loop within two milliseconds.

use super::state::{Demand, Request, Running, State};
use crate::board::{CONTROL_PER_ROW, Clock, Hardware, TICKS_PER_CONTROL, TICKS_PER_ROW, Ticks};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::status::OPERATION_COMPLETE;
use crate::profile::Profile;
use crate::speed_loop::{Mode, Order, OrderWriter, Segment, Zero};

/// What is under way.
struct Course {
    profile: Profile,
    mode: Mode,
    rows: u64,
}

/// Runs for ever; its first segment acts at `start`, a whole millisecond that is at least one ahead.
pub async fn run<C: Clock>(state: &State<'_>, clock: &C, orders: &mut OrderWriter<'_>, start: Ticks) -> ! {
    let mut tick = start.0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
    let mut at = Ticks(start.0.saturating_sub(TICKS_PER_ROW));
    let mut course: Option<Course> = None;
    let mut value = 0.0;
    loop {
        clock.until(at).await;
        if let Some(request) = state.request.take() {
            let acts = at + TICKS_PER_ROW;
            course = begin(state, request, acts);
            if let Some(course) = &mut course {
                value = course.profile.next_value();
            } else {
                end(state);
            }
        }
        let (mode, from, to) = match &mut course {
            Some(course) => (course.mode, value, course.profile.next_value()),
            None => match state.demand.get() {
                Demand::Off => (Mode::Off, 0.0, 0.0),
                Demand::Hold(mode, value) => (mode, value, value),
            },
        };
        value = to;
        orders.post(&Order {
            segment: segment(&state.hardware, state.zero.get(), mode, tick, from, to),
            clear: state.clear.get(),
            trip: state.trip.get(),
        });
        if let Some(running) = &mut course {
            running.rows = running.rows.saturating_sub(1);
            if running.rows == 0 {
                course = None;
                state.demand.set(Demand::Off);
                end(state);
            }
        }
        tick = tick.saturating_add(CONTROL_PER_ROW);
        at = at + TICKS_PER_ROW;
    }
}

fn begin(state: &State<'_>, request: Request, acts: Ticks) -> Option<Course> {
    match request {
        Request::End => None,
        Request::Profile(config, mode, rows) => match Profile::for_mode(&config, mode) {
            Ok(profile) => {
                state.running.set(Running::Profile);
                Some(Course { profile, mode, rows })
            }
            // It was checked before it was asked for.
            Err(wrong) => {
                state.report(ErrorEntry::about(Code::SETTINGS_CONFLICT, wrong.parameter().as_bytes()));
                None
            }
        },
        Request::Calibration(course) => {
            state.running.set(Running::Calibration);
            state.calibration_from.set(Some(acts));
            Some(Course { profile: course.profile(), mode: Mode::Rate, rows: course.rows() })
        }
    }
}

/// Nothing runs any more.
fn end(state: &State<'_>) {
    if state.running.replace(Running::None) != Running::None
        && !state.calibrating.get()
        && !state.pulse.is_running()
        && state.completes.replace(false)
    {
        state.status.happened(OPERATION_COMPLETE);
    }
}

fn segment(hardware: &Hardware, zero: Zero, mode: Mode, tick: u64, from: f64, to: f64) -> Segment {
    let ticks = CONTROL_PER_ROW as u16;
    match mode {
        Mode::Off => Segment::off(tick),
        Mode::Voltage => Segment::voltage(hardware, tick, ticks, from),
        Mode::Rate => Segment::rate(hardware, tick, ticks, from, to),
        Mode::Position => Segment::position(hardware, tick, zero, to, None),
    }
}
