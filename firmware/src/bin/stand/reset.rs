//! Reset: its cause at start-up, resets by the program, and the supplies and clocks that the chip itself watches.
//!
//! Clock security system: when the 8 MHz of the ST-Link stop, the chip changes to its internal oscillator and raises the NMI (RM0390
//! §6.2.7). The clocks of bridge, tick and serial line are wrong from then on. Voltage detector: below 2.9 V of its own supply the chip
//! raises an interrupt (RM0390 §5.2.2), long before the logic fails at 1.7 V. Both switch the bridge off and reset the chip with a note of
//! the cause.

use crate::bridge;
use core::mem::MaybeUninit;
use cortex_m_rt::exception;
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::{EXTI, FLASH, PWR, RCC};
use stand_firmware::reset_cause::ResetCause;

/// The note survives a reset: the start-up code does not initialise this section.
#[unsafe(link_section = ".uninit.RESET_NOTE")]
static mut NOTE: MaybeUninit<u32> = MaybeUninit::uninit();

/// EXTI line of the voltage detector (RM0390 §10.2.5).
const VOLTAGE_DETECTOR_LINE: usize = 16;
/// Threshold of the voltage detector: 2.9 V falling (RM0390 §5.4.1; DS10693 table 23).
const VOLTAGE_DETECTOR_LEVEL: u8 = 7;
/// BOR_LEV of option bytes without a brown-out level; the chip is then reset below 1.7 V only.
const NO_BROWN_OUT_LEVEL: u8 = 3;

/// Cause of the last reset. Clears its flags and the note: to be called once.
pub fn take_cause() -> ResetCause {
    let note = &raw mut NOTE;
    // SAFETY: any bits are a u32; only this function and `reset`, which does not return, access the note.
    let value = unsafe { note.cast::<u32>().read_volatile() };
    // SAFETY: as above.
    unsafe { note.cast::<u32>().write_volatile(0) };
    let cause = ResetCause::of_flags(RCC.csr().read().0, value);
    RCC.csr().modify(|w| w.set_rmvf(true));
    cause
}

/// Notes the cause. The reset follows at once, or the watchdog's.
pub fn note(cause: ResetCause) {
    // SAFETY: a plain store; the note is read after the reset only.
    unsafe { (&raw mut NOTE).cast::<u32>().write_volatile(cause.note()) };
}

/// Switches the bridge off and resets the chip.
pub fn reset(cause: ResetCause) -> ! {
    bridge::off();
    note(cause);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Starts the clock security system and the voltage detector, and warns if the brown-out level is not set in the option bytes. The program
/// does not write option bytes: a supply that fails meanwhile can lock the chip.
pub fn watch_supplies() {
    if RCC.cr().read().hseon() {
        RCC.cr().modify(|w| w.set_csson(true));
    }
    RCC.apb1enr().modify(|w| w.set_pwren(true));
    PWR.cr1().modify(|w| {
        w.set_pls(VOLTAGE_DETECTOR_LEVEL);
        w.set_pvde(true);
    });
    EXTI.rtsr(0).modify(|w| w.set_line(VOLTAGE_DETECTOR_LINE, true));
    EXTI.imr(0).modify(|w| w.set_line(VOLTAGE_DETECTOR_LINE, true));
    interrupt::PVD.set_priority(Priority::P0);
    // SAFETY: its handler uses nothing that needs initialisation.
    unsafe { interrupt::PVD.enable() };
    if FLASH.optcr().read().bor_lev() == NO_BROWN_OUT_LEVEL {
        defmt::warn!("the option bytes have no brown-out level; set BOR level 3 (2.7 V) with a programmer");
    }
}

#[embassy_stm32::interrupt]
fn PVD() {
    reset(ResetCause::SupplyDip)
}

#[exception]
unsafe fn NonMaskableInt() -> ! {
    reset(ResetCause::ClockFailure)
}
