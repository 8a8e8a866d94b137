//! Instructions between two looks at SysTick.
//!
//! With `-icount shift=10` QEMU lets 1024 ns of virtual time pass with each instruction, whatever it is, and stops at each read of
//! the timer exactly there. The timer's steps in an instruction are not taken on trust: loops of known length give them.

use core::arch::asm;
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;

/// SysTick counts down through 24 bits.
const RANGE: u32 = 1 << 24;
/// Turns of the loop that the scale is taken from; with it a rounded step of the timer is 5·10⁻⁵ instructions.
const LONG: u32 = 100_000;

/// A calibrated counter of instructions.
pub struct Meter {
    /// Timer steps of the loop of known length.
    pub steps: u32,
    /// Its instructions.
    pub instructions: u32,
    /// Timer steps between two looks with nothing between them.
    empty: u32,
}

impl Meter {
    /// Starts the timer and finds its scale.
    ///
    /// # Panics
    /// If loops of other lengths are not counted exactly: then QEMU was not started with `-icount shift=10`.
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

    /// Instructions of `work`, with the branch that calls it.
    #[inline(always)]
    pub fn count(&self, work: impl FnOnce()) -> u32 {
        self.instructions(steps(work))
    }

    /// Instructions in so many timer steps between two looks.
    fn instructions(&self, steps: u32) -> u32 {
        let net = u64::from(steps.saturating_sub(self.empty));
        let (steps, instructions) = (u64::from(self.steps), u64::from(self.instructions));
        ((net * instructions + steps / 2) / steps) as u32
    }
}

/// Timer steps that `work` takes, with the second look itself.
#[inline(always)]
fn steps(work: impl FnOnce()) -> u32 {
    let before = SYST::get_current();
    work();
    let after = SYST::get_current();
    before.wrapping_sub(after) & (RANGE - 1)
}

/// Timer steps of a loop of `n` turns of two instructions each; a function of its own, so that all lengths are the same code.
#[inline(never)]
fn steps_of(n: u32) -> u32 {
    steps(|| {
        // SAFETY: counts a register down and touches nothing else.
        unsafe { asm!("2: subs {n}, {n}, #1", "bne 2b", n = inout(reg) n => _, options(nomem, nostack)) }
    })
}
