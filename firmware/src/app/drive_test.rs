//! Self-test with motion: encoder, direction, current, back-EMF and index at 0.5 V for 2.5 s, judged by the rows.

use crate::board::Hardware;
use crate::measurement_loop::Row;
use crate::speed_loop::{Mode, Settings};
use crate::status::Fault;
use core::cell::Cell;
use core::f64::consts::TAU;
use core::fmt::{self, Write};

/// Voltage of the test with motion, V.
pub const TEST_V: f64 = 0.5;
/// Its duration, rows. The default stand turns four times and reaches 15 rad/s.
pub const TEST_ROWS: u64 = 2_500;
/// The last rows of it, over which voltage, current and rate are averaged.
const MEAN_ROWS: u64 = 500;
/// Least motion, rad: any encoder of a stand resolves it.
const MIN_TURN_RAD: f64 = 0.1;
/// A turn in which the index must come, with a margin for the search.
const INDEX_TURN_RAD: f64 = 1.1 * TAU;
/// Range of the ratio between the rate by the encoder and the one by back-EMF: wrong counts per turn are a factor of 2 or 4, tolerances of
/// motor and resistance some 10 %.
const RATE_RATIO: (f64, f64) = (0.7, 1.4);
/// Greatest difference between the rates of both counters, relative.
const MAX_RATE_DIFFERENCE: f64 = 0.05;
/// Least current of a motor that turns, A.
const MIN_CURRENT_A: f64 = 5e-3;

/// Names of the findings with motion, from bit 0 on.
pub const IN_MOTION: [&str; 8] = [
    "no motion by the encoder",
    "encoder counts backwards",
    "no current",
    "current reversed",
    "rate does not match the voltage: counts_per_turn, motor_constant_N_m_A",
    "no index in a turn",
    "the encoder's counters of loop and measurement disagree",
    "ended by a fault or a stop",
];

/// The last of them.
const ENDED: u8 = 1 << 7;

/// Names of the set bits.
pub struct Names(pub u8, pub &'static [&'static str]);

impl fmt::Display for Names {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for (_, name) in self.1.iter().enumerate().filter(|(bit, _)| self.0 >> bit & 1 == 1) {
            write!(f, "{separator}{name}")?;
            separator = "; ";
        }
        Ok(())
    }
}

/// Sums of the test with motion.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    rows: u64,
    start_rad: f64,
    /// Time and angle at the begin of the mean.
    mean_from: (f64, f64),
    supplied_V: f64,
    current_A: f64,
    loop_rate_rad_s: f64,
    has_index: bool,
}

#[derive(Clone, Copy, Debug, Default)]
enum Phase {
    #[default]
    Idle,
    Running(Sums),
    /// Findings, and the ratio of the rates.
    Finished(u8, f64),
}

/// The test with motion.
#[derive(Debug, Default)]
pub struct DriveTest(Cell<Phase>);

impl DriveTest {
    /// The test begins with the next row in voltage mode.
    pub fn begin(&self) {
        self.0.set(Phase::Running(Sums::default()));
    }

    /// The next row; `waits`: the run is requested and has not begun. Returns the findings at the end of the test.
    pub fn row(&self, row: &Row, waits: bool, hardware: &Hardware, settings: &Settings) -> Option<u8> {
        let Phase::Running(mut sums) = self.0.get() else { return None };
        if row.mode == Mode::Voltage {
            sums.add(row, hardware);
            self.0.set(Phase::Running(sums));
            return None;
        }
        if row.mode == Mode::Off && row.fault == Fault::None && sums.rows == 0 && waits {
            return None;
        }
        let (found, ratio) = sums.evaluate(row, settings);
        self.0.set(Phase::Finished(found, ratio));
        Some(found)
    }

    /// Writes the result.
    ///
    /// # Errors
    /// The reply is full.
    pub fn write(&self, out: &mut dyn Write) -> fmt::Result {
        match self.0.get() {
            Phase::Idle => out.write_str("NONE"),
            Phase::Running(_) => out.write_str("RUNNING"),
            Phase::Finished(0, ratio) => write!(out, "PASSED,{}", crate::text::Significant(ratio, 3)),
            Phase::Finished(found, _) => write!(out, "FAILED,{}", Names(found, &IN_MOTION)),
        }
    }
}

impl Sums {
    fn add(&mut self, row: &Row, hardware: &Hardware) {
        if self.rows == 0 {
            self.start_rad = row.theta_rad;
        }
        // The index of an earlier turn is no evidence: `turn` and `from_index_rad` are kept. An index within the test moves the last one.
        self.has_index |= row.from_index_rad.is_some_and(|from_rad| from_rad.abs() < (row.theta_rad - self.start_rad).abs());
        if self.rows == TEST_ROWS - MEAN_ROWS {
            self.mean_from = (row.t_s, row.theta_rad);
        }
        if self.rows >= TEST_ROWS - MEAN_ROWS {
            let supply_share = row.supply_V.unwrap_or(hardware.supply_nominal_V) / hardware.supply_nominal_V;
            self.supplied_V += row.u_V * supply_share;
            self.current_A += row.i_A.unwrap_or(0.0);
            self.loop_rate_rad_s += row.loop_rate_rad_s;
        }
        self.rows = self.rows.saturating_add(1);
    }

    /// Findings, and rate by the encoder / rate by voltage and current; `last`: the first row without voltage.
    fn evaluate(&self, last: &Row, settings: &Settings) -> (u8, f64) {
        let rows = self.rows.saturating_sub(TEST_ROWS - MEAN_ROWS);
        if last.fault != Fault::None || rows < MEAN_ROWS - 50 {
            return (ENDED, 0.0);
        }
        let per_row = 1.0 / rows as f64;
        let turned_rad = last.theta_rad - self.start_rad;
        let rate_rad_s = (last.theta_rad - self.mean_from.1) / (last.t_s - self.mean_from.0);
        let current_A = self.current_A * per_row;
        let by_voltage_rad_s = (self.supplied_V * per_row - settings.resistance_ohm * current_A) / settings.motor_constant_N_m_A;
        let ratio = rate_rad_s / by_voltage_rad_s;
        let moved = turned_rad.abs() > MIN_TURN_RAD;
        let (least, greatest) = RATE_RATIO;
        let found = [
            !moved,
            moved && turned_rad < 0.0,
            current_A.abs() < MIN_CURRENT_A,
            current_A <= -MIN_CURRENT_A,
            moved && !(ratio.abs() >= least && ratio.abs() <= greatest),
            turned_rad.abs() > INDEX_TURN_RAD && !self.has_index,
            (self.loop_rate_rad_s * per_row - rate_rad_s).abs() > MAX_RATE_DIFFERENCE * rate_rad_s.abs(),
        ];
        (found.iter().enumerate().fold(0, |bits, (bit, is_found)| bits | u8::from(*is_found) << bit), ratio)
    }
}
