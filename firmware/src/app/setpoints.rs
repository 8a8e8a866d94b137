//! Passes the setpoints to the speed loop, one millisecond ahead. Part of the measurement runner.
//!
//! At t_k it posts the segment of [t_{k+1}, t_{k+2}): of the running profile, or of the held setpoint. In voltage mode a value is held for
//! its millisecond; in rate mode the command is linear between the values. After a profile the drive is off. Every post also carries the
//! count of fault clearings and the trip of the slow supervision, so that both reach the loop within two milliseconds.

use super::state::{Activity, DriveState, Request, Run, Setpoint};
use crate::board::{CONTROL_PER_ROW, Clock, Hardware, TICKS_PER_CONTROL, TICKS_PER_ROW, Ticks};
use crate::mailbox::Mailbox;
use crate::speed_loop::{Command, Mode, Segment, Zero};

/// Runs for ever. The first segment acts at `start`, a whole millisecond that is at least one millisecond ahead.
pub async fn run<C: Clock>(drive: &DriveState, hardware: &Hardware, clock: &C, commands: &Mailbox<Command>, start: Ticks) -> ! {
    let mut tick = start.0.checked_div(TICKS_PER_CONTROL).unwrap_or(0);
    let mut at = Ticks(start.0.saturating_sub(TICKS_PER_ROW));
    let mut run: Option<Run> = None;
    let mut value = 0.0;
    loop {
        clock.until(at).await;
        match drive.request.take() {
            Some(Request::Run(mut next)) => {
                drive.activity.set(next.activity);
                if next.activity == Activity::Calibration {
                    drive.course_from.set(Some(at + TICKS_PER_ROW));
                }
                value = next.profile.next_value();
                run = Some(next);
            }
            Some(Request::End) => {
                drive.activity.set(Activity::None);
                run = None;
            }
            None => {}
        }
        let (mode, from, to) = match &mut run {
            Some(run) => (run.mode, value, run.profile.next_value()),
            None => match drive.setpoint.get() {
                Setpoint::Off => (Mode::Off, 0.0, 0.0),
                Setpoint::Hold(mode, value) => (mode, value, value),
            },
        };
        value = to;
        commands.post(Command {
            segment: segment(hardware, drive.zero.get(), mode, tick, from, to),
            clear: drive.fault_clears.get(),
            trip: drive.trip.get(),
        });
        if let Some(running) = &mut run {
            running.rows_left = running.rows_left.saturating_sub(1);
            if running.rows_left == 0 {
                run = None;
                drive.activity.set(Activity::None);
            }
        }
        tick = tick.saturating_add(CONTROL_PER_ROW);
        at = at + TICKS_PER_ROW;
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

#[cfg(test)]
mod tests {
    use super::*;
    use critical_section as _;

    #[test]
    fn what_a_critical_section_copies_takes_less_than_2_us() {
        // 96 words at three cycles each, with load and store of several registers: 1.6 us at 180 MHz.
        let sizes = [size_of::<Option<Request>>(), size_of::<Option<Command>>(), size_of::<Setpoint>()];
        assert!(sizes.iter().all(|bytes| *bytes <= 384), "{sizes:?}");
    }
}
