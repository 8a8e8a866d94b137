//! What the measurement says of itself while it runs: turns, stability, timing, drive, sensor.
//!
//! In: rows, as a [`RowSink`]. Out: small plain readings, at any moment. It is shared between the rows' end and whoever asks (the console)
//! on one thread; nobody holds it across a wait, so neither finds it taken.

use super::drive::{Drive, DriveReading};
use super::sensor::{Sensor, SensorReading};
use super::stability::{Stability, StabilityReading};
use super::timing::{Timing, TimingReading};
use super::turn::{TurnReading, Turns};
use super::windows::Windows;
use super::{Row, RowSink};
use crate::board::Hardware;
use core::cell::RefCell;

/// The instruments of one measurement loop; some 6 KiB.
pub struct Instruments {
    inner: RefCell<Inner>,
}

struct Inner {
    hardware: Hardware,
    now_s: f64,
    turns: Turns,
    stability: Stability,
    timing: Timing,
    windows: Windows,
    drive: Drive,
    sensor: Sensor,
}

impl Instruments {
    /// Nothing measured yet.
    pub fn new(hardware: Hardware) -> Self {
        Self {
            inner: RefCell::new(Inner {
                hardware,
                now_s: 0.0,
                turns: Turns::new(hardware),
                stability: Stability::new(&hardware),
                timing: Timing::default(),
                windows: Windows::default(),
                drive: Drive::default(),
                sensor: Sensor::default(),
            }),
        }
    }

    /// Takes a row.
    pub fn take(&self, row: &Row) {
        let Ok(mut inner) = self.inner.try_borrow_mut() else { return };
        let inner = &mut *inner;
        inner.now_s = row.at.seconds();
        inner.timing.take(row.sequence, row.at);
        if let Some((counts, at)) = row.edge {
            inner.stability.edge(counts, at);
        }
        if let Some(turn) = row.turn.filter(|turn| inner.turns.take(*turn)) {
            inner.stability.turn(&turn, &inner.hardware);
        }
        if let Some(window) = inner.windows.take(row) {
            inner.drive.take(&window);
            inner.sensor.take(&window);
        }
    }

    /// The last whole turn, and the mean rate over the last `over`; `None` before the first.
    pub fn turn(&self, over: u32) -> Option<TurnReading> {
        self.inner.try_borrow().ok().and_then(|inner| inner.turns.reading(over, inner.now_s))
    }

    /// How steadily the platform turned over windows of 1°, 10° and 360° since the last restart.
    pub fn stability(&self) -> [StabilityReading; 3] {
        self.inner.try_borrow().map(|inner| inner.stability.readings()).unwrap_or_default()
    }

    /// How evenly the rows come.
    pub fn timing(&self) -> TimingReading {
        self.inner.try_borrow().map(|inner| inner.timing.reading()).unwrap_or_default()
    }

    /// The drive's constants; `None` before there is enough motion to say anything.
    pub fn drive(&self) -> Option<DriveReading> {
        self.inner.try_borrow().ok().and_then(|inner| inner.drive.reading())
    }

    /// The rate sensor's scale, bias and delay: the gyro under test, or the board's rate sensor where there is none.
    pub fn sensor(&self) -> Option<SensorReading> {
        self.inner.try_borrow().ok().and_then(|inner| inner.sensor.reading())
    }

    /// Forgets the statistics of the rate. For a new command.
    pub fn restart_stability(&self) {
        if let Ok(mut inner) = self.inner.try_borrow_mut() {
            inner.stability.restart();
        }
    }

    /// Forgets the statistics of the rows' times.
    pub fn restart_timing(&self) {
        if let Ok(mut inner) = self.inner.try_borrow_mut() {
            inner.timing.restart();
        }
    }

    /// Forgets what was learnt of the drive. For another load, or a winding that has warmed.
    pub fn restart_drive(&self) {
        if let Ok(mut inner) = self.inner.try_borrow_mut() {
            inner.drive.restart();
        }
    }

    /// Forgets what was learnt of the sensor. For another sensor or range.
    pub fn restart_sensor(&self) {
        if let Ok(mut inner) = self.inner.try_borrow_mut() {
            inner.sensor.restart();
        }
    }
}

impl RowSink for &Instruments {
    fn row(&mut self, row: &Row) {
        self.take(row);
    }
}
