//! The SPI line to the sensor under test: SPI2 by DMA, one device on it.
//!
//! Whatever is asked for goes by a copy and one kind of transfer, both ways at once: each of the HAL's kinds is a quarter of a kilobyte.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, Error, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, dma, interrupt, peripherals};
use embedded_hal_async::spi::{ErrorType, Operation, SpiDevice};

/// The bus with its chip select.
pub struct SensorBus {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
}

/// Bytes in one transfer: a burst of the sensor's FIFO.
const MOST: usize = 96;

/// ST's inertial sensors take 10 MHz (DS13012, table 7); the divider of 45 MHz makes 5.6 of what is asked here.
const CLOCK: Hertz = Hertz(8_000_000);

impl ErrorType for SensorBus {
    type Error = Error;
}

impl SpiDevice for SensorBus {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Error> {
        self.select.set_low();
        let mut done = Ok(());
        for operation in operations {
            if let Operation::DelayNs(ns) = operation {
                // By counting cycles: at most microseconds are asked for.
                cortex_m::asm::delay(ns.saturating_mul(crate::clocks::CORE_HZ / 10_000_000) / 100 + 1);
            }
            let mut from = 0;
            while done.is_ok() {
                let mut copy = [0; MOST];
                let given = sent(operation).get(from..).unwrap_or_default();
                copy.iter_mut().zip(given).for_each(|(place, byte)| *place = *byte);
                let length = given.len().max(received(operation).len().saturating_sub(from)).min(MOST);
                let Some(bytes) = copy.get_mut(..length).filter(|bytes| !bytes.is_empty()) else { break };
                done = self.spi.transfer_in_place(bytes).await;
                received(operation).iter_mut().skip(from).zip(bytes).for_each(|(place, byte)| *place = *byte);
                from += length;
            }
        }
        self.select.set_high();
        done
    }
}

/// What an operation sends; zeros where it is shorter than what it receives.
fn sent<'o>(operation: &'o Operation<'_, u8>) -> &'o [u8] {
    match operation {
        Operation::Write(bytes) | Operation::Transfer(_, bytes) => bytes,
        Operation::TransferInPlace(bytes) => bytes,
        Operation::Read(_) | Operation::DelayNs(_) => &[],
    }
}

/// Where it wants what comes.
fn received<'o>(operation: &'o mut Operation<'_, u8>) -> &'o mut [u8] {
    match operation {
        Operation::Read(bytes) | Operation::Transfer(bytes, _) | Operation::TransferInPlace(bytes) => bytes,
        Operation::Write(_) | Operation::DelayNs(_) => &mut [],
    }
}

/// The pins of the bus: clock, data out, data in, chip select.
pub struct Pins {
    /// SCK.
    pub clock: Peri<'static, peripherals::PB13>,
    /// MOSI.
    pub to_sensor: Peri<'static, peripherals::PB15>,
    /// MISO.
    pub from_sensor: Peri<'static, peripherals::PB14>,
    /// CS.
    pub select: Peri<'static, peripherals::PB12>,
}

/// Sets the bus up.
pub fn start<I>(
    spi: Peri<'static, peripherals::SPI2>,
    pins: Pins,
    send: Peri<'static, peripherals::DMA1_CH4>,
    receive: Peri<'static, peripherals::DMA1_CH3>,
    interrupts: I,
) -> SensorBus
where
    I: interrupt::typelevel::Binding<interrupt::typelevel::DMA1_STREAM4, dma::InterruptHandler<peripherals::DMA1_CH4>>
        + interrupt::typelevel::Binding<interrupt::typelevel::DMA1_STREAM3, dma::InterruptHandler<peripherals::DMA1_CH3>>
        + 'static,
{
    let mut config = Config::default();
    config.mode = MODE_3;
    config.frequency = CLOCK;
    let spi = Spi::new(spi, pins.clock, pins.to_sensor, pins.from_sensor, send, receive, interrupts, config);
    SensorBus { spi, select: Output::new(pins.select, Level::High, Speed::High) }
}
