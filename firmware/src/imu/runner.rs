//! Keeps a sensor going for ever: finds it, sets it up, reads it, begins again where it fails.
//!
//! Each millisecond, a fifth of one before the row, it empties the FIFO; between, it pairs the chip's time with the board's, reads the
//! temperature, looks whether the chip is still itself. Whoever polls [`Runner::run`] decides where that happens; it ends never.

use super::sample_clock::SampleClock;
use super::shared::{Shared, State};
use super::{Motion, Sample, Sensor, Setup, Trouble};
use crate::board::{Clock, Stamped, TICKS_PER_ROW, TICKS_PER_S, Ticks};

/// Between two tries to find the chip.
const RETRY: u64 = TICKS_PER_S >> 1;
/// How long before a row the FIFO is read, board clock steps.
const BEFORE_ROW: u64 = 2_000;
/// Rows between two pairs of times, two temperatures, two looks at the name; shifted, so that they do not fall together.
const PAIR_ROWS: u64 = 250;
const TEMPERATURE_ROWS: u64 = 100;
const NAME_ROWS: u64 = 1000;
/// Rows without a sample after which the chip is silent, and with nothing but rubbish after which it is set up anew.
const SILENT_ROWS: u32 = 50;
const RUBBISH_ROWS: u32 = 10;
/// Samples read at once.
const AT_ONCE: usize = 8;

/// A sensor and its task.
pub struct Runner<'a, S, C> {
    sensor: S,
    clock: C,
    shared: &'a Shared,
    setup: Setup,
}

impl<'a, S: Sensor, C: Clock> Runner<'a, S, C> {
    /// A task for this sensor.
    pub fn new(sensor: S, clock: C, shared: &'a Shared) -> Self {
        shared.change(|status| status.name = S::NAME);
        Self { sensor, clock, shared, setup: Setup::default() }
    }

    /// Runs for ever.
    pub async fn run(&mut self) -> ! {
        loop {
            self.shared.change(|status| status.state = State::Starting);
            if let Err(trouble) = self.work().await {
                self.shared.post(None);
                self.shared.change(|status| {
                    status.state = State::Failed(trouble);
                    status.last_trouble = Some(trouble);
                    status.troubles = status.troubles.saturating_add(1);
                    status.in_force = None;
                });
                // A test that was asked for has its answer, too.
                if self.shared.take_test() {
                    self.shared.answer_test(Err(trouble));
                }
                self.clock.until(self.clock.now() + RETRY).await;
            }
        }
    }

    /// From finding the chip until something fails, or another set-up or a test is asked for.
    async fn work(&mut self) -> Result<(), Trouble> {
        self.setup = self.shared.take_setup().unwrap_or(self.setup);
        self.sensor.identify().await?;
        if self.shared.take_test() {
            self.shared.change(|status| status.state = State::Testing);
            let outcome = self.sensor.self_test().await;
            self.shared.answer_test(outcome);
            outcome?;
        }
        let in_force = self.sensor.configure(&self.setup).await?;
        let mut chip = SampleClock::new(in_force.stamp_s);
        self.pair(&mut chip).await?;
        self.shared.change(|status| {
            status.in_force = Some(in_force);
            status.state = State::Running;
        });
        let (mut without, mut rubbish) = (0_u32, 0_u32);
        let mut row = self.clock.now().0.div_ceil(TICKS_PER_ROW).saturating_add(1);
        loop {
            self.clock.until(Ticks(row.saturating_mul(TICKS_PER_ROW).saturating_sub(BEFORE_ROW))).await;
            let (came, refused) = self.read(&chip).await?;
            without = if came { 0 } else { without.saturating_add(1) };
            rubbish = if refused && !came {
                rubbish.saturating_add(1)
            } else if came {
                0
            } else {
                rubbish
            };
            if rubbish >= RUBBISH_ROWS {
                return Err(Trouble::Rubbish("the FIFO holds no word that could be one"));
            }
            if without >= SILENT_ROWS {
                return Err(Trouble::Silent);
            }
            if row.is_multiple_of(PAIR_ROWS) {
                self.pair(&mut chip).await?;
            }
            if row.is_multiple_of(TEMPERATURE_ROWS) {
                let temperature_C = self.sensor.temperature_C().await?;
                self.shared.change(|status| status.temperature_C = Some(temperature_C));
            }
            if row.is_multiple_of(NAME_ROWS) {
                self.sensor.identify().await?;
            }
            if self.shared.setup_or_test_wanted() {
                self.shared.post(None);
                return Ok(());
            }
            // The next row that is still to come.
            let now = self.clock.now().0.saturating_add(BEFORE_ROW);
            row = row.saturating_add(1).max(now.div_ceil(TICKS_PER_ROW));
        }
    }

    /// Empties the FIFO: whether samples came, and whether words were refused.
    async fn read(&mut self, chip: &SampleClock) -> Result<(bool, bool), Trouble> {
        let begin = self.clock.now();
        let mut samples = [Sample::default(); AT_ONCE];
        let drained = self.sensor.drain(&mut samples).await?;
        let took = self.clock.now() - begin;
        let newest = samples.get(..drained.samples).and_then(|samples| samples.last());
        if let Some((sample, at)) = newest.and_then(|sample| Some((sample, chip.at(sample.stamp)?))) {
            self.shared.post(Some(Stamped { value: Motion::from(sample), at }));
        }
        self.shared.change(|status| {
            status.samples = status.samples.saturating_add(drained.samples as u32);
            status.lost = status.lost.saturating_add(drained.lost);
            status.refused = status.refused.saturating_add(drained.refused);
            status.longest_reading_s = crate::maths::greater(status.longest_reading_s, took as f64 / TICKS_PER_S as f64);
        });
        Ok((newest.is_some(), drained.refused > 0))
    }

    /// Reads the chip's time with the board's beside it.
    async fn pair(&mut self, chip: &mut SampleClock) -> Result<(), Trouble> {
        let before = self.clock.now();
        let stamp = self.sensor.stamp().await?;
        let after = self.clock.now();
        chip.pair(stamp, before + ((after - before) >> 1));
        let relative_pace = chip.relative_pace();
        self.shared.change(|status| status.relative_pace = relative_pace);
        Ok(())
    }
}
