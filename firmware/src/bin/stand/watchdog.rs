//! Independent watchdog: resets the chip if the control interrupt, the executors or the measurement loop stop; the reset opens the bridge.
//!
//! The watchdog has a separate 32 kHz oscillator and starts before the memory is initialised, so that a start-up that hangs is reset, too.
//! Its task waits by the board's clock: without the control interrupt no deadline comes, and a task that does not return to the executor
//! blocks this one. A task that waits for ever would not be noticed that way; therefore the watchdog is fed only while the measurement loop
//! reads its encoder.

use crate::sensors::encoder_readings;
use crate::tick::BoardClock;
use embassy_stm32::pac::IWDG;
use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// Timeout of 2 s in steps of 2 ms (32 kHz / 64). Longer than the erase of a sector (0.5 s, DS10693 table 48): the oscillator has 17 to 47
/// kHz (DS10693), so that the timeout is 1.4 to 3.8 s.
const TIMEOUT_STEPS: u16 = 1_000;
/// Feeding interval, board clock steps: 0.1 s.
const INTERVAL: u64 = TICKS_PER_S / 10;

// Starts the watchdog: the start-up code calls this before it initialises the memory. In assembler, since Rust code must not run there.
// Access (KR), prescaler (PR), reload value (RLR), start (KR): RM0390 §19.4.
core::arch::global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =0x40003000", // IWDG (RM0390, table 1)
    "movw r1, #0x5555",
    "str r1, [r0]",
    "movw r1, #4", // 32 kHz / 64
    "str r1, [r0, #4]",
    "movw r1, #{steps}",
    "str r1, [r0, #8]",
    "movw r1, #0xcccc",
    "str r1, [r0]",
    "bx lr",
    ".ltorg",
    steps = const TIMEOUT_STEPS,
);

/// Restarts the timeout. The first call puts the reload value in force: the chip takes it over five cycles of the 32 kHz after the start.
pub fn reload() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// Feeds the watchdog while the measurement loop runs.
pub async fn feed(_watchdog: Peri<'static, peripherals::IWDG>) -> ! {
    let mut before = encoder_readings();
    loop {
        BoardClock.until(BoardClock.now() + INTERVAL).await;
        let now = encoder_readings();
        if now != before {
            reload();
        }
        before = now;
    }
}
