//! Calibration: the stand measures its own cogging and friction, without model, log or host.
//!
//! In: a stand at rest that may turn freely, and its nominal constants ([`Settings`]). Out: [`CalibrationResult`], a compensation with
//! harmonics, friction and standard errors. The platform turns in rate mode along a fixed [`Trajectory`]: until the index is found, then at
//! two rates in both directions over whole turns. The loop's voltage at each angle is the voltage that holds the rate there; its harmonics
//! are the compensation. [`Map`] holds the sums, `result.rs` evaluates them.
//!
//! The compensation in force is not changed here; the caller posts the result. [`CalibrationProgress`] shows the progress and accepts an
//! abort at any time. Without an index the calibration ends with an error.

mod map;
mod result;
mod trajectory;

pub use map::{BINS, Map};
pub use result::{CalibrationResult, MeasuredHarmonic};
pub use trajectory::{Leg, Trajectory};

use crate::board::{Board, Clock, Hardware, ROW_HZ, TICKS_PER_ROW, Ticks};
use crate::config::ConfigError;
use crate::measurement_loop::{MeasurementLoop, Row, RowSink};
use crate::profile::ProfileRunner;
use crate::session;
use crate::speed_loop::{Compensating, Fault, Limits, Mode, Settings};
use core::cell::Cell;
use core::fmt;
use embassy_futures::select::{Either, select};

/// Why a calibration has no result.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CalibrationError {
    /// The index did not come within a turn and a quarter.
    NoIndex,
    /// [`CalibrationProgress::abort`] was called.
    Aborted,
    /// A fault switched the drive off.
    Fault(Fault),
    /// The rate was not held in a measured leg: the limits in force; none if the platform turned less than commanded.
    RateNotHeld(Limits),
    /// Rows without a current.
    NoCurrent,
    /// A setting is out of its range.
    Settings(ConfigError),
}

impl fmt::Display for CalibrationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoIndex => f.write_str("no index within a turn and a quarter: check the index channel"),
            Self::Aborted => f.write_str("aborted; the compensation is unchanged"),
            Self::Fault(fault) => write!(f, "the drive was switched off: {}", fault.name()),
            Self::RateNotHeld(limits) => {
                f.write_str("the rate could not be held")?;
                let names = Limits::NAMES.iter().enumerate().filter(|(bit, _)| limits.contains(Limits(1 << bit)));
                names.enumerate().try_for_each(|(n, (_, name))| write!(f, "{} {name}", if n == 0 { "; limited by:" } else { "," }))
            }
            Self::NoCurrent => f.write_str("rows without a motor current"),
            Self::Settings(wrong) => wrong.fmt(f),
        }
    }
}

impl core::error::Error for CalibrationError {}

/// Progress of a calibration, and its abort.
#[derive(Debug, Default)]
pub struct CalibrationProgress {
    permille: Cell<u16>,
    error: Cell<Option<CalibrationError>>,
}

impl CalibrationProgress {
    /// Progress, per cent.
    pub fn percent(&self) -> f32 {
        f32::from(self.permille.get()) * 0.1
    }

    /// Aborts: the drive is off a tick later, and there is no result.
    pub fn abort(&self) {
        self.fail(CalibrationError::Aborted);
    }

    /// The reason to end, if any.
    pub fn error(&self) -> Option<CalibrationError> {
        self.error.get()
    }

    /// Resets it for the next calibration.
    pub fn restart(&self) {
        self.permille.set(0);
        self.error.set(None);
    }

    /// Ends the calibration for this reason; the first reason is kept.
    pub fn fail(&self, why: CalibrationError) {
        if self.error.get().is_none() {
            self.error.set(Some(why));
        }
    }
}

/// Runs a calibration; afterwards the drive is off. `map` is memory for the sums.
///
/// # Errors
/// Why there is no result.
pub async fn run<B: Board>(
    board: &mut B,
    runner: &mut ProfileRunner<'_>,
    measurement: &mut MeasurementLoop<'_>,
    settings: &Settings,
    map: &mut Map,
    progress: &CalibrationProgress,
) -> Result<CalibrationResult, CalibrationError> {
    let trajectory = Trajectory::new(settings).map_err(CalibrationError::Settings)?;
    let clock = board.clock();
    progress.permille.set(0);
    runner.set(trajectory.profile(), Mode::Rate);
    let mut sink = Sink { run: CalibrationRun::new(trajectory, map, settings), progress };
    let ended = select(session::run(board, runner, measurement, trajectory.rows(), &mut sink), error(&clock, progress)).await;
    if let Either::Second(why) = ended {
        runner.stop(&clock);
        return Err(why);
    }
    if let Some(why) = progress.error.get() {
        return Err(why);
    }
    progress.permille.set(1000);
    sink.run.evaluate(settings, measurement.hardware()).await
}

/// Returns the reason to end, once there is one.
async fn error<C: Clock>(clock: &C, progress: &CalibrationProgress) -> CalibrationError {
    loop {
        if let Some(why) = progress.error.get() {
            return why;
        }
        clock.until(Ticks(clock.now().0.saturating_add(TICKS_PER_ROW))).await;
    }
}

struct Sink<'a> {
    run: CalibrationRun<'a>,
    progress: &'a CalibrationProgress,
}

impl RowSink for Sink<'_> {
    fn row(&mut self, row: &Row) {
        self.run.add(row, self.progress);
    }
}

/// A running calibration: sorts the rows into the sums. For callers that run the trajectory themselves.
pub struct CalibrationRun<'a> {
    trajectory: Trajectory,
    map: &'a mut Map,
    winding_lag_s: f64,
    k: u64,
    /// The index was seen.
    has_index: bool,
}

impl<'a> CalibrationRun<'a> {
    /// Empty sums; the first row is the first one of the trajectory.
    pub fn new(trajectory: Trajectory, map: &'a mut Map, settings: &Settings) -> Self {
        map.clear();
        Self { trajectory, map, winding_lag_s: settings.compensation.winding_lag_s, k: 0, has_index: false }
    }

    /// Whether the trajectory is complete.
    pub fn is_over(&self) -> bool {
        self.k >= self.trajectory.rows()
    }

    /// Evaluates the sums; takes 0.3 s on the chip and yields in between.
    ///
    /// # Errors
    /// Why there is no result.
    pub async fn evaluate(&self, settings: &Settings, hardware: &Hardware) -> Result<CalibrationResult, CalibrationError> {
        result::evaluate(self.map, &self.trajectory, settings, hardware).await
    }

    /// Returns the memory for the sums.
    pub fn into_map(self) -> &'a mut Map {
        self.map
    }

    /// Adds the next row. A row that invalidates the calibration ends it.
    pub fn add(&mut self, row: &Row, progress: &CalibrationProgress) {
        let k = self.k;
        self.k += 1;
        let rows = self.trajectory.rows().max(1);
        progress.permille.set((k.min(rows).saturating_mul(999).checked_div(rows).unwrap_or(0)) as u16);
        if k >= rows {
            return;
        }
        if row.fault != Fault::None {
            return progress.fail(CalibrationError::Fault(row.fault));
        }
        self.has_index |= row.compensating.contains(Compensating::INDEX);
        let Some(leg) = self.trajectory.measured_leg(k) else {
            if k >= self.trajectory.search_rows() && !self.has_index {
                progress.fail(CalibrationError::NoIndex);
            }
            return;
        };
        if row.limits.0 != 0 {
            return progress.fail(CalibrationError::RateNotHeld(row.limits));
        }
        let (Some(i_A), Some(theta_cmd_rad), Some(from_index_rad)) = (row.i_A, row.theta_cmd_rad, row.from_index_rad) else {
            return progress.fail(if row.i_A.is_none() { CalibrationError::NoCurrent } else { CalibrationError::NoIndex });
        };
        // The voltage is the mean over the row that begins at this angle, and its torque comes L/R later.
        let lead_rad = leg.rate_rad_s * (0.5 / ROW_HZ as f64 + self.winding_lag_s);
        self.map.add(leg, from_index_rad + lead_rad, row.u_V, row.theta_rad - theta_cmd_rad);
        self.map.add_current(leg, row.theta_rad, i_A);
    }
}
