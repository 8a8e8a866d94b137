//! The stand on the NUCLEO-F446RE: the library, on this board.
//!
//! What is here names the chip; what the stand does is in the library. The blue button begins a session (a multi-step
//! profile in rate mode, 30 s) or stops the one that runs; held for two seconds, it has the stand measure its cogging and friction, which
//! it compensates from then on until it is switched off. Rows go over the ST-Link's serial line as a CSV log, words for
//! the developer over RTT. Pins and wiring: firmware/README.md.
#![no_std]
#![no_main]

mod bridge;
mod clocks;
mod index;
mod line;
mod panel;
mod sensors;
mod tick;

use core::future::Future;
use defmt::{error, info};
use embassy_executor::Spawner;
use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_stm32::{adc, bind_interrupts, dma, gpio, pac, peripherals, timer, usart};
use index::Index;
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
    DMA1_STREAM6 => dma::InterruptHandler<peripherals::DMA1_CH6>;
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

    let a_b = || timer::qei::Config { ch1_pull: gpio::Pull::Up, ch2_pull: gpio::Pull::Up, ..Default::default() };
    let qei = timer::qei::Qei::new(p.TIM3, p.PA6, p.PA7, a_b());
    let own_qei = timer::qei::Qei::new(p.TIM4, p.PB6, p.PB7, a_b());
    let (index, own_index) = (Index::new(pac::TIM3, p.PB0), Index::new(pac::TIM4, p.PB8));
    let bridge = bridge::Bridge::new(p.TIM1, p.PA8, p.PA9);
    // In this order: the converters share one reset, and ADC1 is set up anew for each of its conversions.
    let adc = adc::Adc::new(p.ADC1);
    let current = sensors::start_current(p.ADC2, p.PA0);
    let interrupt = Interrupt::new(SpeedLoop::new(config), order_reader, report_writer).listening(lesson_reader);
    tick::start(tick::Tick::new(interrupt, qei, index, bridge, current));

    let mut board = sensors::StandBoard::new(own_qei, own_index, adc, p.PA1, p.PA4);
    let mut panel = Panel::new(gpio::Input::new(p.PC13, gpio::Pull::None), gpio::Output::new(p.PA5, gpio::Level::Low, gpio::Speed::Low));
    let mut serial = usart::Config::default();
    serial.baudrate = line::BAUD;
    let Ok(uart) = usart::UartTx::new(p.USART2, p.PA2, p.DMA1_CH6, Irqs, serial) else {
        error!("the serial line cannot do {} baud", line::BAUD);
        return;
    };
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
