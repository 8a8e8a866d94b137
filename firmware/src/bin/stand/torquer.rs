//! The gyro's torquer: a converter that takes its next value in the control interrupt, in the same moment in which the angle sensor is sampled.
//!
//! A task says what is given from which tick on ([`TimedOutput`]); the interrupt, paced by TIM1 above all else, writes it and remembers the sweep of the
//! converters that is under way.

use crate::analog;
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::pac::DAC1;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{GyroSample, Stamped, TICKS_PER_CONTROL, Ticks, TorquerStep};
use stand_firmware::gyro_loop::TimedOutput;

/// The middle of the converter's range: the amplifier gives no current.
const MIDDLE: u16 = 2048;
static OUTPUT: TimedOutput = TimedOutput::new();

/// No current, until a task asks for some.
pub fn start(dac: Peri<'static, peripherals::DAC1>, pin: Peri<'static, peripherals::PA4>) {
    let mut torquer = DacChannel::new_blocking(dac, pin);
    torquer.set(Value::Bit12Right(MIDDLE));
    torquer.enable();
    // Dropped it would be switched off.
    core::mem::forget(torquer);
}

/// In each tick: what is due is given.
#[inline]
pub fn on_tick(tick: u32) {
    if let Some(value) = OUTPUT.take(tick) {
        DAC1.dhr12r(0).write(|w| w.set_dhr(value));
        OUTPUT.set_sweep(analog::under_way() as u32);
    }
}

/// The tasks' end.
#[derive(Default)]
pub struct Torquer {
    /// The sweep of the sample before.
    since: usize,
    newest: Option<Stamped<GyroSample>>,
}

impl Torquer {
    /// From the tick of `at` on the torquer is given this.
    pub fn give(&mut self, at: Ticks, step: TorquerStep) {
        let value = MIDDLE.saturating_add_signed(step.0).min(2 * MIDDLE - 1);
        OUTPUT.set(tick_of(at), value);
    }

    /// The sample of the last tick in which something was given; `now` tells the high word of its number.
    pub fn sample(&mut self, now: Ticks) -> Option<Stamped<GyroSample>> {
        if let Some((sweep, taken)) = OUTPUT.take_sweep() {
            let sweep = sweep as usize;
            let value = analog::gyro(self.since, sweep);
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
