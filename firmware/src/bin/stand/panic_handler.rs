//! Panic and hard fault: switch the bridge off, log the address over RTT, reset the chip.
//!
//! The panic's message is not formatted: formatting, messages and source locations of all panics that the compiler cannot rule out would
//! take tens of kilobytes. The caller's address identifies the source line (`llvm-symbolizer --obj=stand 0x…`).

use crate::{bridge, reset};
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m_rt::{ExceptionFrame, exception};
use stand_firmware::reset_cause::ResetCause;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    let caller: u32;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, lr", out(reg) caller, options(nomem, nostack, preserves_flags)) };
    cortex_m::interrupt::disable();
    bridge::off();
    reset::note(ResetCause::Panic);
    // Once only: the logging itself could have panicked.
    static REPORTED: AtomicBool = AtomicBool::new(false);
    if !REPORTED.swap(true, Ordering::Relaxed) {
        defmt::error!("panic near {=u32:#010x}", caller);
    }
    reset_after_delay()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    bridge::off();
    reset::note(ResetCause::HardFault);
    defmt::error!("hard fault at {=u32:#010x}", frame.pc());
    reset_after_delay()
}

/// Waits until the debug probe has read the log, then resets; the watchdog may reset earlier.
fn reset_after_delay() -> ! {
    for _ in 0..20 {
        cortex_m::asm::delay(crate::clocks::CORE_HZ / 4);
    }
    cortex_m::peripheral::SCB::sys_reset()
}
