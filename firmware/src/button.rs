//! The user button and the user LED of the board.
//!
//! While the drive is on, a press is an emergency stop. While it is off, clearing a fault and starting are two presses: with a fault
//! latched a short press clears it, and the next one starts the selected profile. An emergency stop is not cleared by the button: it takes
//! its release and `FAULt:CLEar` on the console, so that nobody starts a stand that somebody else has stopped. A press of two seconds
//! without a fault starts the measurement of cogging and friction.
//!
//! A press enters a console line, which is parsed and checked as every received one. A start by the button allows an hour without a host:
//! whoever presses it stands by. The LED is on while the drive is on, blinks slowly while a fault is latched, and fast after an emergency
//! stop.

use crate::board::{Clock, TICKS_PER_ROW};
use crate::console::StopLine;
use crate::status::Fault;
use core::future::poll_fn;
use core::task::Poll;
use embassy_futures::select::{Either, select};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embedded_io_async::{ErrorType, Read};

/// Debounce interval, in board clock steps: 20 ms.
pub const DEBOUNCE: u64 = 20 * TICKS_PER_ROW;
/// Length of a long press, in debounce intervals: 2 s.
const LONG_PRESS: u32 = 100;
/// Half periods of the LED, in debounce intervals: 0.5 s after a fault, 0.1 s after an emergency stop.
const SLOW_BLINK: u32 = 25;
const FAST_BLINK: u32 = 5;

/// What the control interrupt does, for button and LED.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DriveStatus {
    /// The bridge is driven.
    pub is_driven: bool,
    /// The latched fault.
    pub fault: Fault,
}

/// Effect of a press.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ButtonAction {
    /// Emergency stop.
    Stop,
    /// Clear the latched fault.
    Clear,
    /// Start the selected profile.
    Start,
    /// Start the measurement of cogging and friction.
    Calibrate,
    /// Nothing: an emergency stop, or a fault at a long press.
    Refuse,
}

impl ButtonAction {
    /// The console line of this action, if it has one.
    pub fn line(self) -> Option<&'static [u8]> {
        match self {
            Self::Clear => Some(b"FAULt:CLEar\n"),
            Self::Start => Some(b"HOST:UNATTended 3600;:PROFile:STARt\n"),
            Self::Calibrate => Some(b"HOST:UNATTended 3600;:CALibration:COGGing:STARt\n"),
            Self::Stop | Self::Refuse => None,
        }
    }
}

/// State of the button.
#[derive(Clone, Copy, Debug, Default)]
pub struct Button {
    pressed_intervals: u32,
    /// The press has had its effect.
    is_done: bool,
}

impl Button {
    /// The next debounce interval.
    pub fn update(&mut self, is_down: bool, drive: DriveStatus) -> Option<ButtonAction> {
        let before = self.pressed_intervals;
        self.pressed_intervals = if is_down { before.saturating_add(1) } else { 0 };
        if is_down && before == 0 {
            self.is_done = drive.is_driven;
            return drive.is_driven.then_some(ButtonAction::Stop);
        }
        let (is_long, is_released) = (self.pressed_intervals > LONG_PRESS, !is_down && before > 0);
        if self.is_done || !(is_long || is_released) {
            return None;
        }
        self.is_done = true;
        Some(match drive.fault {
            Fault::None if is_long => ButtonAction::Calibrate,
            Fault::None => ButtonAction::Start,
            Fault::EmergencyStop => ButtonAction::Refuse,
            _ if is_long => ButtonAction::Refuse,
            _ => ButtonAction::Clear,
        })
    }
}

/// Whether the LED is lit in a debounce interval, numbered from power-on.
pub fn is_led_on(drive: DriveStatus, interval: u32) -> bool {
    let blinks = |half_period: u32| interval.checked_div(half_period).unwrap_or(0) & 1 == 0;
    match drive.fault {
        Fault::None => drive.is_driven,
        Fault::EmergencyStop => blinks(FAST_BLINK),
        _ => blinks(SLOW_BLINK),
    }
}

/// Console line that the button enters.
pub type TypedLine = Signal<CriticalSectionRawMutex, &'static [u8]>;

/// Polls the button and sets the LED, without end; `report` gets each action.
pub async fn run<C: Clock>(
    clock: &C,
    mut is_down: impl FnMut() -> bool,
    mut set_led: impl FnMut(bool),
    drive: impl Fn() -> DriveStatus,
    stop: &StopLine,
    typed: &TypedLine,
    mut report: impl FnMut(ButtonAction, Fault),
) -> ! {
    let mut button = Button::default();
    let mut interval: u32 = 0;
    loop {
        clock.until(clock.now() + DEBOUNCE).await;
        interval = interval.wrapping_add(1);
        let status = drive();
        set_led(is_led_on(status, interval));
        let Some(action) = button.update(is_down(), status) else { continue };
        if action == ButtonAction::Stop {
            stop.request_stop();
        }
        if let Some(line) = action.line() {
            typed.signal(line);
        }
        report(action, status.fault);
    }
}

/// The serial receiver, with the button's lines inserted between received lines.
pub struct ReceiverWithButton<'a, R> {
    receiver: R,
    typed: &'a TypedLine,
    /// Rest of a button's line that was not read yet.
    rest: &'static [u8],
    /// The last received byte ended a line: the button's line may be inserted.
    between_lines: bool,
}

impl<'a, R> ReceiverWithButton<'a, R> {
    /// Merges `receiver` and the lines of the button.
    pub fn new(receiver: R, typed: &'a TypedLine) -> Self {
        Self { receiver, typed, rest: b"", between_lines: true }
    }
}

impl<R: ErrorType> ErrorType for ReceiverWithButton<'_, R> {
    type Error = R::Error;
}

impl<R: Read> Read for ReceiverWithButton<'_, R> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, R::Error> {
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
        let (now, later) = self.rest.split_at_checked(count).unwrap_or_default();
        if let Some(target) = buffer.get_mut(..now.len()) {
            target.copy_from_slice(now);
        }
        self.rest = later;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OFF: DriveStatus = DriveStatus { is_driven: false, fault: Fault::None };

    /// Actions of a press of this length, its release included.
    fn press(drive: DriveStatus, intervals: u32) -> Vec<ButtonAction> {
        let mut button = Button::default();
        let mut actions: Vec<ButtonAction> = (0..intervals).filter_map(|_| button.update(true, drive)).collect();
        actions.extend((0..3).filter_map(|_| button.update(false, drive)));
        actions
    }

    #[test]
    fn clearing_and_starting_are_two_presses_and_an_emergency_stop_stays() {
        let with = |fault| DriveStatus { fault, ..OFF };
        for intervals in [1, 10, 100] {
            assert_eq!(press(OFF, intervals), [ButtonAction::Start]);
            assert_eq!(press(with(Fault::EmergencyStop), intervals), [ButtonAction::Refuse]);
            for fault in Fault::ALL.into_iter().filter(|fault| *fault != Fault::EmergencyStop) {
                assert_eq!(press(with(fault), intervals), [ButtonAction::Clear]);
            }
            assert_eq!(press(DriveStatus { is_driven: true, fault: Fault::None }, intervals), [ButtonAction::Stop]);
        }
        assert_eq!(press(OFF, 300), [ButtonAction::Calibrate]);
        assert_eq!(press(with(Fault::Stall), 300), [ButtonAction::Refuse], "a long press clears nothing");
    }

    #[test]
    fn no_line_clears_and_starts() {
        for action in [ButtonAction::Stop, ButtonAction::Clear, ButtonAction::Start, ButtonAction::Calibrate, ButtonAction::Refuse] {
            let line = String::from_utf8(action.line().unwrap_or_default().to_vec()).unwrap();
            assert!(!(line.contains("CLEar") && line.contains("STARt")), "{line}");
        }
    }

    #[test]
    fn the_led_shows_drive_fault_and_emergency_stop() {
        let changes = |drive| (0..200).filter(|n| is_led_on(drive, *n) != is_led_on(drive, n + 1)).count();
        assert_eq!(changes(OFF) + changes(DriveStatus { is_driven: true, ..OFF }), 0);
        assert!(is_led_on(DriveStatus { is_driven: true, ..OFF }, 7) && !is_led_on(OFF, 7));
        assert_eq!(changes(DriveStatus { fault: Fault::Stall, ..OFF }), 8, "in 4 s");
        assert_eq!(changes(DriveStatus { fault: Fault::EmergencyStop, ..OFF }), 40);
    }
}
