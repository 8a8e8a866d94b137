//! A serial line with the transfer time of its bytes, in virtual time, in both directions.
//!
//! A byte has ten bits. [`SerialLine::device`] returns the firmware's two halves ([`Read`], [`Write`]); a host program sends and receives
//! by [`SerialLine::send`] and [`SerialLine::receive`]. Incoming bytes pass the *receive interrupt* one by one in [`SerialLine::deliver`],
//! also if no task reads; the simulation calls it at each tick. Outgoing bytes wait in a buffer and leave one by one.
//!
//! The line can be damaged by seed ([`DamageRates`]) and unplugged (bytes of both directions are lost). The host can send a *break*: the
//! firmware reads [`LineError::Break`] at that position. A full receive buffer loses the byte and reports [`LineError::Overrun`].
//!
//! A task that waits for the line wakes at the next control tick.

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

/// Bit rate of the line on the board, bits per second.
pub const USUAL_BAUD: u32 = 921_600;
/// Size of the firmware's receive buffer.
pub const RECEIVE_BYTES: usize = 1024;
/// Size of the firmware's transmit buffer.
pub const TRANSMIT_BYTES: usize = 512;
/// Size of the host driver's receive buffer; the oldest bytes are lost when it is full.
pub const HOST_BYTES: usize = 1 << 20;

/// Line errors that the firmware reads instead of bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LineError {
    /// The host sent a break.
    #[error("a break on the serial line")]
    Break,
    /// The receive buffer was full, and bytes are lost.
    #[error("bytes on the serial line were lost: the receive buffer was full")]
    Overrun,
}

impl embedded_io_async::Error for LineError {
    fn kind(&self) -> ErrorKind {
        match self {
            // The app interprets this kind as a break.
            LineError::Break => ErrorKind::Interrupted,
            LineError::Overrun => ErrorKind::Other,
        }
    }
}

/// Numbers of transferred, lost and damaged bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineCounts {
    /// Bytes sent by the firmware.
    pub sent: u64,
    /// Bytes received by the interrupt.
    pub received: u64,
    /// Bytes lost to a full receive buffer.
    pub overrun: u64,
    /// Bytes lost because the host did not read them in time.
    pub unread: u64,
    /// Bytes changed, lost or inserted by damage.
    pub damaged: u64,
}

/// An incoming item: a byte or a break.
pub type Incoming = Result<u8, LineError>;

struct Wires {
    plugged: bool,
    powered: bool,
    /// Host to device: bytes on the wire, then bytes in the receive buffer.
    inward: Timed<Incoming>,
    received: VecDeque<Incoming>,
    reader: Option<Waker>,
    /// Device to host: bytes waiting or on the wire, then received bytes.
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
    /// A line with this bit rate on this clock; `seed` of the damage. Without damage at first.
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

    /// Queues bytes of the host behind those still on the wire.
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

    /// Appends the bytes that have arrived at the host to `into`.
    pub fn receive(&self, into: &mut Vec<u8>) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        into.extend(wires.arrived.drain(..));
    }

    /// Advances the line to `now`: `interrupt` gets each incoming byte or break in sequence; then the item is in the receive buffer.
    #[inline]
    pub fn deliver(&self, now: Ticks, mut interrupt: impl FnMut(Incoming)) {
        let mut wires = self.wires.borrow_mut();
        // DMA overwrites what does not fit into its ring while the core is stalled: those bytes never reach the interrupt.
        let mut in_ring = 0;
        while let Some(incoming) = wires.inward.pop(now) {
            if !wires.plugged || !wires.powered {
                continue;
            }
            match incoming {
                Ok(byte) => {
                    for byte in wires.damage[0].pass(byte).into_iter().flatten() {
                        in_ring += 1;
                        if in_ring > RECEIVE_BYTES {
                            wires.overrun();
                            continue;
                        }
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

    /// Sets the damage rates of the bytes from the host (`inward`) and from the device (`outward`).
    pub fn damage(&self, inward: DamageRates, outward: DamageRates) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.damage[0].rates = inward;
        wires.damage[1].rates = outward;
    }

    /// Connects or disconnects the line: bytes on a disconnected wire are lost in both directions.
    pub fn plug(&self, plugged: bool) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.plugged = plugged;
    }

    /// Switches the supply of the controller: without supply its buffers are cleared and nothing is received.
    pub fn power(&self, powered: bool) {
        let mut wires = self.wires.borrow_mut();
        wires.arrive(self.clock.now());
        wires.outward.clear(self.clock.now());
        wires.received.clear();
        wires.powered = powered;
    }

    /// The counts so far.
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
            self.overrun();
        }
    }

    /// A byte is lost; the last one in the buffer, too, for the report.
    fn overrun(&mut self) {
        self.counts.overrun += 1;
        if let Some(last) = self.received.back_mut() {
            *last = Err(LineError::Overrun);
        }
    }

    /// Moves the bytes that the device has sent by `now` to the host.
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

/// The firmware's receive half. Dropping a pending read loses no byte.
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
            while let Some(slot) = into.get_mut(count) {
                match wires.received.front().copied() {
                    Some(Ok(byte)) => *slot = byte,
                    // Bytes before the break are read first.
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
                // If its tick was lost, with the next tick.
                Some(at) => self.0.clock.wait_until(next_tick(at.max(self.0.clock.now() + 1))),
                None => wires.reader = Some(context.waker().clone()),
            }
            Poll::Pending
        })
        .await
    }
}

/// The firmware's transmit half. Dropping a pending write loses no byte.
pub struct DeviceTransmit<'l, 'a>(&'l SerialLine<'a>);

impl ErrorType for DeviceTransmit<'_, '_> {
    type Error = LineError;
}

impl DeviceTransmit<'_, '_> {
    /// Waits until at most `most` bytes are pending.
    async fn wait_for_pending_at_most(&mut self, most: usize) {
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
        self.wait_for_pending_at_most(TRANSMIT_BYTES - 1).await;
        let mut wires = self.0.wires.borrow_mut();
        let count = bytes.len().min(TRANSMIT_BYTES - wires.outward.len());
        for byte in bytes.iter().take(count) {
            wires.outward.push(self.0.clock.now(), *byte);
        }
        Ok(count)
    }

    async fn flush(&mut self) -> Result<(), LineError> {
        self.wait_for_pending_at_most(0).await;
        Ok(())
    }
}

#[cfg(test)]
mod tests;
