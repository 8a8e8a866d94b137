//! Where the measurement loop's rows go: telemetry, supervision, calibration, and the cells that the console reads. Nothing here waits.

use super::state::{Running, State};
use crate::board::{Clock, EdgeTime, Hardware, ROW_HZ, TICKS_PER_ROW, TICKS_PER_S, Ticks};
use crate::calibration::{Measuring, Refused};
use crate::console::errors::{Code, ErrorEntry};
use crate::console::status::OPERATION_COMPLETE;
use crate::measurement_loop::{Decimate, Row, RowSink};
use crate::status::Fault;
use crate::supervision::Watch;
use crate::telemetry::{Beat, Body, RowFrame};
use core::cell::Cell;

/// Rows over which the rate is averaged: 32 ms.
const RATE_ROWS: usize = 32;
/// After a line typed by hand, what is wrong with it is shown unless its end goes on within this: a program ends its lines with LF. 5 ms.
const BY_HAND: u64 = 5 * TICKS_PER_ROW;

/// Where the platform was, by the own counter.
#[derive(Clone, Copy, Default)]
struct Mark {
    theta_rad: f64,
    edge: Option<(i64, EdgeTime)>,
}

impl Mark {
    /// Mean rate from `oldest`, a whole window before, rad/s.
    fn rate_since(&self, oldest: &Self, hardware: &Hardware) -> f64 {
        match (self.edge, oldest.edge) {
            (Some((counts, at)), Some((from, since))) if at > since => {
                counts.wrapping_sub(from) as f64 * hardware.rad_per_count() / at.since_s(since, hardware)
            }
            _ => (self.theta_rad - oldest.theta_rad) * (ROW_HZ as f64 / RATE_ROWS as f64),
        }
    }
}

/// Puts rows into frames.
pub struct Framer<'a> {
    state: &'a State<'a>,
}

impl RowSink for Framer<'_> {
    fn row(&mut self, row: &Row) {
        self.state.out.frame(&Body::Row(RowFrame::new(row, self.state.stream.get().channels)));
    }
}

/// The fan.
pub struct Rows<'a, C> {
    state: &'a State<'a>,
    clock: C,
    hardware: Hardware,
    frames: Option<(u32, Decimate<Framer<'a>>)>,
    fault: Fault,
    watch: Watch,
    /// Number of the last clearing that the watch was told of.
    cleared: u16,
    marks: [Mark; RATE_ROWS],
    taken: usize,
    beat_at: Ticks,
    /// A drift session ran in the row before.
    drifted: bool,
    /// The calibration's sums while it measures; given back to [`super::calibrate`] at its end.
    pub(super) measuring: &'a Cell<Option<Measuring<'a>>>,
}

impl<'a, C: Clock> Rows<'a, C> {
    /// A fan for this state.
    pub fn new(state: &'a State<'a>, clock: C, measuring: &'a Cell<Option<Measuring<'a>>>) -> Self {
        Self {
            state,
            clock,
            hardware: state.hardware,
            frames: None,
            fault: Fault::None,
            watch: Watch::new(&state.kept.get().settings.safety, &state.hardware),
            cleared: state.clear.get(),
            marks: [Mark::default(); RATE_ROWS],
            taken: 0,
            beat_at: Ticks(0),
            drifted: false,
            measuring,
        }
    }

    /// From edge to edge where there were some; a platform that gave none has moved by less than a count.
    fn rate(&mut self, row: &Row) {
        let place = self.taken & (RATE_ROWS - 1);
        let now = Mark { theta_rad: row.theta_rad, edge: row.edge };
        if let Some(oldest) = self.marks.get_mut(place) {
            if self.taken >= RATE_ROWS {
                self.state.rate_rad_s.set(Some(now.rate_since(oldest, &self.hardware)));
            }
            *oldest = now;
        }
        // Past the first round only the place counts.
        self.taken = if self.taken >= 2 * RATE_ROWS - 1 { RATE_ROWS } else { self.taken + 1 };
    }

    fn stream(&mut self, row: &Row, now: Ticks) {
        if !self.state.out.is_streaming() {
            self.frames = None;
            return;
        }
        let every = self.state.stream.get().decimation;
        if self.frames.as_ref().is_none_or(|(old, _)| *old != every) {
            self.frames = Decimate::new(every, Framer { state: self.state }).ok().map(|decimate| (every, decimate));
        }
        if let Some((_, frames)) = &mut self.frames {
            let zero_rad = self.state.to_index_rad.get().unwrap_or(0.0);
            let theta_cmd_rad = row.theta_cmd_rad.map(|theta_rad| theta_rad + zero_rad);
            frames.row(&Row { theta_rad: row.theta_rad + zero_rad, theta_cmd_rad, ..*row });
        }
        if now >= self.beat_at {
            self.beat_at = now + TICKS_PER_S;
            let beat = Beat { at: now.0, lost: self.state.out.lost(), fault: row.fault.code() as u8 };
            self.state.out.frame(&Body::Beat(beat));
        }
    }

    /// A fault that latches ends everything, and is told with what to do.
    fn supervise(&mut self, row: &Row) {
        let state = self.state;
        let before = core::mem::replace(&mut self.fault, row.fault);
        if row.fault != Fault::None && row.fault != before {
            state.all_off();
            let mut entry = ErrorEntry::about(Code::FAULT, row.fault.name().as_bytes());
            entry.detail.writer().text(": ").words(row.fault.advice());
            state.report(entry);
        }
        if row.fault != Fault::None {
            // Latched: who asked for it has been heard.
            state.stop_line.clear_stop();
        } else if state.stop_line.is_stop_asked() && state.is_driving() {
            state.all_off();
        }
        if state.stop_line.take_text() {
            state.to_text();
        }
        if state.watch_anew.take() {
            self.watch.set(&state.kept.get().settings.safety);
            self.watch.arm_host(state.host_silence_s.get().unwrap_or(0.0));
        }
        if state.heard.take() {
            self.watch.heard();
        }
        if state.imu_busy.take() {
            self.watch.sensor_is_busy();
        }
        if core::mem::replace(&mut self.cleared, state.clear.get()) != state.clear.get() {
            self.watch.cleared(row);
        }
        // For as long as the cause is there: a fault that is cleared before latches again.
        state.trip.set(self.watch.take(row));
    }

    /// The observer's check is over and has found something.
    fn observe(&self) {
        if let Some(wrong) = self.state.observer.take_refused() {
            self.state.report(super::commands::refused(&wrong));
        }
    }

    fn registers(&self, row: &Row) {
        let state = self.state;
        let calibrates = u16::from(state.calibrating.get());
        let profile = u16::from(state.running.get() == Running::Profile) << 9;
        let drives = u16::from(state.is_driving()) << 8;
        let streams = u16::from(state.out.is_streaming()) << 10;
        let compensates = u16::from(row.compensating.0 & 6 != 0) << 11;
        state.status.operation.set_condition(calibrates | profile | drives | streams | compensates);
        let limits = row.limits.0 as u16 & 0xff;
        let lost = u16::from(state.out.lost() > 0) << 9;
        state.status.questionable.set_condition(limits | u16::from(row.fault != Fault::None) << 8 | lost);
    }

    fn measure(&mut self, row: &Row) {
        let Some(from) = self.state.calibration_from.get() else { return };
        if row.at < from {
            return;
        }
        if let Some(mut measuring) = self.measuring.take() {
            if row.fault != Fault::None {
                self.state.calibration.refuse(Refused::Fault(row.fault));
            }
            measuring.row(row, &self.state.calibration);
            self.measuring.set(Some(measuring));
        }
    }

    /// A drift session that is over was what somebody waited for.
    fn drift(&mut self) {
        let state = self.state;
        let runs = state.pulse.is_running();
        if core::mem::replace(&mut self.drifted, runs) && !runs && !state.is_busy() && state.completes.replace(false) {
            state.status.happened(OPERATION_COMPLETE);
        }
    }

    fn by_hand(&self, now: Ticks) {
        let state = self.state;
        if state.show_errors_at.get().is_some_and(|at| now >= at + BY_HAND) {
            state.show_errors_at.set(None);
            if !state.out.is_streaming() {
                while state.error_count() > 0 {
                    let entry = state.next_error();
                    state.tell(&entry);
                }
            }
        }
    }
}

impl<C: Clock> RowSink for Rows<'_, C> {
    fn row(&mut self, row: &Row) {
        let now = self.clock.now();
        self.state.row.set(*row);
        self.state.instruments.take(row);
        self.rate(row);
        self.supervise(row);
        self.measure(row);
        self.drift();
        self.observe();
        self.stream(row, now);
        self.registers(row);
        self.by_hand(now);
    }
}
