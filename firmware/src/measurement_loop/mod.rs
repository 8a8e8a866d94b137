//! The independent measurement: rows at 1 kHz from its own counter, its own sensors, its own code.
//!
//! At t_k it looks at everything once. Row k is complete at t_{k+1}: angle, rate, supply and temperature are those of t_k,
//! voltage and current are means over [t_k, t_{k+1}). Of the speed loop it knows only the report, for what was *asked*:
//! voltage and commands; what is *measured* never passes through the speed loop, and nothing here slows that.
//!
//! Rows carry a sequence number, so that a loss is counted, and the age of the oldest reading in them. A look that comes a row late
//! or more leaves rows out, and their numbers with them. Angles are from the index where it was seen before the session, else from the
//! counter's zero. A sensor that is not there is `None`, and so is a current without a conversion; nothing is made up.
//!
//! What the rows say of drive, sensor and rate is worked out by [`Instruments`], one of the places where rows go.

mod decimate;
mod drive;
mod instruments;
mod matrix;
mod moments;
mod row;
mod sensor;
mod stability;
mod statistics;
mod timing;
mod turn;
mod windows;

pub use decimate::Decimate;
pub use drive::{DriveReading, Estimate};
pub use instruments::Instruments;
pub use row::{Row, RowSink};
pub use sensor::SensorReading;
pub use stability::{StabilityReading, WINDOWS_DEG};
pub use statistics::Statistics;
pub use timing::TimingReading;
pub use turn::{Turn, TurnReading};

use crate::board::{Board, CONTROL_HZ, Clock, EdgeTime, GyroSample, Hardware, TICKS_PER_ROW, Ticks, Unwrapped};
use crate::gyro_loop;
use crate::gyro_loop::observer::{self, Observed, Seen};
use crate::mailbox::Mailbox;
use crate::sensors;
use crate::speed_loop::{Fault, ONE, Report};
use turn::TurnTimer;

/// A rate that is older is no rate: its sensor gives one every half millisecond.
const FRESH: u64 = 5 * TICKS_PER_ROW;

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
    edge: Option<(i64, EdgeTime)>,
    turn: Option<Turn>,
    imu: Option<sensors::Motion>,
    imu_age: u64,
    sensor_C: Option<f32>,
    gyro: Option<GyroSample>,
    mark: u32,
    observed: Option<Observed>,
    roll_rad: Option<f64>,
    omega_rad_s: Option<f64>,
    supply_V: Option<f64>,
    temp_C: Option<f64>,
    age: u64,
    report: Report,
}

/// The loop's state between rows.
pub struct MeasurementLoop<'a> {
    hardware: Hardware,
    reports: &'a Mailbox<Report>,
    report: Report,
    position: Unwrapped,
    /// The counter at the index, as last seen.
    index_counts: Option<i64>,
    turns: TurnTimer,
    imu: Option<&'a sensors::Shared>,
    pulse: Option<&'a gyro_loop::Shared>,
    observer: Option<&'a observer::Shared>,
    /// The counter at the session's zero of the angle.
    zero_counts: i64,
    sequence: u32,
    pace: Pace,
}

impl<'a> MeasurementLoop<'a> {
    /// A loop for this hardware that hears the speed loop's reports.
    pub fn new(hardware: Hardware, reports: &'a Mailbox<Report>) -> Self {
        Self {
            hardware,
            reports,
            report: Report::default(),
            position: Unwrapped::default(),
            index_counts: None,
            turns: TurnTimer::new(hardware),
            imu: None,
            pulse: None,
            observer: None,
            zero_counts: 0,
            sequence: 0,
            pace: Pace::default(),
        }
    }

    /// The same loop, whose rows carry what the sensor under test last showed.
    pub fn with_imu(self, imu: &'a sensors::Shared) -> Self {
        Self { imu: Some(imu), ..self }
    }

    /// The same loop, which steps the pulses of the drift measurement and closes its correction loop: both go by the rows' time.
    pub fn with_pulse(self, pulse: &'a gyro_loop::Shared) -> Self {
        Self { pulse: Some(pulse), ..self }
    }

    /// The same loop, which steps an observer of the gyro.
    pub fn with_observer(self, observer: &'a observer::Shared) -> Self {
        Self { observer: Some(observer), ..self }
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
        let mut before = self.look(board, start, clock.now());
        let mut row = 0;
        while row < rows {
            let due = start + TICKS_PER_ROW.saturating_mul(row.saturating_add(1));
            clock.until(due).await;
            let now = self.look(board, due, clock.now());
            let between = now.at - before.at;
            self.pace.least = self.pace.least.min(between);
            self.pace.greatest = self.pace.greatest.max(between);
            let i_A = board.current().value.mean_A(&self.hardware);
            sink.row(&self.row(&before, &now, i_A, start));
            // Whole rows that it came too late for: they are gone, and their numbers say so.
            let missed = (now.at - due).checked_div(TICKS_PER_ROW).unwrap_or(0);
            self.sequence = self.sequence.wrapping_add(1).wrapping_add(missed as u32);
            row = row.saturating_add(1).saturating_add(missed);
            before = now;
        }
    }

    fn look<B: Board>(&mut self, board: &mut B, due: Ticks, at: Ticks) -> Look {
        let h = self.hardware;
        self.report = self.reports.take().unwrap_or(self.report);
        let gyro = board.gyro();
        let roll_rad = board.roll().map(|roll| roll.value.rad(&h));
        let mut observed = None;
        if let Some(pulse) = self.pulse {
            let mut step = pulse.step(gyro, due, self.report.fault);
            if let Some(observer) = self.observer {
                let gains = observer.gains();
                let angle_V = gyro.filter(|sample| sample.at == due).map(|sample| sample.value.angle_V(&h));
                let seen = Seen {
                    due,
                    angle_rad: angle_V.filter(|volts| volts.abs() <= gains.angle_limit_V).map(|volts| volts / gains.angle_gain_V_rad),
                    roll_rad,
                    limit_A: gains.torquer_limit_A,
                    faulty: self.report.fault != Fault::None,
                };
                let (estimate, own) = observer.step(&seen, &h);
                observed = estimate;
                // While pulses run, the torquer is theirs; the observer is told.
                step = own.filter(|_| !pulse.is_running()).unwrap_or(step);
                observer.given(step);
            }
            board.torque(due + TICKS_PER_ROW, step);
        }
        let encoder = board.encoder();
        let rate = board.rate().filter(|sample| sample.age(at) <= FRESH);
        let supply = board.supply();
        let temperature = board.temperature();
        let edge = board.edge();
        let index = board.index();
        self.position.take(encoder.value);
        // A capture is of a count less than half a wrap back.
        let unwrap = |count| self.position.counts.wrapping_sub(i64::from(encoder.value.since(count)));
        let met = index.map(|edge| (unwrap(edge.count), edge.at));
        let edge = edge.map(|edge| (unwrap(edge.count), edge.at));
        if let Some((counts, _)) = met {
            self.index_counts = Some(counts);
        }
        let turn = self.turns.look(self.position.counts, met);
        let imu = self.imu.and_then(|shared| shared.newest());
        let ages = [Some(encoder.age(at)), rate.map(|r| r.age(at)), supply.map(|r| r.age(at)), temperature.map(|r| r.age(at))];
        Look {
            at,
            counts: self.position.counts,
            from_index: self.index_counts.map(|index| self.position.counts.wrapping_sub(index)),
            edge,
            turn,
            imu: imu.map(|newest| newest.value),
            imu_age: imu.map_or(0, |newest| newest.age(at)),
            sensor_C: self.imu.and_then(|shared| shared.status().temperature_C),
            gyro: gyro.filter(|sample| sample.at == due).map(|sample| sample.value),
            mark: self.pulse.map_or(0, gyro_loop::Shared::mark),
            observed,
            roll_rad,
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
        let duty = f64::from(next.report.duty_since(&k.report));
        let count_rad = h.rad_per_count();
        let follows = k.report.mode.follows();
        Row {
            sequence: self.sequence,
            at: k.at,
            t_s: Ticks(k.at - start).seconds(),
            u_V: duty / ticks * h.volt_per_duty(),
            supply_V: k.supply_V,
            i_A,
            theta_rad: k.counts.wrapping_sub(self.zero_counts) as f64 * count_rad,
            from_index_rad: k.from_index.map(|counts| (counts as f64 + 0.5) * count_rad),
            edge: k.edge,
            turn: k.turn,
            omega_rad_s: k.omega_rad_s,
            gyro_rad_s: k.imu.map(|motion| f64::from(motion.rate_rad_s)),
            accel_x_m_s2: k.imu.map(|motion| f64::from(motion.outward_m_s2)),
            accel_y_m_s2: k.imu.map(|motion| f64::from(motion.along_m_s2)),
            imu_age: k.imu_age,
            sensor_C: k.sensor_C.map(f64::from),
            angle_sensor_V: k.gyro.map(|sample| sample.angle_V(h)),
            // A sample has the current of the millisecond before it.
            torquer_A: next.gyro.and_then(|sample| sample.torquer_A(h)),
            drift_mark: k.mark,
            observed: k.observed,
            roll_rad: k.roll_rad,
            rate_cmd_rad_s: follows.then(|| k.report.rate_command as f64 / ONE * count_rad * CONTROL_HZ as f64),
            theta_cmd_rad: follows.then(|| (k.report.position_command_counts(k.counts) - self.zero_counts as f64) * count_rad),
            temp_C: k.temp_C,
            loop_rate_rad_s: f64::from(k.report.rate) * count_rad * CONTROL_HZ as f64,
            loop_rate_age_s: f64::from(k.report.edge_age) / h.edge_timer_Hz,
            limits: next.report.limits_since(&k.report),
            compensating: k.report.compensating,
            fault: next.report.fault,
            age: k.age,
        }
    }
}
