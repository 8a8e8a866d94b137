//! The gyro's torquer: a converter that takes its next value in the control interrupt, in the same moment in which the angle sensor is sampled.
//!
//! A task says what is given from which tick on; the interrupt, paced by TIM1 above all else, writes it and remembers the sweep of the converters
//! that is under way. So pulse edges, samples and ticks have one timer, whatever the tasks do in between.

use crate::analog;
use core::sync::atomic::{AtomicU32, Ordering};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::pac::DAC1;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{GyroSample, Stamped, TICKS_PER_CONTROL, Ticks, TorquerStep};

/// The middle of the converter's range: the amplifier gives no current.
const MIDDLE: u16 = 2048;
/// Nothing is asked for.
const NONE: u32 = u32::MAX;

/// What is given next, and from which tick on (low word).
static NEXT: AtomicU32 = AtomicU32::new(NONE);
static DUE: AtomicU32 = AtomicU32::new(0);
/// The tick that took it (low word), and the sweep that was under way then.
static TAKEN: AtomicU32 = AtomicU32::new(0);
static SWEEP: AtomicU32 = AtomicU32::new(NONE);

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
    let next = NEXT.load(Ordering::Relaxed);
    // What is late is given at once; its sample shows it.
    if next != NONE && tick.wrapping_sub(DUE.load(Ordering::Relaxed)) < u32::MAX / 2 {
        DAC1.dhr12r(0).write(|w| w.set_dhr(next as u16));
        TAKEN.store(tick, Ordering::Relaxed);
        SWEEP.store(analog::under_way() as u32, Ordering::Relaxed);
        NEXT.store(NONE, Ordering::Relaxed);
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
        DUE.store(tick_of(at), Ordering::Relaxed);
        NEXT.store(u32::from(value), Ordering::Relaxed);
    }

    /// The sample of the last tick in which something was given; `now` tells the high word of its number.
    pub fn sample(&mut self, now: Ticks) -> Option<Stamped<GyroSample>> {
        let sweep = SWEEP.swap(NONE, Ordering::Relaxed);
        if sweep != NONE {
            let sweep = sweep as usize;
            let value = analog::gyro(self.since, sweep);
            self.since = sweep;
            let ago = tick_of(now).wrapping_sub(TAKEN.load(Ordering::Relaxed));
            let ticks = (now.0 / TICKS_PER_CONTROL).saturating_sub(u64::from(ago));
            self.newest = Some(Stamped { value, at: Ticks::of_control(ticks) });
        }
        self.newest
    }
}

fn tick_of(t: Ticks) -> u32 {
    (t.0 / TICKS_PER_CONTROL) as u32
}
