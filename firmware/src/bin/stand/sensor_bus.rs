//! The SPI line to the sensor under test: SPI2 by DMA, one device on it.

use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{Config, MODE_3, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Peri, dma, interrupt, peripherals};
use embedded_hal_bus::spi::ExclusiveDevice;

/// The bus with its chip select.
pub type SensorBus = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, Pause>;

/// ST's inertial sensors take 10 MHz (DS13012, table 7); the divider of 45 MHz makes 5.6 of what is asked here.
const CLOCK: Hertz = Hertz(8_000_000);

/// Short waits within a transfer, by counting cycles: at most microseconds are asked for.
pub struct Pause;

impl embedded_hal_async::delay::DelayNs for Pause {
    async fn delay_ns(&mut self, ns: u32) {
        cortex_m::asm::delay(ns.saturating_mul(crate::clocks::CORE_HZ / 10_000_000) / 100 + 1);
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
///
/// # Errors
/// If the chip select cannot be set, which on this chip does not happen.
pub fn start<I>(
    spi: Peri<'static, peripherals::SPI2>,
    pins: Pins,
    send: Peri<'static, peripherals::DMA1_CH4>,
    receive: Peri<'static, peripherals::DMA1_CH3>,
    interrupts: I,
) -> Result<SensorBus, core::convert::Infallible>
where
    I: interrupt::typelevel::Binding<interrupt::typelevel::DMA1_STREAM4, dma::InterruptHandler<peripherals::DMA1_CH4>>
        + interrupt::typelevel::Binding<interrupt::typelevel::DMA1_STREAM3, dma::InterruptHandler<peripherals::DMA1_CH3>>
        + 'static,
{
    let mut config = Config::default();
    config.mode = MODE_3;
    config.frequency = CLOCK;
    let bus = Spi::new(spi, pins.clock, pins.to_sensor, pins.from_sensor, send, receive, interrupts, config);
    ExclusiveDevice::new(bus, Output::new(pins.select, Level::High, Speed::High), Pause)
}
