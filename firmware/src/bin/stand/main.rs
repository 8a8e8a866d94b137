//! The stand on the NUCLEO-F446RE: the library, on this board.
//!
//! What is here names the chip; what the stand does is in the library. The blue button begins a session (a multi-step
//! profile in rate mode, 30 s) or stops the one that runs; held for two seconds, it has the stand measure its cogging and friction, which
//! it compensates from then on until it is switched off. Rows go over the ST-Link's serial line as a CSV log, words for
//! the developer over RTT. Pins and wiring: firmware/README.md.
#![no_std]
#![no_main]

mod analog;
mod bridge;
mod clocks;
mod encoder;
mod flash;
mod line;
mod panel;
mod sensor_bus;
mod sensors;
mod serial;
mod tick;
mod watchdog;

use core::future::Future;
use defmt::{error, info};
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_stm32::dac::{DacChannel, Value};
use embassy_stm32::{bind_interrupts, dma, gpio, pac, peripherals, rcc, timer, usart};
use encoder::{EdgeTimer, Encoder, IndexTime};
use panel::Panel;
use stand_firmware::board::{Clock, Hardware};
use stand_firmware::calibration::{self, Found, Map, Refused, Watch};
use stand_firmware::measurement_loop::{Decimate, MeasurementLoop};
use stand_firmware::profile::{Profile, ProfileConfig, ProfileKind, ProfileRunner};
use stand_firmware::session;
use stand_firmware::speed_loop::{Config, Interrupt, Lessons, Mode, Orders, Reports, Settings, SpeedLoop};
use static_cell::StaticCell;
use {defmt_rtt as _, panic_probe as _};

bind_interrupts!(struct Irqs {
    DMA1_STREAM3 => dma::InterruptHandler<peripherals::DMA1_CH3>;
    DMA1_STREAM4 => dma::InterruptHandler<peripherals::DMA1_CH4>;
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
    // In this order: the first sees to the receiver's flags, the second to the sender's.
    USART2 => serial::Watch, usart::InterruptHandler<peripherals::USART2>;
});

/// What the button runs: rad/s, and seconds.
const AMPLITUDE_RAD_S: f64 = 15.0;
const SECONDS: f64 = 30.0;
const SEED: u64 = 1;

static ORDERS: StaticCell<Orders> = StaticCell::new();
static REPORTS: StaticCell<Reports> = StaticCell::new();
static LESSONS: StaticCell<Lessons> = StaticCell::new();
static MAP: StaticCell<Map> = StaticCell::new();

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let p = embassy_stm32::init(clocks::config());
    let hardware = Hardware::default();
    let (order_writer, order_reader) = ORDERS.init(Orders::new()).split();
    let (report_writer, report_reader) = REPORTS.init(Reports::new()).split();
    let (mut lesson_writer, lesson_reader) = LESSONS.init(Lessons::new()).split();
    let map = MAP.init(Map::new());
    let settings = Settings::default();
    let profile_config = ProfileConfig::new(ProfileKind::MultiStep, AMPLITUDE_RAD_S, SEED);
    let (config, profile) = match (Config::new(&settings, &hardware), Profile::new(&profile_config)) {
        (Ok(config), Ok(profile)) => (config, profile),
        (Err(wrong), _) | (_, Err(wrong)) => {
            error!("the settings cannot be used: {}", defmt::Display2Format(&wrong));
            return;
        }
    };

    // First of all: what tells time by the cycle counter must find it counting.
    tick::count_cycles();
    let bridge = bridge::Bridge::new(p.TIM1, p.PA8, p.PA9);
    analog::start(p.ADC1, p.DMA2_CH0, (p.PC0, p.PC1, p.PC2, p.PC3), bridge::FULL);
    // The torquer's amplifier gets no current at the middle of the range; nothing drives it yet.
    let mut torquer = DacChannel::new_blocking(p.DAC1, p.PA4);
    torquer.set(Value::Bit12Right(2048));
    torquer.enable();

    let a_b = || timer::qei::Config { ch1_pull: gpio::Pull::Up, ch2_pull: gpio::Pull::Up, ..Default::default() };
    let _counters = (timer::qei::Qei::new(p.TIM3, p.PA6, p.PA7, a_b()), timer::qei::Qei::new(p.TIM4, p.PB6, p.PB7, a_b()));
    rcc::enable_and_reset::<peripherals::TIM5>();
    rcc::enable_and_reset::<peripherals::TIM2>();
    let encoder = Encoder::new(pac::TIM3, pac::TIM5, p.PA0, p.PA1, p.PB0, EdgeTimer::Tim5);
    let own_encoder = Encoder::new(pac::TIM4, pac::TIM2, p.PA15, p.PB3, p.PB8, EdgeTimer::Tim2);
    let index_time = IndexTime::new(pac::TIM2, p.PB2);
    let contact = gpio::Input::new(p.PC8, gpio::Pull::Up);
    let interrupt = Interrupt::new(SpeedLoop::new(config), order_reader, report_writer).listening(lesson_reader);
    tick::start(tick::Tick::new(interrupt, encoder, bridge, contact));

    let pins = sensor_bus::Pins { clock: p.PB13, to_sensor: p.PB15, from_sensor: p.PB14, select: p.PB12 };
    let Ok(bus) = sensor_bus::start(p.SPI2, pins, p.DMA1_CH4, p.DMA1_CH3, Irqs);
    let mut board = sensors::StandBoard::new(own_encoder, index_time, bus);
    info!("the angle sensor gives {} codes of 4096", analog::slow().angle);
    let mut panel = Panel::new(gpio::Input::new(p.PC13, gpio::Pull::None), gpio::Output::new(p.PA5, gpio::Level::Low, gpio::Speed::Low));
    let mut serial = usart::Config::default();
    serial.baudrate = serial::BAUD;
    let Ok(uart) = usart::UartTx::new(p.USART2, p.PA2, p.DMA1_CH6, Irqs, serial) else {
        error!("the serial line cannot do {} baud", serial::BAUD);
        return;
    };
    let _receiver = serial::Receiver::new(&uart, p.PA3, p.DMA1_CH5);
    match line::send(uart) {
        Ok(task) => spawner.spawn(task),
        Err(_) => {
            error!("the serial line's task is there already");
            return;
        }
    }
    let Ok(mut rows) = Decimate::new(line::EVERY, line::Rows::default()) else { return };
    let mut runner = ProfileRunner::new(profile, Mode::Off, hardware, order_writer);
    let mut measurement = MeasurementLoop::new(hardware, report_reader);
    let clock = tick::BoardClock;
    info!("ready; the blue button begins; held for 2 s, it calibrates");

    loop {
        if panel.pressed_long(&clock).await {
            runner.clear_faults();
            panel.running(true);
            let watch = Watch::default();
            let calibration = calibration::run(&mut board, &mut runner, &mut measurement, &settings, map, &watch);
            let by_the_button = async {
                panel.pressed(&clock).await;
                watch.abort();
            };
            let found = with_a_way_out(calibration, by_the_button, progress(&clock, &watch)).await;
            panel.running(false);
            say(&found);
            if let Ok(found) = found
                && let Ok(config) = Config::new(&Settings { compensation: found.compensation, ..settings }, &hardware)
            {
                lesson_writer.post(&config.learnt());
            }
            continue;
        }
        let Ok(profile) = Profile::new(&profile_config) else { continue };
        runner.set(profile, Mode::Rate);
        runner.clear_faults();
        rows.restart();
        line::header(&hardware, &profile_config, "rate", measurement.zero_is_index()).await;
        panel.running(true);
        let session = session::run(&mut board, &mut runner, &mut measurement, session::rows_in(SECONDS), &mut rows);
        match select(session, panel.pressed(&clock)).await {
            Either::First(_) => info!("the session is over"),
            Either::Second(()) => {
                runner.stop(&clock);
                info!("stopped by the button");
            }
        }
        panel.running(false);
        let pace = measurement.pace();
        info!(
            "at {} s: rows came every {} to {} steps of 0.1 us; lost on the line: {}",
            clock.now().0 / stand_firmware::board::TICKS_PER_S,
            pace.least,
            pace.greatest,
            rows.sink().lost()
        );
    }
}

/// The first's answer, while the others do what they do beside it.
async fn with_a_way_out<T>(first: impl Future<Output = T>, abort: impl Future<Output = ()>, progress: impl Future<Output = ()>) -> T {
    match select(first, join(abort, progress)).await {
        Either::First(answer) => answer,
        // The progress never ends.
        Either::Second(_) => core::future::pending().await,
    }
}

/// Tells the developer how far it is, every five seconds, for ever.
async fn progress<C: Clock>(clock: &C, watch: &Watch) {
    loop {
        clock.until(clock.now() + 5 * stand_firmware::board::TICKS_PER_S).await;
        info!("calibration: {} %", watch.percent());
    }
}

/// Tells the developer what came of a calibration.
fn say(found: &Result<Found, Refused>) {
    match found {
        Ok(found) => {
            let friction = &found.compensation;
            info!("friction: {} N m dry, {} N m s/rad viscous", friction.coulomb_N_m as f32, friction.viscous_N_m_s as f32);
            for harmonic in friction.harmonics.as_slice() {
                info!("order {}: {} N m, {} rad", harmonic.order, harmonic.torque_N_m as f32, harmonic.phase_rad as f32);
            }
        }
        Err(why) => info!("nothing was learnt: {}", defmt::Display2Format(why)),
    }
}
