//! The task of a sensor: detects, configures and reads it, and starts again after an error.
//!
//! Every millisecond, 0.2 ms before the row, it empties the FIFO. At longer intervals it reads the chip's time together with the board's,
//! reads the temperature, and checks the identity of the chip.

use super::sample_clock::SampleClock;
use super::shared::{Shared, State};
use super::{Motion, Sample, Sensor, SensorError, Setup};
use crate::board::{Clock, Stamped, TICKS_PER_ROW, TICKS_PER_S, Ticks};

/// Interval between two attempts after an error, half a second, board clock steps.
const RETRY: u64 = TICKS_PER_S >> 1;
/// Time before a row at which the FIFO is read, board clock steps.
const BEFORE_ROW: u64 = 2_000;
/// Intervals of time pairs, temperatures and identity checks, rows.
const PAIR_ROWS: u64 = 250;
const TEMPERATURE_ROWS: u64 = 100;
const IDENTITY_ROWS: u64 = 1000;
/// After so many rows without a sample the chip counts as silent; after so many with invalid words only it is configured again.
const SILENT_ROWS: u32 = 50;
const INVALID_ROWS: u32 = 10;
/// Most samples that are read within one row; more stay in the FIFO for the next one.
const MAX_SAMPLES: usize = 8;

/// A sensor and its task.
pub struct Runner<'a, S, C> {
    sensor: S,
    clock: C,
    shared: &'a Shared,
    setup: Setup,
}

impl<'a, S: Sensor, C: Clock> Runner<'a, S, C> {
    /// The task of this sensor.
    pub fn new(sensor: S, clock: C, shared: &'a Shared) -> Self {
        shared.change(|status| status.name = sensor.name());
        Self { sensor, clock, shared, setup: Setup::default() }
    }

    /// Runs for ever.
    pub async fn run(&mut self) -> ! {
        loop {
            self.shared.change(|status| status.state = State::Starting);
            if let Err(error) = self.work().await {
                self.shared.post(None);
                self.shared.change(|status| {
                    status.state = State::Failed(error);
                    status.last_error = Some(error);
                    status.errors = status.errors.saturating_add(1);
                    status.in_force = None;
                });
                // A requested self-test also ends with this error.
                if self.shared.take_self_test_request() {
                    self.shared.finish_self_test(Err(error));
                }
                self.clock.until(self.clock.now() + RETRY).await;
            }
        }
    }

    /// Runs from detecting the chip until an error, or until a set-up or a self-test is requested.
    async fn work(&mut self) -> Result<(), SensorError> {
        self.setup = self.shared.take_setup_request().unwrap_or(self.setup);
        let detected = self.sensor.detect().await;
        self.shared.change(|status| status.name = self.sensor.name());
        detected?;
        if self.shared.take_self_test_request() {
            self.shared.change(|status| status.state = State::Testing);
            let outcome = self.sensor.self_test().await;
            self.shared.finish_self_test(outcome);
            outcome?;
        }
        let in_force = self.sensor.configure(&self.setup).await?;
        let mut chip = SampleClock::new(in_force.stamp_s);
        self.pair(&mut chip).await?;
        self.shared.change(|status| {
            status.in_force = Some(in_force);
            status.state = State::Running;
        });
        let (mut silent, mut invalid) = (0_u32, 0_u32);
        let mut row = self.clock.now().0.div_ceil(TICKS_PER_ROW).saturating_add(1);
        loop {
            self.clock.until(Ticks(row.saturating_mul(TICKS_PER_ROW).saturating_sub(BEFORE_ROW))).await;
            let (received, refused) = self.read(&chip).await?;
            silent = if received { 0 } else { silent.saturating_add(1) };
            invalid = if refused && !received {
                invalid.saturating_add(1)
            } else if received {
                0
            } else {
                invalid
            };
            if invalid >= INVALID_ROWS {
                return Err(SensorError::InvalidData("the FIFO has no valid word"));
            }
            if silent >= SILENT_ROWS {
                return Err(SensorError::Silent);
            }
            if row.is_multiple_of(PAIR_ROWS) {
                self.pair(&mut chip).await?;
            }
            if row.is_multiple_of(TEMPERATURE_ROWS) {
                let temperature_C = self.sensor.temperature_C().await?;
                self.shared.change(|status| status.temperature_C = Some(temperature_C));
            }
            if row.is_multiple_of(IDENTITY_ROWS) {
                self.sensor.identify().await?;
            }
            if self.shared.has_request() {
                self.shared.post(None);
                return Ok(());
            }
            // The next row in the future.
            let now = self.clock.now().0.saturating_add(BEFORE_ROW);
            row = row.saturating_add(1).max(now.div_ceil(TICKS_PER_ROW));
        }
    }

    /// Empties the FIFO; whether there were samples, and whether words were refused.
    async fn read(&mut self, chip: &SampleClock) -> Result<(bool, bool), SensorError> {
        let begin = self.clock.now();
        let mut samples = [Sample::default(); MAX_SAMPLES];
        let drained = self.sensor.drain(&mut samples).await?;
        let duration = self.clock.now() - begin;
        let newest = samples.get(..drained.samples).and_then(|samples| samples.last());
        if let Some((sample, at)) = newest.and_then(|sample| Some((sample, chip.at(sample.stamp)?))) {
            self.shared.post(Some(Stamped { value: Motion::from(sample), at }));
        }
        self.shared.change(|status| {
            status.samples = status.samples.saturating_add(drained.samples as u32);
            status.lost = status.lost.saturating_add(drained.lost);
            status.refused = status.refused.saturating_add(drained.refused);
            status.longest_read_s = f64::max(status.longest_read_s, duration as f64 / TICKS_PER_S as f64);
        });
        Ok((newest.is_some(), drained.refused > 0))
    }

    /// Reads the chip's time together with the board's.
    async fn pair(&mut self, chip: &mut SampleClock) -> Result<(), SensorError> {
        let stamp = self.sensor.stamp().await?;
        chip.pair(stamp.value, stamp.at);
        let relative_frequency = chip.relative_frequency();
        self.shared.change(|status| status.relative_frequency = relative_frequency);
        Ok(())
    }
}
