//! The gyroscope once in a millisecond: sample, drift measurement or observer, torquer.

use super::DriftMeasurement;
use super::observer::{ObservedState, ObserverInput, RunningObserver};
use crate::board::{Board, GyroSample, Hardware, TICKS_PER_ROW, Ticks};
use crate::status::Fault;

/// Drives the torquer by the drift measurement and the observer.
#[derive(Clone, Copy)]
pub struct GyroLoop<'a> {
    drift: &'a DriftMeasurement,
    observer: &'a RunningObserver,
}

/// Readings of one millisecond, for the row.
#[derive(Clone, Copy, Debug, Default)]
pub struct GyroReading {
    /// The sample taken at exactly that time.
    pub sample: Option<GyroSample>,
    /// Roll angle, rad.
    pub roll_rad: Option<f64>,
    /// Phase of the drift measurement: [`Commutator::mark`](super::Commutator::mark).
    pub drift_mark: u32,
    /// State that the observer estimated for that time.
    pub observed: Option<ObservedState>,
}

impl GyroReading {
    /// Readings of a board without a gyroscope loop.
    pub fn read<B: Board>(board: &mut B, hardware: &Hardware, due: Ticks) -> Self {
        let sample = board.gyro().filter(|sample| sample.at == due).map(|sample| sample.value);
        Self { sample, roll_rad: board.roll().map(|roll| roll.value.rad(hardware)), ..Self::default() }
    }
}

impl<'a> GyroLoop<'a> {
    /// A loop with this drift measurement and this observer.
    pub fn new(drift: &'a DriftMeasurement, observer: &'a RunningObserver) -> Self {
        Self { drift, observer }
    }

    /// Waits until the console, at a lower priority, holds neither the drift measurement nor the observer. [`GyroLoop::update`] then has
    /// both: the console does not run before it returns.
    pub async fn released(&self) {
        self.drift.released().await;
        self.observer.released().await;
    }

    /// At `due`, a whole millisecond: takes the sample of `due` and sets the torquer from the next millisecond on. While pulses run the
    /// torquer follows them; otherwise the observer's feedback, if it is on, replaces the correction loop.
    pub fn update<B: Board>(&self, board: &mut B, hardware: &Hardware, due: Ticks, fault: Fault) -> GyroReading {
        let sample = board.gyro();
        let roll_rad = board.roll().map(|roll| roll.value.rad(hardware));
        let correction = self.drift.update(sample, due, fault);
        let sample = sample.filter(|sample| sample.at == due).map(|sample| sample.value);
        let settings = self.observer.gyro_settings();
        let angle_V = sample.map(|sample| sample.angle_V(hardware)).filter(|volts| volts.abs() <= settings.angle_limit_V);
        let input = ObserverInput {
            due,
            angle_rad: angle_V.map(|volts| volts / settings.angle_gain_V_rad),
            roll_rad,
            limit_A: settings.torquer_limit_A,
            has_fault: fault != Fault::None,
        };
        let (observed, feedback) = self.observer.update(&input, hardware);
        let step = feedback.filter(|_| !self.drift.is_running()).unwrap_or(correction);
        self.observer.set_torquer(step);
        board.torque(due + TICKS_PER_ROW, step);
        GyroReading { sample, roll_rad, drift_mark: self.drift.mark(), observed }
    }
}
