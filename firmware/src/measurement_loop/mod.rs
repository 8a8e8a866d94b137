//! The independent measurement: rows at 1 kHz from its own counter, its own sensors, its own code.
//!
//! At t_k it looks at everything once. Row k is complete at t_{k+1}: angle, rate, supply and temperature are those of t_k,
//! voltage and current are means over [t_k, t_{k+1}). Of the speed loop it knows only the report, for what was *asked*:
//! voltage and commands; what is *measured* never passes through the speed loop, and nothing here slows that.
//!
//! Rows carry a sequence number, so that a loss is counted, and the age of the oldest reading in them. A sensor that
//! Angles are from the index where it was seen before the session, else from the counter's zero. A sensor that
//! is not there is `None`, and so is a current without a conversion; nothing is made up.

mod decimate;

pub use decimate::Decimate;

use crate::board::{Board, CONTROL_HZ, Clock, Hardware, TICKS_PER_ROW, Ticks, Unwrapped};
use crate::speed_loop::{Compensating, Fault, Limits, Mode, ONE, Report, ReportReader};

/// One sample of everything.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// Number of the row since the loop was made; a gap is a loss.
    pub sequence: u32,
    /// t_k in seconds since the start of the session.
    pub t_s: f64,
    /// Asked voltage at nominal supply, mean over [t_k, t_{k+1}), V.
    pub u_V: f64,
    /// Supply at t_k, V.
    pub supply_V: Option<f64>,
    /// Motor current, mean over [t_k, t_{k+1}), A.
    pub i_A: Option<f64>,
    /// Platform angle at t_k from the own counter, unwrapped, rad; its zero is the session's ([`MeasurementLoop::zero_is_index`]).
    pub theta_rad: f64,
    /// Platform angle at t_k from the index as it was last seen, half a count added: the middle of the count; `None` before it was seen, rad.
    pub from_index_rad: Option<f64>,
    /// The rate sensor at t_k, rad/s.
    pub omega_rad_s: Option<f64>,
    /// Rate command at t_k, rad/s; rate mode only.
    pub rate_cmd_rad_s: Option<f64>,
    /// Position command at t_k, rad; rate mode only.
    pub theta_cmd_rad: Option<f64>,
    /// Winding temperature at t_k, °C.
    pub temp_C: Option<f64>,
    /// The limits that were in force at some time within the row.
    pub limits: Limits,
    /// What of the learnt compensation was at work at t_k.
    pub compensating: Compensating,
    /// The latched fault at the row's end.
    pub fault: Fault,
    /// Age of the oldest reading of the row at its t_k, board clock steps.
    pub age: u64,
}

/// Where rows go.
pub trait RowSink {
    /// Takes a row; must not wait.
    fn row(&mut self, row: &Row);
}

/// How evenly the rows came: shortest and longest time between two looks, board clock steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// Shortest.
    pub least: u64,
    /// Longest.
    pub greatest: u64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { least: u64::MAX, greatest: 0 }
    }
}

/// What was seen at one t_k.
#[derive(Clone, Copy)]
struct Look {
    at: Ticks,
    counts: i64,
    from_index: Option<i64>,
    omega_rad_s: Option<f64>,
    supply_V: Option<f64>,
    temp_C: Option<f64>,
    age: u64,
    report: Report,
}

/// The loop's state between rows.
pub struct MeasurementLoop<'a> {
    hardware: Hardware,
    reports: ReportReader<'a>,
    report: Report,
    position: Unwrapped,
    /// The counter at the index, as last seen.
    index_counts: Option<i64>,
    /// The counter at the session's zero of the angle.
    zero_counts: i64,
    sequence: u32,
    pace: Pace,
}

impl<'a> MeasurementLoop<'a> {
    /// A loop for this hardware that hears the speed loop's reports.
    pub fn new(hardware: Hardware, reports: ReportReader<'a>) -> Self {
        Self {
            hardware,
            reports,
            report: Report::default(),
            position: Unwrapped::default(),
            index_counts: None,
            zero_counts: 0,
            sequence: 0,
            pace: Pace::default(),
        }
    }

    /// The scales that it reads with.
    pub fn hardware(&self) -> &Hardware {
        &self.hardware
    }

    /// Whether the next session's angles are from the index: it was seen before. Within a session the zero does not move.
    pub fn zero_is_index(&self) -> bool {
        self.index_counts.is_some()
    }

    /// How evenly the rows have come so far.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// Measures `rows` rows from `start` on into `sink`. Ends one row later, when the last is complete.
    pub async fn run<B: Board, S: RowSink>(&mut self, board: &mut B, start: Ticks, rows: u64, sink: &mut S) {
        let clock = board.clock();
        clock.until(start).await;
        self.zero_counts = self.index_counts.unwrap_or(0);
        // What the ADC summed before the session belongs to no row.
        board.current();
        let mut before = self.look(board, clock.now());
        let mut at = start;
        for _ in 0..rows {
            at = at + TICKS_PER_ROW;
            clock.until(at).await;
            let now = self.look(board, clock.now());
            let between = now.at - before.at;
            self.pace.least = self.pace.least.min(between);
            self.pace.greatest = self.pace.greatest.max(between);
            let i_A = board.current().value.mean_A(&self.hardware);
            sink.row(&self.row(&before, &now, i_A, start));
            self.sequence = self.sequence.wrapping_add(1);
            before = now;
        }
    }

    fn look<B: Board>(&mut self, board: &mut B, at: Ticks) -> Look {
        let h = self.hardware;
        let encoder = board.encoder();
        let rate = board.rate();
        let supply = board.supply();
        let temperature = board.temperature();
        let index = board.index();
        self.position.take(encoder.value);
        if let Some(edge) = index {
            self.index_counts = Some(self.position.counts.wrapping_sub(i64::from(encoder.value.since(edge.count))));
        }
        self.report = self.reports.take().unwrap_or(self.report);
        let ages = [Some(encoder.age(at)), rate.map(|r| r.age(at)), supply.map(|r| r.age(at)), temperature.map(|r| r.age(at))];
        Look {
            at,
            counts: self.position.counts,
            from_index: self.index_counts.map(|index| self.position.counts.wrapping_sub(index)),
            omega_rad_s: rate.map(|r| r.value.rad_s(&h)),
            supply_V: supply.map(|r| r.value.volts(&h)),
            temp_C: temperature.map(|r| r.value.celsius(&h)),
            age: ages.into_iter().flatten().max().unwrap_or(0),
            report: self.report,
        }
    }

    fn row(&self, k: &Look, next: &Look, i_A: Option<f64>, start: Ticks) -> Row {
        let h = &self.hardware;
        let ticks = next.report.tick.saturating_sub(k.report.tick).max(1) as f64;
        let duty = next.report.duty_sum.wrapping_sub(k.report.duty_sum) as f64;
        let count_rad = h.rad_per_count();
        let in_rate_mode = k.report.mode == Mode::Rate;
        Row {
            sequence: self.sequence,
            t_s: Ticks(k.at - start).seconds(),
            u_V: duty / ticks * h.volt_per_duty(),
            supply_V: k.supply_V,
            i_A,
            theta_rad: k.counts.wrapping_sub(self.zero_counts) as f64 * count_rad,
            from_index_rad: k.from_index.map(|counts| (counts as f64 + 0.5) * count_rad),
            omega_rad_s: k.omega_rad_s,
            rate_cmd_rad_s: in_rate_mode.then(|| k.report.rate_command as f64 / ONE * count_rad * CONTROL_HZ as f64),
            theta_cmd_rad: in_rate_mode.then(|| (k.report.position_command as f64 / ONE - self.zero_counts as f64) * count_rad),
            temp_C: k.temp_C,
            limits: next.report.limits_since(&k.report),
            compensating: k.report.compensating,
            fault: next.report.fault,
            age: k.age,
        }
    }
}
