//! A session runs a profile and measures it for a given time.
//!
//! In: the board, the profile and the measurement loop. Out: rows into a sink. The board calls the control interrupt. A session begins at
//! the first whole millisecond that is at least one millisecond ahead, so that the speed loop has its first segment in time, and ends with
//! the drive off.

use crate::board::{Board, Clock, ROW_HZ, TICKS_PER_ROW, Ticks};
use crate::measurement_loop::{MeasurementLoop, RowSink};
use crate::profile::ProfileRunner;
use embassy_futures::join::join;

/// Runs `profile` for `rows` milliseconds and measures the same number of rows into `sink`; returns the board time of row 0.
pub async fn run<B: Board, S: RowSink>(
    board: &mut B,
    profile: &mut ProfileRunner<'_>,
    measurement: &mut MeasurementLoop<'_>,
    rows: u64,
    sink: &mut S,
) -> Ticks {
    let clock = board.clock();
    let start = next_start(clock.now());
    join(profile.run(&clock, start, rows), measurement.run(board, start, rows, sink)).await;
    start
}

/// The first whole millisecond that is at least one millisecond ahead of `now`.
pub(crate) fn next_start(now: Ticks) -> Ticks {
    let whole = now.0.div_ceil(TICKS_PER_ROW).saturating_add(1);
    Ticks(whole.saturating_mul(TICKS_PER_ROW))
}

/// Number of rows in a duration, s.
pub fn rows_in(seconds: f64) -> u64 {
    libm::round(seconds * ROW_HZ as f64) as u64
}
