//! Firmware image for the NUCLEO-F446RE: the library on this board's peripherals.
//!
//! This folder contains the hardware drivers only; the behaviour is in the library. TIM1's interrupt has the highest priority and runs the
//! control law. The USART interrupt is next and scans received bytes for a stop. The measurement runs on an executor in an interrupt below
//! both, which preempts everything in thread mode: the app with its console on the ST-Link's serial port, the button with the LED, and the
//! watchdog. Log messages go over RTT (defmt). Pins and wiring: docs/hardware.md.
#![no_std]
#![no_main]

mod analog;
mod bridge;
mod button;
mod clocks;
mod encoder;
mod flash;
mod output_timeout;
mod panic_handler;
mod reset;
mod sensor_bus;
mod sensors;
mod serial;
mod tick;
mod torquer;
mod watchdog;

use defmt::{error, info};
use defmt_rtt as _;
use embassy_executor::{InterruptExecutor, Spawner};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::{Peri, bind_interrupts, dma, gpio, interrupt, pac, peripherals, rcc, timer, uid, usart};
use encoder::{EdgeTimer, Encoder, RisingEdges};
use flash::SettingsFlash;
use stand_firmware::app::{App, Identity, Measurement, Memory, assemble};
use stand_firmware::button::{ReceiverWithButton, TypedLine};
use stand_firmware::reset_cause::ResetCause;
use stand_firmware::settings::{Kept, Store};
use stand_firmware::speed_loop::Interrupt;
use static_cell::{ConstStaticCell, StaticCell};

bind_interrupts!(struct Irqs {
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    USART2 => serial::ReceiveInterrupt, usart::InterruptHandler<peripherals::USART2>;
});

#[embassy_executor::main]
async fn main(spawner: Spawner) -> ! {
    let p = embassy_stm32::init(clocks::config());
    clocks::enable_flash_caches();
    watchdog::reload();
    let reset_cause = reset::take_cause();
    info!("start after {}", reset_cause.name());
    reset::watch_supplies();
    // Before anything that measures time by the cycle counter.
    tick::count_cycles();
    let bridge = bridge::Bridge::new(p.TIM1, p.PA8, p.PA9);
    analog::start(p.ADC1, p.DMA2_CH0, (p.PC0, p.PC1, p.PC2, p.PC3, p.PC4), bridge::TOP);
    torquer::start(p.DAC1, p.PA4);

    let (interrupt, measurement, app) = make_app(SettingsFlash::new(p.FLASH), reset_cause);
    let qei = timer::qei::Config::default;
    let _counters = (timer::qei::Qei::new(p.TIM3, p.PA6, p.PA7, qei()), timer::qei::Qei::new(p.TIM4, p.PB6, p.PB7, qei()));
    rcc::enable_and_reset::<peripherals::TIM5>();
    rcc::enable_and_reset::<peripherals::TIM2>();
    let encoder = Encoder::new(pac::TIM3, pac::TIM5, p.PA0, p.PA1, p.PB0, EdgeTimer::Tim5);
    let measurement_encoder = Encoder::new(pac::TIM4, pac::TIM2, p.PA15, p.PB3, p.PB8, EdgeTimer::Tim2);
    let index_time = RisingEdges::of_index(pac::TIM2, p.PB2);
    let clock_reference = RisingEdges::of_clock_reference(pac::TIM2, p.PB10);
    let stop_contact = gpio::Input::new(p.PC8, gpio::Pull::Up);
    output_timeout::start(p.TIM8, p.DMA2_CH1, bridge::outputs_off());
    tick::start(tick::Tick::new(interrupt, encoder, bridge, stop_contact));

    let pins = sensor_bus::Pins { clock: p.PB13, to_sensor: p.PB15, from_sensor: p.PB14, select: p.PB12 };
    let bus = sensor_bus::start(p.SPI2, pins, p.DMA1_CH4, p.DMA1_CH3, Irqs);
    let board = sensors::StandBoard::new(measurement_encoder, index_time, clock_reference, bus);

    let mut line = usart::Config::default();
    line.baudrate = serial::BAUD;
    let Ok(transmit) = usart::UartTx::new(p.USART2, p.PA2, p.DMA1_CH6, Irqs, line) else {
        error!("the USART cannot generate {} baud", serial::BAUD);
        halt()
    };
    let receive = ReceiverWithButton::new(serial::Receiver::new(&transmit, p.PA3, p.DMA1_CH5), &TYPED_LINE);
    let button = gpio::Input::new(p.PC13, gpio::Pull::None);
    let led = gpio::Output::new(p.PA5, gpio::Level::Low, gpio::Speed::Low);
    let (Ok(button), Ok(watchdog), Ok(measurement)) =
        (button_task(button, led), watchdog_task(p.IWDG), measurement_task(measurement, board))
    else {
        error!("a task is started twice");
        halt()
    };
    spawner.spawn(button);
    spawner.spawn(watchdog);
    interrupt::UART5.set_priority(MEASUREMENT_PRIORITY);
    MEASUREMENT.start(interrupt::UART5).spawn(measurement);
    info!("ready at {} baud", serial::BAUD);
    app.run(&tick::BoardClock, receive, transmit).await;
    error!("the app has ended");
    halt()
}

/// Executor of the measurement, in the interrupt of UART5, which is not used by this board (RM0390, table 38).
static MEASUREMENT: InterruptExecutor = InterruptExecutor::new();
/// Below the tick (0) and the guard of the serial line (1), above the DMA handlers of the HAL (6).
const MEASUREMENT_PRIORITY: Priority = Priority::P2;

#[embassy_stm32::interrupt]
fn UART5() {
    // SAFETY: `start` unmasks this interrupt after it has initialised the executor, and only this handler calls.
    unsafe { MEASUREMENT.on_interrupt() }
}

#[embassy_executor::task]
async fn measurement_task(measurement: &'static mut Measurement<'static>, mut board: sensors::StandBoard) -> ! {
    measurement.run(&mut board).await;
    // Without encoder readings the watchdog resets the chip.
    error!("the measurement has ended");
    halt()
}

/// Line that the button types into the console.
static TYPED_LINE: TypedLine = TypedLine::new();

#[embassy_executor::task]
async fn button_task(button: gpio::Input<'static>, led: gpio::Output<'static>) -> ! {
    button::run(button, led, &TYPED_LINE).await
}

#[embassy_executor::task]
async fn watchdog_task(watchdog: Peri<'static, peripherals::IWDG>) -> ! {
    watchdog::feed(watchdog).await
}

/// Builds the library's parts in statics. Not inlined: its frame of 27 KB must leave the stack before the app runs.
#[inline(never)]
fn make_app(
    settings: SettingsFlash,
    reset_cause: ResetCause,
) -> (Interrupt<'static>, &'static mut Measurement<'static>, &'static mut App<'static, SettingsFlash>) {
    static MEMORY: ConstStaticCell<Memory> = ConstStaticCell::new(Memory::new());
    static MEASURED: StaticCell<Measurement<'static>> = StaticCell::new();
    static APP: StaticCell<App<'static, SettingsFlash>> = StaticCell::new();
    let store = Store::new(settings, flash::SECTOR_OFFSETS, flash::SECTOR_BYTES);
    let identity = Identity { model: "NUCLEO-F446RE", serial: uid::uid_hex(), baud: serial::BAUD, reset_cause };
    match assemble(MEMORY.take(), store, Kept::default(), identity, &serial::STOP) {
        Ok((interrupt, measurement, app)) => (interrupt, MEASURED.init(measurement), APP.init(app)),
        Err(invalid) => {
            error!("invalid default setting: {}", invalid.parameter());
            halt()
        }
    }
}

/// Stops after an error at start-up, which the caller has logged. The drive stays off, since no task commands it.
fn halt() -> ! {
    loop {
        cortex_m::asm::wfi();
    }
}
