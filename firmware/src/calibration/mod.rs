//! The stand measures its own cogging and friction: no model, no log, no host.
//!
//! In: a stand at rest that may turn freely, its nominal constants ([`Settings`]). Out: [`Found`], a compensation with the orders that are
//! there and the friction, and how sure it is. The platform turns in rate mode along a fixed [`Course`]: until the index was seen, then
//! slowly and faster, each forwards and backwards over whole turns. What the loop asks of the motor at each angle is what holds the rate there,
//! so its harmonics *are* the compensation; the sums are in [`Map`], the answer is worked out in `answer.rs`.
//!
//! Promises: the compensation in force is never touched here. Who calls posts what was found, or nothing. [`Watch`] shows the progress and
//! takes an abort at any moment; without an index nothing is measured and that is said.

mod answer;
mod course;
mod map;

pub use answer::{Found, FoundHarmonic};
pub use course::{Course, Leg};
pub use map::{BINS, Map};

use crate::board::{Board, Clock, Hardware, ROW_HZ, TICKS_PER_ROW, Ticks};
use crate::config::ConfigError;
use crate::measurement_loop::{MeasurementLoop, Row, RowSink};
use crate::profile::ProfileRunner;
use crate::session;
use crate::speed_loop::{Compensating, Fault, Limits, Mode, Settings};
use core::cell::Cell;
use core::fmt;
use embassy_futures::select::{Either, select};

/// Why nothing was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refused {
    /// The platform turned more than a turn and the index did not come.
    NoIndex,
    /// [`Watch::abort`] was called.
    Aborted,
    /// The drive was switched off on the way.
    Fault(Fault),
    /// The rate was not held in a leg that was measured: the limits in force there; none where the platform turned less than it was asked to.
    NotHeld(Limits),
    /// The stand has no current's sensor, or it lost readings.
    NoCurrent,
    /// A setting cannot be worked with.
    Settings(ConfigError),
}

impl fmt::Display for Refused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoIndex => f.write_str("the index did not come within a turn and a quarter: without it an angle has no zero"),
            Self::Aborted => f.write_str("aborted; the compensation is as it was"),
            Self::Fault(fault) => write!(f, "the drive was switched off: {}", fault.name()),
            Self::NotHeld(limits) => {
                f.write_str("the rate could not be held")?;
                let names = Limits::NAMES.iter().enumerate().filter(|(bit, _)| limits.contains(Limits(1 << bit)));
                names.enumerate().try_for_each(|(n, (_, name))| write!(f, "{} {name}", if n == 0 { "; limited by:" } else { "," }))
            }
            Self::NoCurrent => f.write_str("the motor current was not measured in every row"),
            Self::Settings(wrong) => wrong.fmt(f),
        }
    }
}

impl core::error::Error for Refused {}

/// How far it is, and the way to end it; shared with whoever shows the one and decides the other.
#[derive(Debug, Default)]
pub struct Watch {
    permille: Cell<u16>,
    refused: Cell<Option<Refused>>,
}

impl Watch {
    /// Done so far, per cent.
    pub fn percent(&self) -> f32 {
        f32::from(self.permille.get()) * 0.1
    }

    /// Ends it; the drive is off a tick later and nothing is learnt.
    pub fn abort(&self) {
        self.refuse(Refused::Aborted);
    }

    /// Why it is to end, if it is.
    pub fn refused(&self) -> Option<Refused> {
        self.refused.get()
    }

    /// For the next time.
    pub fn restart(&self) {
        self.permille.set(0);
        self.refused.set(None);
    }

    /// Ends it for this reason, unless there was another before.
    #[inline(never)]
    pub fn refuse(&self, why: Refused) {
        if self.refused.get().is_none() {
            self.refused.set(Some(why));
        }
    }
}

/// Turns, measures and answers. `runner` may be any that posts orders; afterwards it holds still. `map` is the caller's room for the sums.
///
/// # Errors
/// Why nothing was found; the drive is off then, too.
pub async fn run<B: Board>(
    board: &mut B,
    runner: &mut ProfileRunner<'_>,
    measurement: &mut MeasurementLoop<'_>,
    settings: &Settings,
    map: &mut Map,
    watch: &Watch,
) -> Result<Found, Refused> {
    let course = Course::usual(settings).map_err(Refused::Settings)?;
    let clock = board.clock();
    watch.permille.set(0);
    runner.set(course.profile(), Mode::Rate);
    let mut sink = Sink { measuring: Measuring::new(course, map, settings), watch };
    let ended = select(session::run(board, runner, measurement, course.rows(), &mut sink), refused(&clock, watch)).await;
    if let Either::Second(why) = ended {
        runner.stop(&clock);
        return Err(why);
    }
    if let Some(why) = watch.refused.get() {
        return Err(why);
    }
    watch.permille.set(1000);
    sink.measuring.answer(settings, measurement.hardware()).await
}

/// Returns when there is a reason to end.
async fn refused<C: Clock>(clock: &C, watch: &Watch) -> Refused {
    loop {
        if let Some(why) = watch.refused.get() {
            return why;
        }
        clock.until(Ticks(clock.now().0.saturating_add(TICKS_PER_ROW))).await;
    }
}

struct Sink<'a> {
    measuring: Measuring<'a>,
    watch: &'a Watch,
}

impl RowSink for Sink<'_> {
    fn row(&mut self, row: &Row) {
        self.measuring.row(row, self.watch);
    }
}

/// The sums of a calibration under way: puts each row where it belongs. For who runs the course himself.
pub struct Measuring<'a> {
    course: Course,
    map: &'a mut Map,
    winding_lag_s: f64,
    k: u64,
    /// The index was seen, by the row.
    seen: bool,
}

impl<'a> Measuring<'a> {
    /// No sums yet; the first row is to be the one in which the course begins.
    pub fn new(course: Course, map: &'a mut Map, settings: &Settings) -> Self {
        map.clear();
        Self { course, map, winding_lag_s: settings.compensation.winding_lag_s, k: 0, seen: false }
    }

    /// Whether the course is over.
    pub fn is_over(&self) -> bool {
        self.k >= self.course.rows()
    }

    /// Works the answer out: a third of a second of the chip's time, in pieces, between which others run.
    ///
    /// # Errors
    /// Why nothing was found.
    pub async fn answer(&self, settings: &Settings, hardware: &Hardware) -> Result<Found, Refused> {
        answer::answer(self.map, &self.course, settings, hardware).await
    }

    /// Gives the room for the sums back.
    pub fn into_map(self) -> &'a mut Map {
        self.map
    }

    /// Takes the next row; what makes the calibration void is told to `watch`.
    pub fn row(&mut self, row: &Row, watch: &Watch) {
        let k = self.k;
        self.k += 1;
        let rows = self.course.rows().max(1);
        watch.permille.set((k.min(rows).saturating_mul(999).checked_div(rows).unwrap_or(0)) as u16);
        if k >= rows {
            return;
        }
        if row.fault != Fault::None {
            return watch.refuse(Refused::Fault(row.fault));
        }
        self.seen |= row.compensating.contains(Compensating::INDEX);
        let Some(leg) = self.course.measured(k) else {
            if k >= self.course.seek_rows() && !self.seen {
                watch.refuse(Refused::NoIndex);
            }
            return;
        };
        if row.limits.0 != 0 {
            return watch.refuse(Refused::NotHeld(row.limits));
        }
        let (Some(i_A), Some(theta_cmd_rad), Some(from_index_rad)) = (row.i_A, row.theta_cmd_rad, row.from_index_rad) else {
            return watch.refuse(if row.i_A.is_none() { Refused::NoCurrent } else { Refused::NoIndex });
        };
        // The voltage is a mean over the row that begins at the angle, and its torque comes L/R later still.
        let on_rad = leg.rate_rad_s * (0.5 / ROW_HZ as f64 + self.winding_lag_s);
        self.map.take(leg, from_index_rad + on_rad, row.u_V, row.theta_rad - theta_cmd_rad);
        self.map.take_current(leg, row.theta_rad, i_A);
    }
}
