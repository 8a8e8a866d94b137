//! Counts instructions between two reads of SysTick.
//!
//! With `-icount shift=10`, QEMU advances virtual time by 1024 ns per instruction and synchronises at each read of the timer. The number of timer
//! steps per instruction is measured with loops of known length.

use core::arch::asm;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// SysTick counts down through 24 bits.
const RANGE: u32 = 1 << 24;
/// Iterations of the calibration loop. The rounding of one timer step is then 5·10⁻⁵ instructions.
const LONG: u32 = 100_000;

/// A calibrated counter of instructions.
pub struct Meter {
    /// Timer steps of the calibration loop.
    pub steps: u32,
    /// Instructions of the calibration loop.
    pub instructions: u32,
    /// Timer steps between two consecutive reads.
    empty: u32,
}

impl Meter {
    /// Starts the timer and finds its scale.
    ///
    /// # Panics
    /// Loops of other lengths are miscounted: QEMU was not started with `-icount shift=10`.
    pub fn calibrate(mut syst: SYST) -> Self {
        syst.set_clock_source(SystClkSource::Core);
        syst.set_reload(RANGE - 1);
        syst.clear_current();
        syst.enable_counter();
        let empty = steps(|| ());
        let meter = Self { steps: steps_of(LONG) - steps_of(1), instructions: 2 * (LONG - 1), empty };
        let start = meter.instructions(steps_of(1));
        for n in [2, 3, 10, 125, 1000, 12_345] {
            let counted = meter.instructions(steps_of(n));
            assert_eq!(counted - start, 2 * (n - 1), "a loop of {n} turns; was QEMU started with -icount shift=10?");
        }
        meter
    }

    /// Instructions of `work`, including the branch that calls it.
    #[inline(always)]
    pub fn count(&self, work: impl FnOnce()) -> u32 {
        self.instructions(steps(work))
    }

    /// Converts timer steps between two reads to instructions.
    fn instructions(&self, steps: u32) -> u32 {
        let net = u64::from(steps.saturating_sub(self.empty));
        let (steps, instructions) = (u64::from(self.steps), u64::from(self.instructions));
        ((net * instructions + steps / 2) / steps) as u32
    }
}

/// Timer steps that `work` takes, including the second read.
#[inline(always)]
fn steps(work: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    work();
    let after = SYST::get_current();
    before.wrapping_sub(after) & (RANGE - 1)
}

/// Timer steps of a loop of `n` iterations of two instructions. Not inlined, so that every length runs identical code.
#[inline(never)]
fn steps_of(n: u32) -> u32 {
    steps(|| {
        // SAFETY: decrements one register and has no other effect.
        unsafe { asm!("2: subs {n}, {n}, #1", "bne 2b", n = inout(reg) n => _, options(nomem, nostack)) }
    })
}
