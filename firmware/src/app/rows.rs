//! Distribution of the measured rows in thread mode: to telemetry, supervision, calibration, and the cells that the console reads. Nothing
//! here waits.

use super::self_test;
use super::state::{Activity, CalibrationPhase, State};
use crate::board::{Clock, EdgeTime, Hardware, ROW_HZ, TICKS_PER_ROW, TICKS_PER_S, Ticks};
use crate::calibration::{CalibrationError, CalibrationRun};
use crate::console::errors::{Code, ErrorEntry};
use crate::measurement_loop::{Decimate, Row, RowSink};
use crate::status::Fault;
use crate::supervision::RowSupervisor;
use crate::telemetry::{Beat, Body, RowFrame};
use core::cell::Cell;

/// Window of the mean rate, rows: 32 ms.
const RATE_ROWS: usize = 32;
/// A line that ends with CR was typed by hand if no LF follows within this time, 5 ms; its errors are then shown without a query.
const BY_HAND_TIMEOUT: u64 = 5 * TICKS_PER_ROW;

/// The row of the self-test at power-on: after the filters of current and supply have settled.
const SELF_TEST_ROW: u32 = 200;

/// Position of the platform by the counter of the measurement.
#[derive(Clone, Copy, Default)]
struct Mark {
    theta_rad: f64,
    edge: Option<(i64, EdgeTime)>,
}

impl Mark {
    /// Mean rate since `oldest`, a whole window before, rad/s.
    fn rate_since(&self, oldest: &Self, hardware: &Hardware) -> f64 {
        match (self.edge, oldest.edge) {
            (Some((counts, at)), Some((from, since))) if at > since => {
                counts.wrapping_sub(from) as f64 * hardware.rad_per_count() / at.since_s(since, hardware)
            }
            _ => (self.theta_rad - oldest.theta_rad) * (ROW_HZ as f64 / RATE_ROWS as f64),
        }
    }
}

/// Sends rows as frames.
pub struct Framer<'a> {
    state: &'a State<'a>,
}

impl RowSink for Framer<'_> {
    fn row(&mut self, row: &Row) {
        self.state.out.frame(&Body::Row(RowFrame::new(row, self.state.stream.selection.get().channels)));
    }
}

/// Distributes the rows.
pub struct Rows<'a, C> {
    state: &'a State<'a>,
    clock: C,
    hardware: Hardware,
    frames: Option<(u32, Decimate<Framer<'a>>)>,
    fault: Fault,
    watch: RowSupervisor,
    /// The count of fault clearings that the watch has seen.
    fault_clears: u16,
    marks: [Mark; RATE_ROWS],
    taken: usize,
    beat_at: Ticks,
    /// Number that the next row has if none is lost; `None` before the first.
    next_sequence: Option<u32>,
    /// Sums of the calibration while it measures; [`super::calibrate`] takes them at the end.
    pub(super) measuring: &'a Cell<Option<CalibrationRun<'a>>>,
}

impl<'a, C: Clock> Rows<'a, C> {
    /// Distributes the rows of this state.
    pub fn new(state: &'a State<'a>, clock: C, measuring: &'a Cell<Option<CalibrationRun<'a>>>) -> Self {
        Self {
            state,
            clock,
            hardware: state.hardware,
            frames: None,
            fault: Fault::None,
            watch: RowSupervisor::new(&state.settings.kept.get().settings.safety, &state.hardware),
            fault_clears: state.drive.fault_clears.get(),
            marks: [Mark::default(); RATE_ROWS],
            taken: 0,
            beat_at: Ticks(0),
            next_sequence: None,
            measuring,
        }
    }

    /// Mean rate between encoder edges; from the angles where no edge came, since the platform then moved by less than a count.
    fn rate(&mut self, row: &Row) {
        let place = self.taken & (RATE_ROWS - 1);
        let now = Mark { theta_rad: row.theta_rad, edge: row.edge };
        if let Some(oldest) = self.marks.get_mut(place) {
            if self.taken >= RATE_ROWS {
                self.state.measured.rate_rad_s.set(Some(now.rate_since(oldest, &self.hardware)));
            }
            *oldest = now;
        }
        // After the first window only the position in the ring counts.
        self.taken = if self.taken >= 2 * RATE_ROWS - 1 { RATE_ROWS } else { self.taken + 1 };
    }

    fn stream(&mut self, row: &Row, now: Ticks) {
        if !self.state.out.is_streaming() {
            self.frames = None;
            return;
        }
        let every = self.state.stream.selection.get().decimation;
        if self.frames.as_ref().is_none_or(|(old, _)| *old != every) {
            self.frames = Decimate::new(every, Framer { state: self.state }).ok().map(|decimate| (every, decimate));
        }
        if let Some((_, frames)) = &mut self.frames {
            let zero_rad = self.state.stream.to_index_rad.get().unwrap_or(0.0);
            let theta_cmd_rad = row.theta_cmd_rad.map(|theta_rad| theta_rad + zero_rad);
            frames.row(&Row { theta_rad: row.theta_rad + zero_rad, theta_cmd_rad, ..*row });
        }
        if now >= self.beat_at {
            self.beat_at = now + TICKS_PER_S;
            let beat = Beat { at: now.0, lost: self.state.out.lost(), fault: row.fault.code() as u8 };
            self.state.out.frame(&Body::Beat(beat));
        }
    }

    /// Ends everything when a fault latches and reports it with advice; updates the supervision.
    fn supervise(&mut self, row: &Row) {
        let state = self.state;
        let before = core::mem::replace(&mut self.fault, row.fault);
        if row.fault != Fault::None && row.fault != before {
            state.all_off();
            state.report(ErrorEntry::with(Code::FAULT, format_args!("{}: {}", row.fault.name(), row.fault.advice())));
        }
        if row.fault != Fault::None {
            // The stop is latched as a fault: the request is done.
            state.stop_line.clear_stop();
        } else if state.stop_line.is_stop_requested() && state.is_driving() {
            state.all_off();
        }
        if state.stop_line.take_text() {
            state.set_text_mode();
        }
        if state.supervision.settings_changed.take() {
            self.watch.set_settings(&state.settings.kept.get().settings.safety);
            self.watch.set_host_timeout(state.supervision.host_timeout_s.get());
        }
        if state.supervision.host_heard.take() || row.at < state.supervision.unattended_until.get() {
            self.watch.host_heard();
        }
        if state.supervision.dut_busy.take() {
            self.watch.set_dut_busy();
        }
        let fault_clears = state.drive.fault_clears.get();
        if core::mem::replace(&mut self.fault_clears, fault_clears) != fault_clears {
            self.watch.restart_index_search(&row.supervised());
        }
        // Set while the cause is present, so that a fault cleared too early latches again.
        state.drive.trip.set(self.watch.update(&row.supervised()));
    }

    /// Reports the refusal of an observer by its check.
    fn report_observer(&self) {
        if let Some(error) = self.state.gyro.observer.take_refused() {
            self.state.report(ErrorEntry::with(Code::SETTING, error));
        }
    }

    fn set_registers(&self, row: &Row) {
        let state = self.state;
        let calibrating = u16::from(state.calibration.is_running());
        let profile = u16::from(state.drive.activity.get() == Activity::Profile) << 9;
        let driving = u16::from(state.is_driving()) << 8;
        let streaming = u16::from(state.out.is_streaming()) << 10;
        let compensating = u16::from(row.compensating.0 & 6 != 0) << 11;
        state.status.registers.operation.set_condition(calibrating | profile | driving | streaming | compensating);
        let limits = row.limits.0 as u16 & 0xff;
        let lost = u16::from(state.out.lost() > 0) << 9;
        state.status.registers.questionable.set_condition(limits | u16::from(row.fault != Fault::None) << 8 | lost);
    }

    fn measure(&mut self, row: &Row) {
        let phase = &self.state.calibration.phase;
        if matches!(phase.get(), CalibrationPhase::Starting)
            && let Some(from) = self.state.drive.course_from.take()
        {
            phase.set(CalibrationPhase::CalibrationRun { from });
        }
        let CalibrationPhase::CalibrationRun { from } = phase.get() else { return };
        if row.at < from {
            return;
        }
        if let Some(mut measuring) = self.measuring.take() {
            if row.fault != Fault::None {
                self.state.calibration.watch.fail(CalibrationError::Fault(row.fault));
            }
            measuring.add(row, &self.state.calibration.watch);
            self.measuring.set(Some(measuring));
        }
    }

    /// Completes the operation at the end of an activity.
    fn complete(&self) {
        if !self.state.is_busy() {
            self.state.status.complete_operation();
        }
    }

    /// Counts the rows lost before this one in the stream, whether they were not measured or found the queue full.
    fn count_lost(&mut self, row: &Row) {
        let expected = self.next_sequence.replace(row.sequence.wrapping_add(1)).unwrap_or(row.sequence);
        let lost = row.sequence.wrapping_sub(expected);
        if lost > 0 && self.state.out.is_streaming() {
            self.state.out.skip(lost);
        }
    }

    /// Shows the errors of a line that was typed by hand.
    fn show_errors(&self, now: Ticks) {
        let state = self.state;
        if state.status.show_errors_at.get().is_some_and(|at| now >= at + BY_HAND_TIMEOUT) {
            state.status.show_errors_at.set(None);
            if !state.out.is_streaming() {
                while state.status.error_count() > 0 {
                    state.show_error(&state.status.next_error());
                }
            }
        }
    }
}

impl<C: Clock> RowSink for Rows<'_, C> {
    fn row(&mut self, row: &Row) {
        let now = self.clock.now();
        self.state.measured.row.set(*row);
        self.state.measured.instruments.add(row);
        self.count_lost(row);
        self.rate(row);
        self.supervise(row);
        self.measure(row);
        self_test::row(self.state, row);
        if row.sequence == SELF_TEST_ROW {
            self_test::report_at_rest(self.state);
        }
        self.complete();
        self.report_observer();
        self.stream(row, now);
        self.set_registers(row);
        self.show_errors(now);
        self.state.end_stream_without_program(now);
    }
}
