//! The button and the lamp, whatever they are made of.

use embedded_hal::digital::{InputPin, OutputPin};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// How long a contact must rest to be believed, in board clock steps: 20 ms.
const REST: u64 = TICKS_PER_S / 50;
/// A press that means another thing, in board clock steps: 2 s.
const LONG: u64 = 2 * TICKS_PER_S;

/// One button, low when pressed, and one lamp.
pub struct Panel<B, L> {
    button: B,
    lamp: L,
}

impl<B: InputPin, L: OutputPin> Panel<B, L> {
    /// A panel with its lamp off.
    pub fn new(button: B, lamp: L) -> Self {
        Self { button, lamp }
    }

    /// Returns when the button, having been up, is pressed; says whether it is held for two seconds.
    pub async fn pressed_long<C: Clock>(&mut self, clock: &C) -> bool {
        self.pressed(clock).await;
        let since = clock.now();
        while self.button.is_low().unwrap_or(false) {
            if clock.now() - since > LONG {
                return true;
            }
            clock.until(clock.now() + REST).await;
        }
        false
    }

    /// Returns when the button, having been up, is pressed.
    pub async fn pressed<C: Clock>(&mut self, clock: &C) {
        for down in [false, true] {
            // A pin that cannot be read counts as not pressed.
            while self.button.is_low().unwrap_or(false) != down {
                clock.until(clock.now() + REST).await;
            }
            clock.until(clock.now() + REST).await;
        }
    }

    /// The lamp.
    pub fn running(&mut self, on: bool) {
        // On this chip a pin cannot fail to be set.
        let _ = if on { self.lamp.set_high() } else { self.lamp.set_low() };
    }
}
