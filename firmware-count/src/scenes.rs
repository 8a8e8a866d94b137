//! What is gone through: each mode, each limit, each fault, with what is learnt and without, orders and lessons arriving.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::meter::Meter;
use crate::motor::{Motor, Wrong};
use crate::tally::Tally;
use stand_firmware::board::{CONTROL_PER_ROW, Hardware};
use stand_firmware::capture::Memory;
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics};
use stand_firmware::gyro_loop::TimedOutput;
use stand_firmware::speed_loop::{Command, Config, Fault, Interrupt, Limits, Mailboxes, Segment, Settings, SpeedLoop, Zero};

/// Ticks of a scene: two seconds.
const TICKS: u64 = 20_000;

/// What is asked for.
#[derive(Clone, Copy)]
pub enum Ask {
    /// Nothing.
    Off,
    /// ± so many volts, a quarter of a second each.
    Voltage(f64),
    /// A rate that swings between ± so many rad/s, twice a second.
    Rate(f64),
    /// So many volts from the middle on.
    Push(f64),
    /// ± an angle of so many rad, half a second each.
    Position(f64),
    /// A rate, and no order after the first: the segment runs out.
    Forgotten(f64),
}

/// What is learnt.
#[derive(Clone, Copy)]
pub enum Learnt {
    /// Nothing.
    Nothing,
    /// Friction and so many harmonics, from the beginning.
    Harmonics(usize),
    /// The same again every hundredth of a second, by the mailbox.
    Lessons(usize),
}

/// A scene.
pub struct Scene {
    /// Its name in the table.
    pub name: &'static str,
    ask: Ask,
    learnt: Learnt,
    /// What is wrong in its second half.
    wrong: Wrong,
    /// The drift of a gyro is measured meanwhile: the torquer is driven and its gyro sampled each millisecond.
    drives_torquer: bool,
    /// What must be seen in it, so that a scene does not go by its subject.
    shows: Shows,
}

/// What a scene must show at some time.
#[derive(Clone, Copy)]
enum Shows {
    Limit(Limits),
    Fault(Fault),
    NoFault,
}

const fn scene(name: &'static str, ask: Ask, learnt: Learnt) -> Scene {
    Scene { name, ask, learnt, wrong: Wrong::Nothing, drives_torquer: false, shows: Shows::NoFault }
}

const fn wrong(name: &'static str, ask: Ask, wrong: Wrong, shows: Shows) -> Scene {
    Scene { name, ask, learnt: Learnt::Harmonics(8), wrong, drives_torquer: false, shows }
}

/// All scenes.
pub const SCENES: &[Scene] = &[
    scene("off", Ask::Off, Learnt::Nothing),
    scene("voltage", Ask::Voltage(3.0), Learnt::Nothing),
    scene("rate, nothing learnt", Ask::Rate(5.0), Learnt::Nothing),
    scene("rate, slow", Ask::Rate(0.01), Learnt::Nothing),
    scene("rate, friction learnt", Ask::Rate(5.0), Learnt::Harmonics(0)),
    scene("rate, 1 harmonic", Ask::Rate(5.0), Learnt::Harmonics(1)),
    scene("rate, 3 harmonics", Ask::Rate(5.0), Learnt::Harmonics(3)),
    scene("rate, 8 harmonics", Ask::Rate(5.0), Learnt::Harmonics(8)),
    scene("rate, lessons of 8 arriving", Ask::Rate(5.0), Learnt::Lessons(8)),
    Scene { drives_torquer: true, ..scene("rate, 8 harmonics, drift pulses", Ask::Rate(5.0), Learnt::Harmonics(8)) },
    wrong("rate, orders fail to come", Ask::Forgotten(5.0), Wrong::Nothing, Shows::Limit(Limits::STARVED)),
    wrong("rate, jammed: current limit, slip", Ask::Rate(20.0), Wrong::Jammed, Shows::Limit(Limits::SLIPPED)),
    wrong("rate, acceleration limit", Ask::Rate(34.0), Wrong::Nothing, Shows::Limit(Limits::ACCELERATION)),
    scene("position, 8 harmonics", Ask::Position(6.0), Learnt::Harmonics(8)),
    wrong("fault: stop", Ask::Rate(5.0), Wrong::Stop, Shows::Fault(Fault::EmergencyStop)),
    wrong("fault: encoder lost", Ask::Rate(20.0), Wrong::NoEdges, Shows::Fault(Fault::EncoderLost)),
    wrong("fault: supply low", Ask::Rate(5.0), Wrong::LowSupply, Shows::Fault(Fault::SupplyLow)),
    wrong("fault: stall", Ask::Push(3.3), Wrong::Jammed, Shows::Fault(Fault::Stall)),
    wrong("rate, index lost", Ask::Rate(5.0), Wrong::NoIndex, Shows::NoFault),
    wrong("fault: overspeed", Ask::Rate(5.0), Wrong::Turned(46.0), Shows::Fault(Fault::Overspeed)),
    wrong("fault: clock, cleared each row", Ask::Rate(5.0), Wrong::LosesTicks(7), Shows::Fault(Fault::Clock)),
];

/// The torquer's converter and what is left of the ring of conversions, in the place of the registers; the ring is the board's.
static CONVERTER: AtomicU32 = AtomicU32::new(0);
static LEFT: AtomicU32 = AtomicU32::new(0);
const CHANNELS: u32 = 5;
const SWEEPS: u32 = 64;
static OUTPUT: TimedOutput = TimedOutput::new();
static MEMORY: Memory = Memory::new();

/// Plays a scene from power-on and counts each of its ticks.
///
/// # Panics
/// If the scene does not show what it is there for.
pub fn play(scene: &Scene, meter: &Meter) -> Tally {
    let hardware = Hardware::default();
    let harmonics = match scene.learnt {
        Learnt::Nothing => None,
        Learnt::Harmonics(n) | Learnt::Lessons(n) => Some(n),
    };
    let settings = Settings { compensation: compensation(harmonics), ..Settings::default() };
    let config = Config::new(&settings, &hardware).unwrap_or_else(|wrong| panic!("{}: {wrong}", scene.name));
    let mailboxes = Mailboxes::new();
    let mut interrupt = Interrupt::new(SpeedLoop::new(config), &mailboxes).recording(MEMORY.recorder(1_500));
    let mut motor = Motor::new(hardware, settings);
    let mut tally = Tally::new();
    let (mut limits, mut fault, mut clear) = (Limits::default(), Fault::None, 0);
    let mut samples = 0;
    let mut n = 0;
    while n < TICKS {
        n = motor.pass();
        if n == TICKS / 2 {
            motor.wrong = scene.wrong;
        }
        if n % CONTROL_PER_ROW == 5 {
            if scene.wrong == Wrong::LosesTicks(7) {
                clear += 1;
            }
            if let Some(segment) = asked(scene.ask, &hardware, n) {
                mailboxes.commands.post(Command { segment, clear, ..Command::default() });
            }
        }
        if n % 100 == 0 && matches!(scene.learnt, Learnt::Lessons(_)) {
            mailboxes.compensation.post(config.compensation());
        }
        if scene.drives_torquer && n % CONTROL_PER_ROW == 3 {
            // As the measurement's task does it: the sample of this millisecond, and a pulse for the next.
            LEFT.store(n as u32 % (CHANNELS * SWEEPS), Ordering::Relaxed);
            samples += u64::from(OUTPUT.take_sweep().is_some());
            OUTPUT.set((n - 3 + CONTROL_PER_ROW) as u32, if n < TICKS / 2 { 2500 } else { 1500 });
        }
        let instructions = meter.count(|| tick(&mut interrupt, &mut motor, n as u32));
        tally.add(instructions);
        if let Some(report) = mailboxes.reports.take() {
            limits.0 |= report.limits.0;
            if report.fault != Fault::None {
                fault = report.fault;
            }
        }
    }
    if scene.drives_torquer {
        assert!(samples + 2 >= TICKS / CONTROL_PER_ROW, "{}: the torquer took {samples} pulses", scene.name);
        assert_eq!(CONVERTER.load(Ordering::Relaxed), 1500, "{}", scene.name);
    }
    match scene.shows {
        Shows::Limit(limit) => assert!(limits.contains(limit), "{}: the limit was never in force: {limits:?}", scene.name),
        Shows::Fault(awaited) => assert_eq!(fault, awaited, "{}", scene.name),
        Shows::NoFault => assert_eq!(fault, Fault::None, "{}", scene.name),
    }
    tally
}

/// The interrupt as the board calls it, the torquer first; a function of its own, so that nothing of it moves past the meter.
#[inline(never)]
fn tick(interrupt: &mut Interrupt<'_>, motor: &mut Motor, n: u32) {
    if let Some(value) = OUTPUT.take(n) {
        CONVERTER.store(u32::from(value), Ordering::Relaxed);
        OUTPUT.set_sweep((CHANNELS * SWEEPS).saturating_sub(LEFT.load(Ordering::Relaxed)) / CHANNELS % SWEEPS);
    }
    interrupt.run(motor);
}

/// The segment that a profile would post at tick `n` for the row after the next.
fn asked(ask: Ask, hardware: &Hardware, n: u64) -> Option<Segment> {
    let (start, ticks) = (n - n % CONTROL_PER_ROW + CONTROL_PER_ROW, CONTROL_PER_ROW as u16);
    // A triangle of half a second: the ramp is under way most of the time.
    let triangle = |n: u64| {
        let phase = (n % 5_000) as f64 / 2_500.0;
        1.0 - 2.0 * (phase - 1.0).abs()
    };
    match ask {
        Ask::Off => Some(Segment::off(start)),
        Ask::Voltage(volts) => Some(Segment::voltage(hardware, start, ticks, if n % 5_000 < 2_500 { volts } else { -volts })),
        Ask::Rate(rad_s) => Some(Segment::rate(hardware, start, ticks, rad_s * triangle(start), rad_s * triangle(start + CONTROL_PER_ROW))),
        Ask::Push(volts) => Some(Segment::voltage(hardware, start, ticks, if n < TICKS / 2 { 0.0 } else { volts })),
        Ask::Position(rad) => {
            let rad = if n % 10_000 < 5_000 { rad } else { -rad };
            Some(Segment::position(hardware, start, Zero::PowerOn, rad, Some(20.0)))
        }
        Ask::Forgotten(rad_s) => (n < 10).then(|| Segment::rate(hardware, start, ticks, 0.0, rad_s)),
    }
}

/// Friction and `harmonics` harmonics; nothing where there is `None`.
fn compensation(harmonics: Option<usize>) -> Compensation {
    let Some(n) = harmonics else { return Compensation::default() };
    let harmonics = (1..=n).map(|k| Harmonic { order: 7 * k as u16, torque_N_m: 2e-3 / k as f64, phase_rad: 0.7 * k as f64 });
    Compensation {
        coulomb_N_m: 9e-4,
        viscous_N_m_s: 6e-5,
        harmonics: Harmonics::of(harmonics).unwrap_or_default(),
        ..Compensation::default()
    }
}
