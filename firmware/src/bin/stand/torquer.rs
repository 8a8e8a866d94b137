//! The torquer of the gyroscope on DAC1. The control interrupt writes its value and samples the angle sensor at the same time.
//!
//! A task sets the value and the tick from which it acts ([`TimedOutput`]). The interrupt writes it and stores the number of the ADC sweep
//! in progress.

use crate::analog;
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::pac::DAC1;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{GyroSample, Stamped, TICKS_PER_CONTROL, Ticks, TorquerStep};
use stand_firmware::gyro_loop::TimedOutput;

/// Code of zero torquer current: the middle of the converter's range.
const ZERO_CODE: u16 = 2048;
static OUTPUT: TimedOutput = TimedOutput::new();

/// Starts the converter with zero current.
pub fn start(dac: Peri<'static, peripherals::DAC1>, pin: Peri<'static, peripherals::PA4>) {
    let mut torquer = DacChannel::new_blocking(dac, pin);
    torquer.set(Value::Bit12Right(ZERO_CODE));
    torquer.enable();
    // Dropping the channel would switch it off.
    core::mem::forget(torquer);
}

/// Writes a value that is due. Called in each tick.
#[inline]
pub fn on_tick(tick: u32) {
    if let Some(value) = OUTPUT.take(tick) {
        DAC1.dhr12r(0).write(|w| w.set_dhr(value));
        OUTPUT.set_sweep(analog::sweep_in_progress() as u32);
    }
}

/// Access of the tasks to the torquer.
#[derive(Default)]
pub struct Torquer {
    /// ADC sweep of the previous sample.
    since: usize,
    newest: Option<Stamped<GyroSample>>,
}

impl Torquer {
    /// Sets the output from the tick of `at` on.
    pub fn set_output(&mut self, at: Ticks, step: TorquerStep) {
        let value = ZERO_CODE.saturating_add_signed(step.0).min(2 * ZERO_CODE - 1);
        OUTPUT.set(tick_of(at), value);
    }

    /// The sample of the last tick in which an output was written; `now` gives the high word of the tick's number.
    pub fn sample(&mut self, now: Ticks) -> Option<Stamped<GyroSample>> {
        if let Some((sweep, taken)) = OUTPUT.take_sweep() {
            let sweep = sweep as usize;
            let value = analog::gyro_sample(self.since, sweep);
            self.since = sweep;
            let ago = tick_of(now).wrapping_sub(taken);
            let ticks = (now.0 / TICKS_PER_CONTROL).saturating_sub(u64::from(ago));
            self.newest = Some(Stamped { value, at: Ticks::of_control(ticks) });
        }
        self.newest
    }
}

fn tick_of(t: Ticks) -> u32 {
    (t.0 / TICKS_PER_CONTROL) as u32
}
