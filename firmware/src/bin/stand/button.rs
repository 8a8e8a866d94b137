//! Pins of the user button and the user LED; their behaviour is in `stand_firmware::button`.

use crate::serial::STOP;
use crate::tick::{BoardClock, drive_status};
use embedded_hal::digital::{InputPin, OutputPin};
use stand_firmware::button::{self, TypedLine};

/// Polls the button (low when pressed) and sets the LED, without end.
pub async fn run(mut button: impl InputPin, mut led: impl OutputPin, typed: &TypedLine) -> ! {
    // Access to a pin of the chip itself cannot fail.
    let is_down = || button.is_low().unwrap_or(false);
    let set_led = |is_on| _ = if is_on { led.set_high() } else { led.set_low() };
    button::run(&BoardClock, is_down, set_led, drive_status, &STOP, typed, |action, fault| match action {
        button::ButtonAction::Clear => defmt::info!("button: the fault is cleared ({}); press again to start", fault.name()),
        button::ButtonAction::Refuse => defmt::warn!("button: {}: {}", fault.name(), fault.advice()),
        _ => {}
    })
    .await
}
