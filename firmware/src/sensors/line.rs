//! SPI transfers of a sensor's driver: one buffer, a first byte with the register's address, then data.

use super::SensorError;
use crate::board::{Clock, SensorSpi};

/// Most bytes after the first in one transfer.
pub(super) const MAX_BYTES: usize = 84;

/// The bus with its transfer buffer, and the board's clock.
pub(super) struct BusLine<D, C> {
    device: D,
    pub(super) clock: C,
    /// First byte, then data.
    pub(super) bytes: [u8; 1 + MAX_BYTES],
}

impl<D: SensorSpi, C: Clock> BusLine<D, C> {
    pub(super) fn new(device: D, clock: C) -> Self {
        Self { device, clock, bytes: [0; 1 + MAX_BYTES] }
    }

    /// Selects the clock polarity and phase of the part.
    pub(super) fn set_mode(&mut self, mode: embedded_hal_async::spi::Mode) -> Result<(), SensorError> {
        self.device.set_mode(mode).map_err(|_| SensorError::Bus)
    }

    pub(super) async fn wait(&mut self, steps: u64) {
        self.clock.until(self.clock.now() + steps).await;
    }

    /// Transfers the first byte and `count` more; [`Self::received`] has the received bytes.
    pub(super) async fn exchange(&mut self, first: u8, count: usize) -> Result<(), SensorError> {
        if let Some(place) = self.bytes.first_mut() {
            *place = first;
        }
        let bytes = self.bytes.get_mut(..=count).unwrap_or_default();
        self.device.transfer_in_place(bytes).await.map_err(|_| SensorError::Bus)
    }

    /// The bytes received after the first.
    pub(super) fn received<const N: usize>(&self) -> [u8; N] {
        self.bytes.get(1..).and_then(|bytes| bytes.first_chunk()).copied().unwrap_or([0; N])
    }

    /// Writes `value` with the command byte `write`, reads it with `read` and compares.
    pub(super) async fn set(&mut self, register: u8, write: u8, read: u8, value: u8) -> Result<(), SensorError> {
        for first in [write, read] {
            self.bytes = [value; _];
            self.exchange(first, 1).await?;
        }
        let [held] = self.received();
        if held == value { Ok(()) } else { Err(SensorError::NotConfigured { register, wrote: value, read: held }) }
    }
}
