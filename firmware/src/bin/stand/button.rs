//! The user button and the user LED.
//!
//! While the drive is on, a press stops it as the emergency stop does. While the drive is off, a press enters a console line: a short press
//! clears the latched fault and starts the selected profile, a press of two seconds starts the measurement of cogging and friction. The line is
//! parsed and checked as every received line. The LED is on while the drive is on.

use crate::serial::{Overrun, Receiver, STOP};
use crate::tick::{BoardClock, is_driven};
use core::future::poll_fn;
use core::task::Poll;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io_async::{ErrorType, Read};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// Debounce interval, in board clock steps: 20 ms.
const DEBOUNCE: u64 = TICKS_PER_S / 50;
/// Length of a long press, in debounce intervals: 2 s.
const LONG_PRESS: u32 = 100;

const START: &[u8] = b"FAULt:CLEar;:PROFile:STARt\n";
const CALIBRATE: &[u8] = b"FAULt:CLEar;:CALibration:COGGing:STARt\n";

/// Console line that the button enters.
pub type TypedLine = Signal<CriticalSectionRawMutex, &'static [u8]>;

/// Polls the button (low when pressed) and sets the LED, without end.
pub async fn run(mut button: impl InputPin, mut led: impl OutputPin, typed: &TypedLine) -> ! {
    let clock = BoardClock;
    let (mut pressed_intervals, mut was_driven) = (0, false);
    loop {
        clock.until(clock.now() + DEBOUNCE).await;
        // Access to a pin of the chip itself cannot fail.
        let down = button.is_low().unwrap_or(false);
        let _ = if is_driven() { led.set_high() } else { led.set_low() };
        match (down, pressed_intervals) {
            (true, 0) => {
                was_driven = is_driven();
                if was_driven {
                    STOP.request_stop();
                }
                pressed_intervals = 1;
            }
            (true, LONG_PRESS) => {
                if !was_driven {
                    typed.signal(CALIBRATE);
                }
                pressed_intervals += 1;
            }
            (true, _) => pressed_intervals = (pressed_intervals + 1).min(LONG_PRESS + 1),
            (false, 1..=LONG_PRESS) => {
                if !was_driven {
                    typed.signal(START);
                }
                pressed_intervals = 0;
            }
            (false, _) => pressed_intervals = 0,
        }
    }
}

/// The serial receiver, with the button's lines inserted between received lines.
pub struct ReceiverWithButton<'a> {
    receiver: Receiver,
    typed: &'a TypedLine,
    /// Rest of a button's line that was not read yet.
    rest: &'static [u8],
    /// The last received byte ended a line: the button's line may be inserted.
    between_lines: bool,
}

impl<'a> ReceiverWithButton<'a> {
    /// Merges `receiver` and the lines of the button.
    pub fn new(receiver: Receiver, typed: &'a TypedLine) -> Self {
        Self { receiver, typed, rest: b"", between_lines: true }
    }
}

impl ErrorType for ReceiverWithButton<'_> {
    type Error = Overrun;
}

impl Read for ReceiverWithButton<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        if self.rest.is_empty() {
            let typed = async {
                match self.between_lines {
                    true => self.typed.wait().await,
                    false => poll_fn(|_| Poll::Pending).await,
                }
            };
            match select(self.receiver.read(buffer), typed).await {
                Either::First(received) => {
                    if let Ok(count @ 1..) = received {
                        self.between_lines = matches!(buffer.get(count - 1), Some(b'\r' | b'\n'));
                    }
                    return received;
                }
                Either::Second(line) => self.rest = line,
            }
        }
        let count = self.rest.len().min(buffer.len());
        let (now, later) = self.rest.split_at(count);
        buffer[..count].copy_from_slice(now);
        self.rest = later;
        Ok(count)
    }
}
