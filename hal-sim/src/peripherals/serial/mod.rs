//! A serial line with the time that its bytes take, in virtual time, both directions.
//!
//! A byte is ten bits long. [`SerialLine::device`] gives the firmware's two halves ([`Read`], [`Write`]); a host's program sends and receives
//! by [`SerialLine::send`], [`SerialLine::receive`]. Bytes that come in pass the *receive interrupt* one by one in [`SerialLine::deliver`], whoever
//! reads or does not; whoever runs the line calls that at each tick. What the firmware sends waits in a buffer and leaves byte by byte.
//!
//! The line can be damaged by seed ([`DamageRates`]), unplugged (bytes of both directions vanish), and the host can send a *break*: the
//! firmware reads [`LineError::Break`] in its place. A receive buffer that is full loses the byte and says [`LineError::Overrun`].
//!
//! A task that waits for the line wakes at the next control tick: nothing shorter than that moves a plant.

mod damage;
mod queue;

use crate::clock::VirtualClock;
use damage::Damage;
pub use damage::DamageRates;
use embedded_io_async::{ErrorKind, ErrorType, Read, Write};
use queue::Timed;
use stand_firmware::board::{TICKS_PER_CONTROL, Ticks};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::future::poll_fn;
use std::task::{Poll, Waker};

/// The line's rate on the board, bits per second.
pub const USUAL_BAUD: u32 = 921_600;
/// Bytes that the firmware's receive buffer holds.
pub const RECEIVE_BYTES: usize = 512;
/// Bytes that wait to be sent.
pub const TRANSMIT_BYTES: usize = 512;
/// Bytes that a host's program may leave unread before the oldest are lost: what a driver keeps.
pub const HOST_BYTES: usize = 1 << 20;

/// What the firmware's side can read in the place of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineError {
    /// The host sent a break.
    #[error("a break on the serial line")]
    Break,
    /// Bytes came faster than they were read, and some are lost.
    #[error("bytes on the serial line were lost: the receive buffer was full")]
    Overrun,
}

impl embedded_io_async::Error for LineError {
    fn kind(&self) -> ErrorKind {
        match self {
            // What the app takes for a break.
            LineError::Break => ErrorKind::Interrupted,
            LineError::Overrun => ErrorKind::Other,
        }
    }
}

/// What has passed, and what has not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Bytes that the firmware has put on the line.
    pub sent: u64,
    /// Bytes that the receive interrupt has had.
    pub received: u64,
    /// Bytes that were lost to a full receive buffer.
    pub overrun: u64,
    /// Bytes that a host left unread for too long.
    pub unread: u64,
    /// Bytes changed, lost or put in by damage.
    pub damaged: u64,
}

/// What can come in: a byte or a break.
pub type Incoming = Result<u8, LineError>;

struct Wires {
    plugged: bool,
    powered: bool,
    /// Host to device: bytes on the wire, then those in the receive buffer.
    inward: Timed<Incoming>,
    received: VecDeque<Incoming>,
    reader: Option<Waker>,
    /// Device to host: what waits or is on the wire, then what has arrived.
    outward: Timed<u8>,
    arrived: VecDeque<u8>,
    damage: [Damage; 2],
    counts: LineCounts,
}

/// One line. Each end has one user.
pub struct SerialLine<'a> {
    clock: &'a VirtualClock,
    wires: RefCell<Wires>,
}

impl<'a> SerialLine<'a> {
    /// A line of so many bits per second on this clock; `seed` draws its damage, of which there is none at first.
    pub fn new(clock: &'a VirtualClock, baud: u32, seed: u64) -> Self {
        let wires = Wires {
            plugged: true,
            powered: true,
            inward: Timed::new(baud),
            received: VecDeque::with_capacity(RECEIVE_BYTES),
            reader: None,
            outward: Timed::new(baud),
            arrived: VecDeque::new(),
            damage: [Damage::new(seed), Damage::new(seed ^ 0x5851_F42D_4C95_7F2D)],
            counts: LineCounts::default(),
        };
        Self { clock, wires: RefCell::new(wires) }
    }

    /// The firmware's receive and transmit half.
    pub fn device(&self) -> (DeviceReceive<'_, 'a>, DeviceTransmit<'_, 'a>) {
        (DeviceReceive(self), DeviceTransmit(self))
    }

    /// Puts a host's bytes on the line, behind what is still on it.
    pub fn send(&self, bytes: &[u8]) {
        let mut wires = self.wires.borrow_mut();
        let now = self.clock.now();
        for byte in bytes {
            wires.inward.push(now, Ok(*byte));
        }
        wires.wake();
    }

    /// Sends a break.
    pub fn send_break(&self) {
        let mut wires = self.wires.borrow_mut();
        wires.inward.push(self.clock.now(), Err(LineError::Break));
        wires.wake();
    }

    /// Takes what has arrived at the host by now.
    pub fn receive(&self, into: &mut Vec<u8>) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        into.extend(wires.arrived.drain(..));
    }

    /// Brings the line to `now`: `interrupt` gets each byte or break that has come in, in its order, then it waits to be read.
    #[inline]
    pub fn deliver(&self, now: Ticks, mut interrupt: impl FnMut(Incoming)) {
        let mut wires = self.wires.borrow_mut();
        while let Some(incoming) = wires.inward.pop(now) {
            if !wires.plugged || !wires.powered {
                continue;
            }
            match incoming {
                Ok(byte) => {
                    for byte in wires.damage[0].pass(byte).into_iter().flatten() {
                        interrupt(Ok(byte));
                        wires.counts.received += 1;
                        wires.keep(Ok(byte));
                    }
                }
                Err(error) => {
                    interrupt(Err(error));
                    wires.keep(Err(error));
                }
            }
        }
        wires.arrive(now);
    }

    /// How often bytes from the host (`inward`) and from the device (`outward`) are damaged from now on.
    pub fn damage(&self, inward: DamageRates, outward: DamageRates) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.damage[0].rates = inward;
        wires.damage[1].rates = outward;
    }

    /// Pulls the plug, or puts it in again: what is on the wire meanwhile is lost on both sides.
    pub fn plug(&self, plugged: bool) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.plugged = plugged;
    }

    /// The controller has lost its supply, or has it again: what was in its buffers is gone, and nothing is received meanwhile.
    pub fn power(&self, powered: bool) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.outward.clear(self.clock.now());
        wires.received.clear();
        wires.powered = powered;
    }

    /// What has passed so far.
    pub fn counts(&self) -> LineCounts {
        let wires = self.wires.borrow();
        LineCounts { damaged: wires.damage.iter().map(Damage::done).sum(), ..wires.counts }
    }
}

impl Wires {
    fn wake(&mut self) {
        if let Some(reader) = self.reader.take() {
            reader.wake();
        }
    }

    fn keep(&mut self, incoming: Incoming) {
        if self.received.len() < RECEIVE_BYTES {
            self.received.push_back(incoming);
        } else {
            self.counts.overrun += 1;
            if let Some(last) = self.received.back_mut() {
                *last = Err(LineError::Overrun);
            }
        }
    }

    /// What the device has sent up to `now` arrives.
    #[inline]
    fn arrive(&mut self, now: Ticks) {
        while let Some(byte) = self.outward.pop(now) {
            self.counts.sent += 1;
            if !self.plugged {
                continue;
            }
            for byte in self.damage[1].pass(byte).into_iter().flatten() {
                if self.arrived.len() == HOST_BYTES {
                    self.arrived.pop_front();
                    self.counts.unread += 1;
                }
                self.arrived.push_back(byte);
            }
        }
    }
}

/// The next control tick at or after `t`.
fn next_tick(t: Ticks) -> Ticks {
    Ticks(t.0.next_multiple_of(TICKS_PER_CONTROL))
}

/// The firmware's receive half. Dropping a read that waits loses nothing.
pub struct DeviceReceive<'l, 'a>(&'l SerialLine<'a>);

impl ErrorType for DeviceReceive<'_, '_> {
    type Error = LineError;
}

impl Read for DeviceReceive<'_, '_> {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, LineError> {
        if into.is_empty() {
            return Ok(0);
        }
        poll_fn(|context| {
            let mut wires = self.0.wires.borrow_mut();
            let mut count = 0;
            while let Some(place) = into.get_mut(count) {
                match wires.received.front().copied() {
                    Some(Ok(byte)) => *place = byte,
                    // In its place: bytes before it are read first.
                    Some(Err(error)) if count == 0 => {
                        wires.received.pop_front();
                        return Poll::Ready(Err(error));
                    }
                    _ => break,
                }
                wires.received.pop_front();
                count += 1;
            }
            if count > 0 {
                return Poll::Ready(Ok(count));
            }
            match wires.inward.next() {
                // Where the tick that was to bring it was lost, with the next.
                Some(at) => self.0.clock.wait_until(next_tick(at.max(self.0.clock.now() + 1))),
                None => wires.reader = Some(context.waker().clone()),
            }
            Poll::Pending
        })
        .await
    }
}

/// The firmware's transmit half. Dropping a write that waits loses nothing.
pub struct DeviceTransmit<'l, 'a>(&'l SerialLine<'a>);

impl ErrorType for DeviceTransmit<'_, '_> {
    type Error = LineError;
}

impl DeviceTransmit<'_, '_> {
    /// Waits until at most `most` bytes are still to be sent.
    async fn room(&mut self, most: usize) {
        poll_fn(|_| {
            let mut wires = self.0.wires.borrow_mut();
            wires.arrive(self.0.clock.now());
            match wires.outward.when_down_to(most) {
                None => Poll::Ready(()),
                Some(at) => {
                    self.0.clock.wait_until(next_tick(at));
                    Poll::Pending
                }
            }
        })
        .await
    }
}

impl Write for DeviceTransmit<'_, '_> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, LineError> {
        if bytes.is_empty() {
            return Ok(0);
        }
        self.room(TRANSMIT_BYTES - 1).await;
        let mut wires = self.0.wires.borrow_mut();
        let count = bytes.len().min(TRANSMIT_BYTES - wires.outward.len());
        for byte in bytes.iter().take(count) {
            wires.outward.push(self.0.clock.now(), *byte);
        }
        Ok(count)
    }

    async fn flush(&mut self) -> Result<(), LineError> {
        self.room(0).await;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
