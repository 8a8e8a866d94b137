//! Passes the setpoints to the speed loop, one millisecond ahead.
//!
//! At t_k it posts the segment of [t_{k+1}, t_{k+2}): of the running profile, or of the held setpoint. In voltage mode a value is held for its
//! millisecond; in rate mode the command is linear between the values. After a profile the drive is off. Every post also carries the count
//! of fault clearings and the trip of the tasks, so that both reach the loop within two milliseconds.

use super::state::{Activity, CalibrationPhase, Request, Setpoint, State};
use crate::board::{CONTROL_PER_ROW, Clock, Hardware, TICKS_PER_CONTROL, TICKS_PER_ROW, Ticks};
use crate::console::errors::{Code, ErrorEntry};
use crate::mailbox::Mailbox;
use crate::profile::Profile;
use crate::speed_loop::{Command, Mode, Segment, Zero};

/// A running profile.
struct Run {
    profile: Profile,
    mode: Mode,
    rows_left: u64,
}

/// Runs for ever. The first segment acts at `start`, a whole millisecond that is at least one millisecond ahead.
pub async fn run<C: Clock>(state: &State<'_>, clock: &C, commands: &Mailbox<Command>, start: Ticks) -> ! {
    let mut tick = start.0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
    let mut at = Ticks(start.0.saturating_sub(TICKS_PER_ROW));
    let mut run: Option<Run> = None;
    let mut value = 0.0;
    loop {
        clock.until(at).await;
        if let Some(request) = state.drive.request.take() {
            run = begin(state, request, at + TICKS_PER_ROW);
            if let Some(run) = &mut run {
                value = run.profile.next_value();
            } else {
                end(state);
            }
        }
        let (mode, from, to) = match &mut run {
            Some(run) => (run.mode, value, run.profile.next_value()),
            None => match state.drive.setpoint.get() {
                Setpoint::Off => (Mode::Off, 0.0, 0.0),
                Setpoint::Hold(mode, value) => (mode, value, value),
            },
        };
        value = to;
        commands.post(Command {
            segment: segment(&state.hardware, state.drive.zero.get(), mode, tick, from, to),
            clear: state.drive.fault_clears.get(),
            trip: state.drive.trip.get(),
        });
        if let Some(running) = &mut run {
            running.rows_left = running.rows_left.saturating_sub(1);
            if running.rows_left == 0 {
                run = None;
                state.drive.setpoint.set(Setpoint::Off);
                end(state);
            }
        }
        tick = tick.saturating_add(CONTROL_PER_ROW);
        at = at + TICKS_PER_ROW;
    }
}

/// Starts what was requested; its first value acts at `from`.
fn begin(state: &State<'_>, request: Request, from: Ticks) -> Option<Run> {
    match request {
        Request::End => None,
        Request::Profile(config, mode, rows_left) => match Profile::for_mode(&config, mode) {
            Ok(profile) => {
                state.drive.activity.set(Activity::Profile);
                Some(Run { profile, mode, rows_left })
            }
            // The console has checked it before the request.
            Err(error) => {
                state.report(ErrorEntry::with(Code::SETTINGS_CONFLICT, error));
                None
            }
        },
        Request::Calibration(course) => {
            state.drive.activity.set(Activity::Calibration);
            state.calibration.phase.set(CalibrationPhase::CalibrationRun { from });
            Some(Run { profile: course.profile(), mode: Mode::Rate, rows_left: course.rows() })
        }
    }
}

/// No activity runs any more.
fn end(state: &State<'_>) {
    let was_active = state.drive.activity.replace(Activity::None) != Activity::None;
    if was_active && !state.calibration.is_running() && !state.gyro.drift.is_running() {
        state.status.complete_operation();
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
