//! The SPI bus to the sensor under test: the firmware's transactions with their duration.
//!
//! Mode 3 or 0 as the driver selects, 10 MHz (the maximum of the ISM330DHCX, DS13012 §4.4.1, and of the ADXL355), by DMA. A transaction
//! ends with its last bit and reads the state of the sensor at that time; other tasks run until then. Without a sensor all bits are ones.

use super::Bench;
use crate::clock::{SimClock, VirtualClock};
use crate::peripherals::imu::Chip;
use embedded_hal_async::spi::{ErrorKind, ErrorType, Mode, Operation, SpiDevice};
use stand_firmware::board::{Clock, SensorSpi, UnsupportedMode};
use std::cell::RefCell;

/// Board clock steps per byte: 0.8 µs.
const STEPS_PER_BYTE: u64 = 8;
/// Setup of DMA, chip select and the final interrupt: about 5 µs, measured on an STM32F4 at 180 MHz.
const STEPS_PER_TRANSACTION: u64 = 50;

/// The bus of one simulated board.
pub struct SensorBus<'a> {
    pub(super) bench: &'a RefCell<Bench>,
    pub(super) clock: &'a VirtualClock,
    pub(super) mode: Mode,
}

impl SensorSpi for SensorBus<'_> {
    fn set_mode(&mut self, mode: Mode) -> Result<(), UnsupportedMode> {
        self.mode = mode;
        Ok(())
    }
}

/// The bus itself never fails: a missing device reads as ones.
impl ErrorType for SensorBus<'_> {
    type Error = ErrorKind;
}

impl SpiDevice for SensorBus<'_> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let clock = SimClock(self.clock);
        let mut steps = STEPS_PER_TRANSACTION;
        for operation in operations.iter() {
            steps += match operation {
                Operation::Read(words) => words.len() as u64 * STEPS_PER_BYTE,
                Operation::Write(words) => words.len() as u64 * STEPS_PER_BYTE,
                Operation::Transfer(read, write) => read.len().max(write.len()) as u64 * STEPS_PER_BYTE,
                Operation::TransferInPlace(words) => words.len() as u64 * STEPS_PER_BYTE,
                Operation::DelayNs(ns) => u64::from(ns.div_ceil(100)),
            };
        }
        clock.until(clock.now() + steps).await;
        let mut bench = self.bench.borrow_mut();
        let mut exchange = bench.select_sensor(clock.now(), self.mode);
        for operation in operations {
            match operation {
                Operation::Read(words) => words.iter_mut().for_each(|word| *word = exchange.byte(0)),
                Operation::Write(words) => words.iter().for_each(|word| _ = exchange.byte(*word)),
                Operation::Transfer(read, write) => {
                    for k in 0..read.len().max(write.len()) {
                        let answer = exchange.byte(write.get(k).copied().unwrap_or(0));
                        if let Some(word) = read.get_mut(k) {
                            *word = answer;
                        }
                    }
                }
                Operation::TransferInPlace(words) => words.iter_mut().for_each(|word| *word = exchange.byte(*word)),
                Operation::DelayNs(_) => {}
            }
        }
        Ok(())
    }
}

/// The selected device, or none, and the mode of the clock.
pub(super) struct Exchange<'a>(pub Option<&'a mut Chip>, pub Mode);

impl Exchange<'_> {
    fn byte(&mut self, sent: u8) -> u8 {
        let mode = self.1;
        self.0.as_mut().map_or(0xFF, |chip| chip.byte(sent, mode))
    }
}
