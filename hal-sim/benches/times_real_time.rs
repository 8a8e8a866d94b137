//! Simulated time over real time of one simulated stand on one core: firmware tick, sensors, virtual time, plant.
//!
//! `cargo bench -p hal-sim --bench times_real_time`. Best and median of several sessions; the last line is the time of one tick alone.

use hal_sim::board::PlantPort;
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::peripherals::SensorSetup;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{SessionRequest, StandSetup, run};
use stand_firmware::board::{CONTROL_HZ, EncoderCount, Hardware, Sensed};
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::{Command, Config, Mode, Segment, Settings, SpeedLoop};
use std::hint::black_box;
use std::time::Instant;

/// Simulated time of a session, s.
const SECONDS: f64 = 30.0;
/// Sessions per line of the table.
const RUNS: usize = 7;

/// Best and median of simulated time over real time.
fn times<P: PlantPort + 'static>(stand: StandSetup, plant: impl Fn() -> P, mode: Mode, kind: ProfileKind) -> (f64, f64) {
    let mut factors: Vec<f64> = (0..RUNS)
        .map(|_| {
            let begin = Instant::now();
            let record = run(stand, plant(), SessionRequest::new(mode, kind, SECONDS, 1));
            black_box(record.expect("the session is valid"));
            SECONDS / begin.elapsed().as_secs_f64()
        })
        .collect();
    factors.sort_by(f64::total_cmp);
    (factors[RUNS - 1], factors[RUNS / 2])
}

/// Mean time of one tick of the speed loop, ns.
fn tick_alone() -> f64 {
    const TICKS: u64 = 3_000_000;
    let hardware = Hardware::default();
    let config = Config::new(&Settings::default(), &hardware).expect("the default is valid");
    let mut speed_loop = SpeedLoop::new(config);
    let command = Command { segment: Segment::rate(&hardware, 1, 10, 10.0, 10.0), ..Command::default() };
    let begin = Instant::now();
    for n in 0..TICKS {
        // 10 rad/s are 3.183 counts per tick.
        let encoder = EncoderCount((n * 3183 / 1000) as u16);
        let command = n.is_multiple_of(10).then_some(command);
        black_box(speed_loop.tick(black_box(&Sensed { tick: n, encoder, ..Sensed::default() }), command.as_ref()));
    }
    begin.elapsed().as_secs_f64() / TICKS as f64 * 1e9
}

fn main() {
    println!("{SECONDS} s sessions at {CONTROL_HZ} Hz, rows at 1 kHz; best and median of {RUNS}");
    println!("{:<34}{:>10}{:>10}", "", "best ×", "median ×");
    let without_noise = StandSetup { sensors: SensorSetup::ideal(), ..StandSetup::default() };
    let default = Stand::default();
    for (name, mode, kind) in [
        ("default stand, voltage, multi-step", Mode::Voltage, ProfileKind::MultiStep),
        ("default stand, rate, multi-step", Mode::Rate, ProfileKind::MultiStep),
        ("default stand, rate, multisine", Mode::Rate, ProfileKind::Multisine),
    ] {
        let plant = || Plant::new(&default, 0.0).expect("the default stand is valid");
        let (best, median) = times(default.setup(), plant, mode, kind);
        println!("{name:<34}{best:>10.0}{median:>10.0}");
    }
    println!("with an exactly solved linear motor:");
    for (name, stand, mode, kind) in [
        ("voltage, multi-step", StandSetup::default(), Mode::Voltage, ProfileKind::MultiStep),
        ("rate, multi-step", StandSetup::default(), Mode::Rate, ProfileKind::MultiStep),
        ("rate, multisine", StandSetup::default(), Mode::Rate, ProfileKind::Multisine),
        ("rate, multi-step, without noise", without_noise, Mode::Rate, ProfileKind::MultiStep),
    ] {
        let (best, median) = times(stand, LinearMotor::default, mode, kind);
        println!("{name:<34}{best:>10.0}{median:>10.0}");
    }
    println!("the tick of the speed loop alone, rate mode: {:.1} ns", tick_alone());
}
