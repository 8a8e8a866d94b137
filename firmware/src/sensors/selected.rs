//! A device on an SPI bus of its own, with its chip select.
//!
//! Every operation is a full-duplex transfer in a local buffer, so that one transfer function of the bus serves all kinds of operations.
//! The chip select rises when a transaction ends, also where its future is dropped before: a device that stays selected takes the next
//! transaction as the continuation of the last one.

use embedded_hal::digital::OutputPin;
use embedded_hal_async::spi::{ErrorType, Operation, SpiBus, SpiDevice};

/// Size of the transfer buffer, bytes: a burst of the sensor's FIFO.
const MAX_TRANSFER_BYTES: usize = 96;

/// The device.
pub struct SelectedDevice<B, P> {
    /// The bus.
    pub bus: B,
    select: P,
    delay_ns: fn(u32),
}

impl<B, P: OutputPin> SelectedDevice<B, P> {
    /// The device behind `select` (low: selected); `delay_ns` waits at least so many nanoseconds.
    pub fn new(bus: B, select: P, delay_ns: fn(u32)) -> Self {
        Self { bus, select, delay_ns }
    }
}

/// Selects the device while it lives. A pin of the chip itself cannot fail.
struct Selected<'a, P: OutputPin>(&'a mut P);

impl<'a, P: OutputPin> Selected<'a, P> {
    fn new(pin: &'a mut P) -> Self {
        _ = pin.set_low();
        Self(pin)
    }
}

impl<P: OutputPin> Drop for Selected<'_, P> {
    fn drop(&mut self) {
        _ = self.0.set_high();
    }
}

impl<B: ErrorType, P> ErrorType for SelectedDevice<B, P> {
    type Error = B::Error;
}

impl<B: SpiBus, P: OutputPin> SpiDevice for SelectedDevice<B, P> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), B::Error> {
        let _selected = Selected::new(&mut self.select);
        for operation in operations {
            if let Operation::DelayNs(ns) = operation {
                (self.delay_ns)(*ns);
            }
            let mut start = 0;
            loop {
                let mut buffer = [0; MAX_TRANSFER_BYTES];
                let to_send = sent(operation).get(start..).unwrap_or_default();
                buffer.iter_mut().zip(to_send).for_each(|(target, byte)| *target = *byte);
                let length = to_send.len().max(received(operation).len().saturating_sub(start)).min(MAX_TRANSFER_BYTES);
                let Some(bytes) = buffer.get_mut(..length).filter(|bytes| !bytes.is_empty()) else { break };
                self.bus.transfer_in_place(bytes).await?;
                received(operation).iter_mut().skip(start).zip(bytes).for_each(|(target, byte)| *target = *byte);
                start += length;
            }
        }
        Ok(())
    }
}

/// Bytes that an operation sends; zeros follow where it receives more.
fn sent<'o>(operation: &'o Operation<'_, u8>) -> &'o [u8] {
    match operation {
        Operation::Write(bytes) | Operation::Transfer(_, bytes) => bytes,
        Operation::TransferInPlace(bytes) => bytes,
        Operation::Read(_) | Operation::DelayNs(_) => &[],
    }
}

/// Buffer of an operation for received bytes.
fn received<'o>(operation: &'o mut Operation<'_, u8>) -> &'o mut [u8] {
    match operation {
        Operation::Read(bytes) | Operation::Transfer(bytes, _) | Operation::TransferInPlace(bytes) => bytes,
        Operation::Write(_) | Operation::DelayNs(_) => &mut [],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;
    use core::convert::Infallible;
    use core::future::{Future, pending};
    use core::pin::pin;
    use core::task::{Context, Poll, Waker};

    /// A bus that answers each byte by its complement, or never.
    struct Bus {
        is_stuck: bool,
        moved: usize,
    }

    impl ErrorType for Bus {
        type Error = Infallible;
    }

    impl SpiBus for Bus {
        async fn read(&mut self, _: &mut [u8]) -> Result<(), Infallible> {
            Ok(())
        }
        async fn write(&mut self, _: &[u8]) -> Result<(), Infallible> {
            Ok(())
        }
        async fn transfer(&mut self, _: &mut [u8], _: &[u8]) -> Result<(), Infallible> {
            Ok(())
        }
        async fn transfer_in_place(&mut self, words: &mut [u8]) -> Result<(), Infallible> {
            if self.is_stuck {
                pending::<()>().await;
            }
            self.moved += words.len();
            words.iter_mut().for_each(|word| *word = !*word);
            Ok(())
        }
        async fn flush(&mut self) -> Result<(), Infallible> {
            Ok(())
        }
    }

    struct Pin<'a>(&'a Cell<bool>);

    impl embedded_hal::digital::ErrorType for Pin<'_> {
        type Error = Infallible;
    }

    impl OutputPin for Pin<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.set(false);
            Ok(())
        }
        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.set(true);
            Ok(())
        }
    }

    fn poll<F: Future>(future: core::pin::Pin<&mut F>) -> Poll<F::Output> {
        future.poll(&mut Context::from_waker(Waker::noop()))
    }

    #[test]
    fn dropped_transaction_deselects_the_device() {
        let is_high = Cell::new(true);
        let mut device = SelectedDevice::new(Bus { is_stuck: true, moved: 0 }, Pin(&is_high), |_| ());
        {
            let mut operations = [Operation::Write(&[1, 2])];
            let mut transaction = pin!(device.transaction(&mut operations));
            assert!(poll(transaction.as_mut()).is_pending() && !is_high.get(), "selected while it runs");
        }
        assert!(is_high.get(), "deselected by the drop");
    }

    #[test]
    fn operations_of_every_kind_and_length_are_exchanged() {
        let is_high = Cell::new(true);
        let mut device = SelectedDevice::new(Bus { is_stuck: false, moved: 0 }, Pin(&is_high), |_| ());
        let (mut read, mut both, mut in_place) = ([0; 250], [0; 3], [7; 97]);
        let mut operations = [
            Operation::Write(&[1; 100]),
            Operation::Read(&mut read),
            Operation::Transfer(&mut both, &[1, 2]),
            Operation::TransferInPlace(&mut in_place),
            Operation::DelayNs(5),
        ];
        assert_eq!(poll(pin!(device.transaction(&mut operations))), Poll::Ready(Ok(())));
        assert!(is_high.get());
        assert_eq!((device.bus.moved, read, both, in_place), (450, [0xFF; 250], [!1, !2, 0xFF], [!7; 97]));
    }
}
