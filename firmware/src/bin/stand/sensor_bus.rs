//! SPI bus of the sensor under test: SPI2 with DMA and one device.
//!
//! The clock is idle high (mode 3) for the ISM330DHCX and idle low (mode 0) for the ADXL355; the driver selects it. The mode changes while the chip select
//! is high, when both parts ignore the clock.
//!
//! Every operation is a full-duplex transfer in a local buffer, so that one transfer function of the HAL serves all kinds of operations.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, Error, MODE_0, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, dma, interrupt, peripherals};
use embedded_hal_async::spi::{self, ErrorType, Operation, SpiDevice};
use stand_firmware::board::{SensorSpi, UnsupportedMode};

/// The bus with its chip select.
pub struct SensorBus {
    spi: Spi<'static, Async, Master>,
    select: Output<'static>,
    config: Config,
}

/// Size of the transfer buffer, bytes: a burst of the sensor's FIFO.
const MAX_TRANSFER_BYTES: usize = 96;

/// Both sensors allow 10 MHz (DS13012, table 7; ADXL355 data sheet, SPI timing). The prescaler of the 45 MHz clock gives 5.6 MHz for this request.
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
                // Busy wait: the driver's delays are microseconds.
                cortex_m::asm::delay(ns.saturating_mul(crate::clocks::CORE_HZ / 10_000_000) / 100 + 1);
            }
            let mut start = 0;
            while done.is_ok() {
                let mut buffer = [0; MAX_TRANSFER_BYTES];
                let to_send = sent(operation).get(start..).unwrap_or_default();
                buffer.iter_mut().zip(to_send).for_each(|(target, byte)| *target = *byte);
                let length = to_send.len().max(received(operation).len().saturating_sub(start)).min(MAX_TRANSFER_BYTES);
                let Some(bytes) = buffer.get_mut(..length).filter(|bytes| !bytes.is_empty()) else { break };
                done = self.spi.transfer_in_place(bytes).await;
                received(operation).iter_mut().skip(start).zip(bytes).for_each(|(target, byte)| *target = *byte);
                start += length;
            }
        }
        self.select.set_high();
        done
    }
}

impl SensorSpi for SensorBus {
    fn set_mode(&mut self, mode: spi::Mode) -> Result<(), UnsupportedMode> {
        // The HAL has the modes of embedded-hal 0.2.
        let mode = match mode {
            spi::MODE_0 => MODE_0,
            spi::MODE_3 => MODE_3,
            _ => return Err(UnsupportedMode),
        };
        if self.config.mode != mode {
            self.config.mode = mode;
            self.spi.set_config(&self.config).map_err(|()| UnsupportedMode)?;
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

/// Configures the bus.
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
    SensorBus { spi, select: Output::new(pins.select, Level::High, Speed::High), config }
}
