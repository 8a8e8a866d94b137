//! Independent watchdog: resets the chip if the control interrupt, the executor or the measurement loop stops; the reset opens the bridge.
//!
//! The watchdog has a separate 32 kHz oscillator. Its task waits by the board's clock: without the control interrupt no deadline comes, and a
//! task that does not return to the executor blocks this one. A task that waits for ever would not be noticed that way; therefore the
//! watchdog is fed only while the measurement loop reads its encoder.

use crate::sensors::encoder_readings;
use crate::tick::BoardClock;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// Longer than the erase of both sectors of the settings (0.5 s each, DS10693 table 48); the oscillator has 17 to 47 kHz (DS10693).
const TIMEOUT_US: u32 = 2_000_000;
/// Feeding interval, board clock steps: 0.1 s.
const INTERVAL: u64 = TICKS_PER_S / 10;

/// Starts the watchdog and feeds it while the measurement loop runs.
pub async fn feed(watchdog: Peri<'static, peripherals::IWDG>) -> ! {
    let mut watchdog = IndependentWatchdog::new(watchdog, TIMEOUT_US);
    watchdog.unleash();
    let mut before = encoder_readings();
    loop {
        BoardClock.until(BoardClock.now() + INTERVAL).await;
        let now = encoder_readings();
        if now != before {
            watchdog.pet();
        }
        before = now;
    }
}
