//! Instruments: online evaluation of the rows (turns, stability, timing, drive, sensor, clock).
//!
//! In: rows, as a [`RowSink`]. Out: readings, at any time. Shared between the measurement and the console on one thread; neither holds it
//! across a wait.

use super::clock_reference::{ClockReading, CrystalComparison};
use super::drive_estimate::{DriveEstimator, DriveReading};
use super::sensor_estimate::{SensorEstimator, SensorReading};
use super::stability::{Stability, StabilityReading};
use super::timing::{Timing, TimingReading};
use super::turn::{TurnReading, Turns};
use super::windows::Windows;
use super::{Row, RowSink};
use crate::board::Hardware;
use core::cell::RefCell;

/// The instruments of one measurement loop, 6 KiB.
pub struct Instruments {
    state: RefCell<InstrumentState>,
}

struct InstrumentState {
    hardware: Hardware,
    now_s: f64,
    turns: Turns,
    stability: Stability,
    timing: Timing,
    windows: Windows,
    drive: DriveEstimator,
    sensor: SensorEstimator,
    clock: CrystalComparison,
}

impl Instruments {
    /// No rows yet.
    pub fn new(hardware: Hardware) -> Self {
        Self {
            state: RefCell::new(InstrumentState {
                hardware,
                now_s: 0.0,
                turns: Turns::new(hardware),
                stability: Stability::new(&hardware),
                timing: Timing::default(),
                windows: Windows::default(),
                drive: DriveEstimator::default(),
                sensor: SensorEstimator::default(),
                clock: CrystalComparison::new(hardware.edge_timer_Hz as u32),
            }),
        }
    }

    /// Adds a row.
    pub fn add(&self, row: &Row) {
        let Ok(mut state) = self.state.try_borrow_mut() else { return };
        let state = &mut *state;
        state.now_s = row.at.seconds();
        state.timing.add(row.sequence, row.at);
        if let Some((counts, at)) = row.edge {
            state.stability.edge(counts, at);
        }
        if let Some(turn) = row.turn.filter(|turn| state.turns.update(*turn)) {
            state.stability.turn(&turn, &state.hardware);
        }
        if let Some(at) = row.reference_pulse {
            state.clock.add(at);
        }
        if let Some(window) = state.windows.update(row) {
            state.drive.add(&window);
            state.sensor.add(&window);
        }
    }

    /// The last whole turn, and the mean rate over the last `over` turns; `None` before the first.
    pub fn turn(&self, over: u32) -> Option<TurnReading> {
        self.state.try_borrow().ok().and_then(|state| state.turns.reading(over, state.now_s))
    }

    /// Rate stability over windows of 1°, 10° and 360° since the last restart.
    pub fn stability(&self) -> [StabilityReading; 3] {
        self.state.try_borrow().map(|state| state.stability.readings()).unwrap_or_default()
    }

    /// Timing of the rows.
    pub fn timing(&self) -> TimingReading {
        self.state.try_borrow().map(|state| state.timing.reading()).unwrap_or_default()
    }

    /// The drive's constants; `None` before there is enough motion.
    pub fn drive(&self) -> Option<DriveReading> {
        self.state.try_borrow().ok().and_then(|state| state.drive.reading())
    }

    /// Scale, bias and delay of the sensor under test, or of the stand's rate sensor if there is none.
    pub fn sensor(&self) -> Option<SensorReading> {
        self.state.try_borrow().ok().and_then(|state| state.sensor.reading())
    }

    /// The crystal compared with the clock reference since the last restart.
    pub fn clock(&self) -> ClockReading {
        self.state.try_borrow().map(|state| state.clock.reading()).unwrap_or_default()
    }

    /// Restarts the comparison with the clock reference.
    pub fn restart_clock(&self) {
        if let Ok(mut state) = self.state.try_borrow_mut() {
            state.clock.restart();
        }
    }

    /// Restarts the rate stability, for a new command.
    pub fn restart_stability(&self) {
        if let Ok(mut state) = self.state.try_borrow_mut() {
            state.stability.restart();
        }
    }

    /// Restarts the timing.
    pub fn restart_timing(&self) {
        if let Ok(mut state) = self.state.try_borrow_mut() {
            state.timing.restart();
        }
    }

    /// Restarts the drive's estimates, for another load or winding temperature.
    pub fn restart_drive(&self) {
        if let Ok(mut state) = self.state.try_borrow_mut() {
            state.drive.restart();
        }
    }

    /// Restarts the sensor's estimates, for another sensor or range.
    pub fn restart_sensor(&self) {
        if let Ok(mut state) = self.state.try_borrow_mut() {
            state.sensor.restart();
        }
    }
}

impl RowSink for &Instruments {
    fn row(&mut self, row: &Row) {
        self.add(row);
    }
}
