//! The chip's own watchdog: a stand whose tick or whose tasks stand still is reset, and its bridge lets go.
//!
//! It runs on the 32 kHz oscillator, apart from everything else. It is fed from the tasks, by the board's clock, which the tick moves: without
//! the tick no deadline comes, without the tasks nobody feeds. Besides, the measurement's rows must have come on: a task that hangs in a wait
//! leaves the others alive.

use crate::sensors::looks;
use crate::tick::BoardClock;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, peripherals};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// Longer than the longest erase of a settings' sector (0.5 s) and both of them in turn; the oscillator is good to a factor of 1.5 either way.
const TIMEOUT_US: u32 = 2_000_000;
/// How often it is fed, board clock steps: 0.1 s.
const EVERY: u64 = TICKS_PER_S / 10;

/// Feeds the watchdog for ever, as long as rows come.
pub async fn feed(watchdog: Peri<'static, peripherals::IWDG>) -> ! {
    let mut watchdog = IndependentWatchdog::new(watchdog, TIMEOUT_US);
    watchdog.unleash();
    let mut before = looks();
    loop {
        BoardClock.until(BoardClock.now() + EVERY).await;
        let now = looks();
        if now != before {
            watchdog.pet();
        }
        before = now;
    }
}
