//! The button and the lamp.
//!
//! Pressed while the stand is driven, the button stops it as the emergency stop does, whatever else goes on. Pressed while it is not, it types
//! for the person: what is latched is cleared and the profile that was chosen starts; held for two seconds, the stand measures its cogging and friction.
//! What it types goes the way of every other line, with the same checks. The lamp is on while the drive is.

use crate::serial::{Overrun, Receiver, STOP};
use crate::tick::{BoardClock, is_driven};
use core::future::poll_fn;
use core::task::Poll;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::signal::Signal;
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_io_async::{ErrorType, Read};
use stand_firmware::board::{Clock, TICKS_PER_S};

/// How long a contact must rest to be believed, in board clock steps: 20 ms.
const REST: u64 = TICKS_PER_S / 50;
/// A press that means another thing, in looks of 20 ms: 2 s.
const LONG: u32 = 100;

const START: &[u8] = b"FAULt:CLEar;:PROFile:STARt\n";
const CALIBRATE: &[u8] = b"FAULt:CLEar;:CALibration:COGGing:STARt\n";

/// What the button types.
pub type Typed = Signal<NoopRawMutex, &'static [u8]>;

/// Watches the button (low when pressed) and keeps the lamp, for ever.
pub async fn run(mut button: impl InputPin, mut lamp: impl OutputPin, typed: &Typed) -> ! {
    let clock = BoardClock;
    let (mut pressed, mut driven) = (0, false);
    loop {
        clock.until(clock.now() + REST).await;
        // On this chip a pin can neither fail to be read nor to be set.
        let down = button.is_low().unwrap_or(false);
        let _ = if is_driven() { lamp.set_high() } else { lamp.set_low() };
        match (down, pressed) {
            (true, 0) => {
                driven = is_driven();
                if driven {
                    STOP.ask_stop();
                }
                pressed = 1;
            }
            (true, LONG) => {
                if !driven {
                    typed.signal(CALIBRATE);
                }
                pressed += 1;
            }
            (true, _) => pressed = (pressed + 1).min(LONG + 1),
            (false, 1..=LONG) => {
                if !driven {
                    typed.signal(START);
                }
                pressed = 0;
            }
            (false, _) => pressed = 0,
        }
    }
}

/// The line's receiving half, with what the button types between its lines.
pub struct WithButton<'a> {
    receiver: Receiver,
    typed: &'a Typed,
    rest: &'static [u8],
    /// The last byte of the line was the end of one, so that a typed one does not fall into another.
    between: bool,
}

impl<'a> WithButton<'a> {
    /// Joins the two.
    pub fn new(receiver: Receiver, typed: &'a Typed) -> Self {
        Self { receiver, typed, rest: b"", between: true }
    }
}

impl ErrorType for WithButton<'_> {
    type Error = Overrun;
}

impl Read for WithButton<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Overrun> {
        if self.rest.is_empty() {
            let typed = async {
                match self.between {
                    true => self.typed.wait().await,
                    false => poll_fn(|_| Poll::Pending).await,
                }
            };
            match select(self.receiver.read(buffer), typed).await {
                Either::First(received) => {
                    if let Ok(count @ 1..) = received {
                        self.between = matches!(buffer.get(count - 1), Some(b'\r' | b'\n'));
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
