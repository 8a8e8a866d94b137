//! Measurement loop: rows at 1 kHz from its own encoder counter and sensors, independent of the speed loop.
//!
//! At t_k every input is read once. Row k is complete at t_{k+1}: angle, rate, supply and temperature are those of t_k; voltage and current
//! are means over [t_k, t_{k+1}). The speed loop's report is used for commanded quantities only (voltage and setpoints).
//!
//! Rows carry a sequence number, which shows losses, and the age of their oldest reading. A loop that runs a row late or more leaves rows
//! out, together with their numbers. Angles are counted from the index if it was seen before the session, else from the counter's zero. A
//! missing sensor, or a current without a conversion, is `None`.
//!
//! [`Instruments`] evaluates the rows: constants of drive and sensor, rate, stability, timing, frequency of the crystal.

mod clock_reference;
mod decimate;
mod drive_estimate;
mod instruments;
mod least_squares;
mod matrix;
mod row;
mod sensor_estimate;
mod stability;
mod statistics;
mod timing;
mod turn;
mod windows;

pub use clock_reference::ClockReading;
pub use decimate::Decimate;
pub use drive_estimate::{DriveReading, Estimate};
pub use instruments::Instruments;
pub use row::{Row, RowSink};
pub use sensor_estimate::SensorReading;
pub use stability::{StabilityReading, WINDOWS_DEG};
pub use statistics::Statistics;
pub use timing::TimingReading;
pub use turn::{Turn, TurnReading};

use crate::board::{Board, CONTROL_HZ, Clock, EdgeTime, EncoderCount, Hardware, Stamped, TICKS_PER_ROW, Ticks, Unwrapped};
use crate::gyro_loop::{GyroLoop, GyroReading};
use crate::mailbox::Mailbox;
use crate::sensors;
use crate::speed_loop::{ONE, Report};
use turn::TurnTimer;

/// Largest age of a valid reading of the rate sensor, which delivers one each half millisecond.
const MAX_RATE_AGE: u64 = 5 * TICKS_PER_ROW;

/// Shortest and longest time between two rows, board clock steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pace {
    /// Shortest.
    pub min: u64,
    /// Longest.
    pub max: u64,
}

impl Default for Pace {
    fn default() -> Self {
        Self { min: u64::MAX, max: 0 }
    }
}

/// All readings of one t_k.
#[derive(Clone, Copy)]
struct Readings {
    at: Ticks,
    counts: i64,
    from_index: Option<i64>,
    has_passed_index: bool,
    edge: Option<(i64, EdgeTime)>,
    turn: Option<Turn>,
    reference_pulse: Option<EdgeTime>,
    imu: Option<sensors::Motion>,
    imu_age: u64,
    sensor_C: Option<f32>,
    gyro: GyroReading,
    omega_rad_s: Option<f64>,
    supply_V: Option<f64>,
    temp_C: Option<f64>,
    age: u64,
    report: Report,
}

/// State of the loop between rows.
pub struct MeasurementLoop<'a> {
    hardware: Hardware,
    reports: &'a Mailbox<Report>,
    report: Report,
    position: Unwrapped,
    /// The counter at the last index.
    index_counts: Option<i64>,
    turns: TurnTimer,
    imu: Option<&'a sensors::Shared>,
    gyro: Option<GyroLoop<'a>>,
    /// The counter at the angle's zero of this session.
    zero_counts: i64,
    sequence: u32,
    pace: Pace,
}

impl<'a> MeasurementLoop<'a> {
    /// A loop for this hardware and the speed loop's reports.
    pub fn new(hardware: Hardware, reports: &'a Mailbox<Report>) -> Self {
        Self {
            hardware,
            reports,
            report: Report::default(),
            position: Unwrapped::default(),
            index_counts: None,
            turns: TurnTimer::new(hardware),
            imu: None,
            gyro: None,
            zero_counts: 0,
            sequence: 0,
            pace: Pace::default(),
        }
    }

    /// Also measures the sensor under test.
    pub fn with_imu(self, imu: &'a sensors::Shared) -> Self {
        Self { imu: Some(imu), ..self }
    }

    /// Also runs this gyroscope loop, at the time of each row.
    pub fn with_gyro(self, gyro: GyroLoop<'a>) -> Self {
        Self { gyro: Some(gyro), ..self }
    }

    /// The scales of the readings.
    pub fn hardware(&self) -> &Hardware {
        &self.hardware
    }

    /// Whether the next session's angles are counted from the index. The zero does not move within a session.
    pub fn zero_is_index(&self) -> bool {
        self.index_counts.is_some()
    }

    /// Shortest and longest time between rows so far.
    pub fn pace(&self) -> Pace {
        self.pace
    }

    /// Measures `rows` rows from `start` on into `sink`. Ends one row later, when the last one is complete.
    pub async fn run<B: Board, S: RowSink>(&mut self, board: &mut B, start: Ticks, rows: u64, sink: &mut S) {
        let clock = board.clock();
        clock.until(start).await;
        self.zero_counts = self.index_counts.unwrap_or(0);
        // The current summed before the session belongs to no row.
        board.current();
        self.gyro_released().await;
        let mut last = self.update(board, start);
        let mut row = 0;
        while row < rows {
            let due = start + TICKS_PER_ROW.saturating_mul(row.saturating_add(1));
            clock.until(due).await;
            self.gyro_released().await;
            let now = self.update(board, due);
            let between = now.at - last.at;
            self.pace.min = self.pace.min.min(between);
            self.pace.max = self.pace.max.max(between);
            let i_A = board.current().value.mean_A(&self.hardware);
            sink.row(&self.row(&last, &now, i_A, start));
            // Whole rows that were missed are left out, with their numbers.
            let missed = (now.at - due).checked_div(TICKS_PER_ROW).unwrap_or(0);
            self.sequence = self.sequence.wrapping_add(1).wrapping_add(missed as u32);
            row = row.saturating_add(1).saturating_add(missed);
            last = now;
        }
    }

    async fn gyro_released(&self) {
        if let Some(gyro) = &self.gyro {
            gyro.released().await;
        }
    }

    /// One millisecond: the encoder, the gyroscope loop, then the other readings.
    fn update<B: Board>(&mut self, board: &mut B, due: Ticks) -> Readings {
        // First, and t_k is the time of this reading: on the chip the rest takes 15 µs, in which a platform of 30 rad/s turns by 1.4
        // counts.
        let encoder = board.encoder();
        self.report = self.reports.take().unwrap_or(self.report);
        let gyro = match &self.gyro {
            Some(gyro) => gyro.update(board, &self.hardware, due, self.report.fault),
            None => GyroReading::read(board, &self.hardware, due),
        };
        self.measure(board, encoder, gyro)
    }

    /// Reads all other inputs once.
    fn measure<B: Board>(&mut self, board: &mut B, encoder: Stamped<EncoderCount>, gyro: GyroReading) -> Readings {
        let h = self.hardware;
        let now = encoder.at;
        let rate = board.rate().filter(|sample| sample.age(now) <= MAX_RATE_AGE);
        let supply = board.supply();
        let temperature = board.temperature();
        let edge = board.edge();
        let index = board.index();
        let reference_pulse = board.reference_pulse();
        self.position.take(encoder.value);
        // A captured count is less than half a wrap back.
        let unwrap = |count| self.position.counts.wrapping_sub(i64::from(encoder.value.since(count)));
        let index = index.map(|edge| (unwrap(edge.count), edge.at));
        let edge = edge.map(|edge| (unwrap(edge.count), edge.at));
        if let Some((counts, _)) = index {
            self.index_counts = Some(counts);
        }
        let turn = self.turns.update(self.position.counts, index);
        let imu = self.imu.and_then(|shared| shared.newest());
        let ages = [rate.map(|r| r.age(now)), supply.map(|r| r.age(now)), temperature.map(|r| r.age(now))];
        Readings {
            at: now,
            counts: self.position.counts,
            from_index: self.index_counts.map(|index| self.position.counts.wrapping_sub(index)),
            has_passed_index: index.is_some(),
            edge,
            turn,
            reference_pulse,
            imu: imu.map(|newest| newest.value),
            imu_age: imu.map_or(0, |newest| newest.age(now)),
            sensor_C: self.imu.and_then(|shared| shared.status().temperature_C),
            gyro,
            omega_rad_s: rate.map(|r| r.value.rad_s(&h)),
            supply_V: supply.map(|r| r.value.volts(&h)),
            temp_C: temperature.map(|r| r.value.celsius(&h)),
            age: ages.into_iter().flatten().max().unwrap_or(0),
            report: self.report,
        }
    }

    fn row(&self, k: &Readings, next: &Readings, i_A: Option<f64>, start: Ticks) -> Row {
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
            u_slope_V: next.report.duty_slope_since(&k.report) * h.volt_per_duty(),
            supply_V: k.supply_V,
            i_A,
            theta_rad: k.counts.wrapping_sub(self.zero_counts) as f64 * count_rad,
            from_index_rad: k.from_index.map(|counts| (counts as f64 + 0.5) * count_rad),
            has_passed_index: k.has_passed_index,
            edge: k.edge,
            turn: k.turn,
            reference_pulse: k.reference_pulse,
            omega_rad_s: k.omega_rad_s,
            gyro_rad_s: k.imu.and_then(|motion| motion.rate_rad_s).map(f64::from),
            accel_x_m_s2: k.imu.map(|motion| f64::from(motion.outward_m_s2)),
            accel_y_m_s2: k.imu.map(|motion| f64::from(motion.along_m_s2)),
            imu_age: k.imu_age,
            sensor_C: k.sensor_C.map(f64::from),
            angle_sensor_V: k.gyro.sample.map(|sample| sample.angle_V(h)),
            // A sample holds the current of the millisecond before it.
            torquer_A: next.gyro.sample.and_then(|sample| sample.torquer_A(h)),
            drift_mark: k.gyro.drift_mark,
            observed: k.gyro.observed,
            roll_rad: k.gyro.roll_rad,
            rate_cmd_rad_s: follows.then(|| k.report.rate_command as f64 / ONE * count_rad * CONTROL_HZ as f64),
            theta_cmd_rad: follows.then(|| (k.report.position_command_counts(k.counts) - self.zero_counts as f64) * count_rad),
            temp_C: k.temp_C,
            loop_rate_rad_s: f64::from(k.report.rate) * count_rad * CONTROL_HZ as f64,
            loop_rate_age_s: f64::from(k.report.edge_age) / h.edge_timer_Hz,
            limits: next.report.limits_since(&k.report),
            compensating: k.report.compensating,
            fault: next.report.fault,
            mode: next.report.mode,
            age: k.age,
        }
    }
}
