//! The stand on the NUCLEO-F446RE: the library, on this board.
//!
//! What is here names the chip; what the stand does is in the library. The tick runs in TIM1's interrupt above all else, what the line
//! receives passes a guard in the next one, and everything else is one task: the library's app with its console on the ST-Link's serial line, the
//! button and the lamp, the watchdog. Words for the developer go over RTT. Pins and wiring: firmware/README.md.
#![no_std]
#![no_main]

mod analog;
mod bridge;
mod clocks;
mod encoder;
mod flash;
mod last_words;
mod panel;
mod sensor_bus;
mod sensors;
mod serial;
mod tick;
mod torquer;
mod watchdog;

use defmt::{error, info};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_futures::join::join3;
use embassy_stm32::{bind_interrupts, dma, gpio, pac, peripherals, rcc, timer, uid, usart};
use encoder::{EdgeTimer, Encoder, IndexTime};
use flash::SettingsFlash;
use panel::{Typed, WithButton};
use stand_firmware::app::{App, Identity, Memory, assemble};
use stand_firmware::settings::{Kept, Store};
use stand_firmware::speed_loop::Interrupt;
use static_cell::{ConstStaticCell, StaticCell};

bind_interrupts!(struct Irqs {
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    // In this order: the first sees to the receiver's flags, the second to the sender's.
    USART2 => serial::Watch, usart::InterruptHandler<peripherals::USART2>;
});

#[embassy_executor::main]
async fn main(_spawner: Spawner) -> ! {
    let p = embassy_stm32::init(clocks::config());
    clocks::enable_flash_caches();
    // First of all: what tells time by the cycle counter must find it counting.
    tick::count_cycles();
    let bridge = bridge::Bridge::new(p.TIM1, p.PA8, p.PA9);
    analog::start(p.ADC1, p.DMA2_CH0, (p.PC0, p.PC1, p.PC2, p.PC3, p.PC4), bridge::FULL);
    torquer::start(p.DAC1, p.PA4);

    let (interrupt, app) = make_app(SettingsFlash::new(p.FLASH));
    let a_b = timer::qei::Config::default;
    let _counters = (timer::qei::Qei::new(p.TIM3, p.PA6, p.PA7, a_b()), timer::qei::Qei::new(p.TIM4, p.PB6, p.PB7, a_b()));
    rcc::enable_and_reset::<peripherals::TIM5>();
    rcc::enable_and_reset::<peripherals::TIM2>();
    let encoder = Encoder::new(pac::TIM3, pac::TIM5, p.PA0, p.PA1, p.PB0, EdgeTimer::Tim5);
    let own_encoder = Encoder::new(pac::TIM4, pac::TIM2, p.PA15, p.PB3, p.PB8, EdgeTimer::Tim2);
    let index_time = IndexTime::new(pac::TIM2, p.PB2);
    let contact = gpio::Input::new(p.PC8, gpio::Pull::Up);
    tick::start(tick::Tick::new(interrupt, encoder, bridge, contact));

    let pins = sensor_bus::Pins { clock: p.PB13, to_sensor: p.PB15, from_sensor: p.PB14, select: p.PB12 };
    let bus = sensor_bus::start(p.SPI2, pins, p.DMA1_CH4, p.DMA1_CH3, Irqs);
    let mut board = sensors::StandBoard::new(own_encoder, index_time, bus);

    let mut line = usart::Config::default();
    line.baudrate = serial::BAUD;
    let Ok(transmit) = usart::UartTx::new(p.USART2, p.PA2, p.DMA1_CH6, Irqs, line) else {
        error!("the serial line cannot do {} baud", serial::BAUD);
        give_up()
    };
    let typed = Typed::new();
    let receive = WithButton::new(serial::Receiver::new(&transmit, p.PA3, p.DMA1_CH5), &typed);
    let button = gpio::Input::new(p.PC13, gpio::Pull::None);
    let lamp = gpio::Output::new(p.PA5, gpio::Level::Low, gpio::Speed::Low);
    info!("ready at {} baud", serial::BAUD);
    join3(app.run(&mut board, receive, transmit), panel::run(button, lamp, &typed), watchdog::feed(p.IWDG)).await.1
}

/// The library's parts in their statics. A function of its own, so that its large frame is gone from the stack when the app runs.
#[inline(never)]
fn make_app(settings: SettingsFlash) -> (Interrupt<'static>, &'static mut App<'static, SettingsFlash>) {
    static MEMORY: ConstStaticCell<Memory> = ConstStaticCell::new(Memory::new());
    static APP: StaticCell<App<'static, SettingsFlash>> = StaticCell::new();
    let store = Store::new(settings, flash::BEGINS, flash::SECTOR);
    let identity = Identity { model: "NUCLEO-F446RE", serial: uid::uid_hex(), baud: serial::BAUD };
    match assemble(MEMORY.take(), store, Kept::default(), identity, &serial::STOP) {
        Ok((interrupt, app)) => (interrupt, APP.init(app)),
        Err(wrong) => {
            error!("the default settings cannot be used: {}", wrong.parameter());
            give_up()
        }
    }
}

/// There is nothing to go on with, and it was said. The drive is off: without tasks nothing asks for any.
fn give_up() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
