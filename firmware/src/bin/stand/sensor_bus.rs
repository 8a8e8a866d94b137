//! SPI bus of the sensor under test: SPI2 with DMA and one device.
//!
//! The clock is idle high (mode 3) for the ISM330DHCX and idle low (mode 0) for the ADXL355; the driver selects it. The mode changes while
//! the chip select is high, when both parts ignore the clock.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, Error, MODE_0, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, dma, interrupt, peripherals};
use embedded_hal_async::spi::{self, ErrorType, Operation, SpiDevice};
use stand_firmware::board::{SensorSpi, UnsupportedMode};
use stand_firmware::sensors::selected::SelectedDevice;

/// The sensor behind its chip select.
pub struct SensorBus {
    device: SelectedDevice<Spi<'static, Async, Master>, Output<'static>>,
    config: Config,
}

/// Both sensors allow 10 MHz (DS13012, table 7; ADXL355 data sheet, SPI timing). The prescaler of the 45 MHz clock gives 5.6 MHz for this
/// request.
const CLOCK: Hertz = Hertz(8_000_000);

impl ErrorType for SensorBus {
    type Error = Error;
}

impl SpiDevice for SensorBus {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Error> {
        self.device.transaction(operations).await
    }
}

/// Busy wait: the driver's delays are microseconds.
fn delay_ns(ns: u32) {
    cortex_m::asm::delay(ns.saturating_mul(crate::clocks::CORE_HZ / 10_000_000) / 100 + 1);
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
            self.device.bus.set_config(&self.config).map_err(|()| UnsupportedMode)?;
        }
        Ok(())
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
    SensorBus { device: SelectedDevice::new(spi, Output::new(pins.select, Level::High, Speed::High), delay_ns), config }
}
