//! What happens when the program cannot go on: the bridge is switched off, a word is said, the watchdog starts the stand anew.
//!
//! A panic's own words are not written out: formatting, messages and places of all panics that the compiler cannot rule out would take a fifth
//! of the flash. The address of the caller says as much to who has the image (`llvm-symbolizer --obj=stand 0x…`).

use crate::bridge;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicBool, Ordering};
use cortex_m_rt::{ExceptionFrame, exception};

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    let caller: u32;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, lr", out(reg) caller, options(nomem, nostack, preserves_flags)) };
    cortex_m::interrupt::disable();
    bridge::off();
    // The words themselves could be what went wrong.
    static SAID: AtomicBool = AtomicBool::new(false);
    if !SAID.swap(true, Ordering::Relaxed) {
        defmt::error!("the program cannot go on: panic near {=u32:#010x}", caller);
    }
    wait()
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    bridge::off();
    defmt::error!("the program cannot go on: hard fault at {=u32:#010x}", frame.pc());
    wait()
}

/// Until the watchdog bites; where it is not on yet, a reset ends it.
fn wait() -> ! {
    // Some seconds, so that who listens can read.
    for _ in 0..20 {
        cortex_m::asm::delay(crate::clocks::CORE_HZ / 4);
    }
    cortex_m::peripheral::SCB::sys_reset()
}
