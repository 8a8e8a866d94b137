//! The scenes: every mode, limit and fault, with and without compensation, with commands and compensation updates arriving.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::meter::Meter;
use crate::motor::{Disturbance, Motor};
use crate::tally::Tally;
use stand_firmware::board::{CONTROL_PER_ROW, Hardware};
use stand_firmware::capture::Memory;
use stand_firmware::compensation::{Compensation, Harmonic, Harmonics};
use stand_firmware::gyro_loop::TimedOutput;
use stand_firmware::speed_loop::{Command, Config, Fault, Interrupt, Limits, Mailboxes, Segment, Settings, SpeedLoop, Zero};

/// Ticks of a scene: two seconds.
const TICKS: u64 = 20_000;

/// The command of a scene.
#[derive(Clone, Copy)]
pub enum Demand {
    /// None.
    Off,
    /// ± this voltage in V, a quarter of a second each.
    Voltage(f64),
    /// A rate that swings between ± this many rad/s, twice a second.
    Rate(f64),
    /// This voltage in V from the middle of the scene on.
    Step(f64),
    /// ± this angle in rad, half a second each.
    Position(f64),
    /// One rate command and no further one: its segment expires.
    Single(f64),
}

/// The compensation of a scene.
#[derive(Clone, Copy)]
pub enum CompensationScenario {
    /// None.
    None,
    /// Friction and this many harmonics, from the start.
    Harmonics(usize),
    /// As `Harmonics`, and posted again through the mailbox every 10 ms.
    Updates(usize),
}

/// A scene.
pub struct Scene {
    /// Name in the table.
    pub name: &'static str,
    demand: Demand,
    compensation: CompensationScenario,
    /// Disturbance in the second half.
    disturbance: Disturbance,
    /// A drift measurement runs in parallel: the torquer is driven and its gyro sampled each millisecond.
    drives_torquer: bool,
    /// Condition that must occur, so that the scene is known to cover its subject.
    expected: Expected,
}

/// Condition that a scene must produce.
#[derive(Clone, Copy)]
enum Expected {
    Limit(Limits),
    Fault(Fault),
    NoFault,
}

const fn scene(name: &'static str, demand: Demand, compensation: CompensationScenario) -> Scene {
    Scene { name, demand, compensation, disturbance: Disturbance::None, drives_torquer: false, expected: Expected::NoFault }
}

const fn disturbed(name: &'static str, demand: Demand, disturbance: Disturbance, expected: Expected) -> Scene {
    Scene { name, demand, compensation: CompensationScenario::Harmonics(8), disturbance, drives_torquer: false, expected }
}

/// All scenes.
pub const SCENES: &[Scene] = &[
    scene("off", Demand::Off, CompensationScenario::None),
    scene("voltage", Demand::Voltage(3.0), CompensationScenario::None),
    scene("rate, no compensation", Demand::Rate(5.0), CompensationScenario::None),
    scene("rate, slow", Demand::Rate(0.01), CompensationScenario::None),
    scene("rate, friction compensated", Demand::Rate(5.0), CompensationScenario::Harmonics(0)),
    scene("rate, 1 harmonic", Demand::Rate(5.0), CompensationScenario::Harmonics(1)),
    scene("rate, 3 harmonics", Demand::Rate(5.0), CompensationScenario::Harmonics(3)),
    scene("rate, 8 harmonics", Demand::Rate(5.0), CompensationScenario::Harmonics(8)),
    scene("rate, 8 harmonics updated while running", Demand::Rate(5.0), CompensationScenario::Updates(8)),
    Scene { drives_torquer: true, ..scene("rate, 8 harmonics, drift pulses", Demand::Rate(5.0), CompensationScenario::Harmonics(8)) },
    disturbed("rate, commands stop arriving", Demand::Single(5.0), Disturbance::None, Expected::Limit(Limits::STARVED)),
    disturbed("rate, blocked: current limit, slip", Demand::Rate(20.0), Disturbance::Blocked, Expected::Limit(Limits::SLIPPED)),
    disturbed("rate, acceleration limit", Demand::Rate(34.0), Disturbance::None, Expected::Limit(Limits::ACCELERATION)),
    scene("position, 8 harmonics", Demand::Position(6.0), CompensationScenario::Harmonics(8)),
    disturbed("fault: stop", Demand::Rate(5.0), Disturbance::Stop, Expected::Fault(Fault::EmergencyStop)),
    disturbed("fault: encoder lost", Demand::Rate(20.0), Disturbance::NoEdges, Expected::Fault(Fault::EncoderLost)),
    disturbed("fault: supply low", Demand::Rate(5.0), Disturbance::LowSupply, Expected::Fault(Fault::SupplyLow)),
    disturbed("fault: stall", Demand::Step(3.3), Disturbance::Blocked, Expected::Fault(Fault::Stall)),
    disturbed("rate, index lost", Demand::Rate(5.0), Disturbance::NoIndex, Expected::NoFault),
    disturbed("fault: overspeed", Demand::Rate(5.0), Disturbance::ExternallyDriven(46.0), Expected::Fault(Fault::Overspeed)),
    disturbed("fault: clock, cleared each row", Demand::Rate(5.0), Disturbance::LosesTicks(7), Expected::Fault(Fault::Clock)),
];

/// Replacement for the torquer's converter and for the ring buffer's transfer counter.
static CONVERTER: AtomicU32 = AtomicU32::new(0);
static LEFT: AtomicU32 = AtomicU32::new(0);
const CHANNELS: u32 = 5;
const SWEEPS: u32 = 64;
static OUTPUT: TimedOutput = TimedOutput::new();
static MEMORY: Memory = Memory::new();

/// Plays a scene from power-on and counts the instructions of each tick.
///
/// # Panics
/// The scene does not produce its expected condition.
pub fn play(scene: &Scene, meter: &Meter) -> Tally {
    let hardware = Hardware::default();
    let harmonics = match scene.compensation {
        CompensationScenario::None => None,
        CompensationScenario::Harmonics(n) | CompensationScenario::Updates(n) => Some(n),
    };
    let settings = Settings { compensation: compensation_of(harmonics), ..Settings::default() };
    let config = Config::new(&settings, &hardware).unwrap_or_else(|error| panic!("{}: {error}", scene.name));
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
            motor.disturbance = scene.disturbance;
        }
        if n % CONTROL_PER_ROW == 5 {
            if scene.disturbance == Disturbance::LosesTicks(7) {
                clear += 1;
            }
            if let Some(segment) = segment_at(scene.demand, &hardware, n) {
                mailboxes.commands.post(Command { segment, clear, ..Command::default() });
            }
        }
        if n % 100 == 0 && matches!(scene.compensation, CompensationScenario::Updates(_)) {
            mailboxes.compensation.post(config.compensation());
        }
        if scene.drives_torquer && n % CONTROL_PER_ROW == 3 {
            // As the measurement task does: it takes the sample of this millisecond and sets the pulse of the next.
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
    match scene.expected {
        Expected::Limit(limit) => assert!(limits.contains(limit), "{}: the limit was never in force: {limits:?}", scene.name),
        Expected::Fault(awaited) => assert_eq!(fault, awaited, "{}", scene.name),
        Expected::NoFault => assert_eq!(fault, Fault::None, "{}", scene.name),
    }
    tally
}

/// The interrupt as the board calls it, torquer first. Not inlined, so that none of its code moves outside the meter.
#[inline(never)]
fn tick(interrupt: &mut Interrupt<'_>, motor: &mut Motor, n: u32) {
    if let Some(value) = OUTPUT.take(n) {
        CONVERTER.store(u32::from(value), Ordering::Relaxed);
        OUTPUT.set_sweep((CHANNELS * SWEEPS).saturating_sub(LEFT.load(Ordering::Relaxed)) / CHANNELS % SWEEPS);
    }
    interrupt.run(motor);
}

/// The segment that a profile posts at tick `n` for the row after next.
fn segment_at(demand: Demand, hardware: &Hardware, n: u64) -> Option<Segment> {
    let (start, ticks) = (n - n % CONTROL_PER_ROW + CONTROL_PER_ROW, CONTROL_PER_ROW as u16);
    // A triangle of half a second: the ramp is active most of the time.
    let triangle = |n: u64| {
        let phase = (n % 5_000) as f64 / 2_500.0;
        1.0 - 2.0 * (phase - 1.0).abs()
    };
    match demand {
        Demand::Off => Some(Segment::off(start)),
        Demand::Voltage(volts) => Some(Segment::voltage(hardware, start, ticks, if n % 5_000 < 2_500 { volts } else { -volts })),
        Demand::Rate(rad_s) => {
            Some(Segment::rate(hardware, start, ticks, rad_s * triangle(start), rad_s * triangle(start + CONTROL_PER_ROW)))
        }
        Demand::Step(volts) => Some(Segment::voltage(hardware, start, ticks, if n < TICKS / 2 { 0.0 } else { volts })),
        Demand::Position(rad) => {
            let rad = if n % 10_000 < 5_000 { rad } else { -rad };
            Some(Segment::position(hardware, start, Zero::PowerOn, rad, Some(20.0)))
        }
        Demand::Single(rad_s) => (n < 10).then(|| Segment::rate(hardware, start, ticks, 0.0, rad_s)),
    }
}

/// Friction and `harmonics` harmonics; no compensation for `None`.
fn compensation_of(harmonics: Option<usize>) -> Compensation {
    let Some(n) = harmonics else { return Compensation::default() };
    let harmonics = (1..=n).map(|k| Harmonic { order: 7 * k as u16, torque_N_m: 2e-3 / k as f64, phase_rad: 0.7 * k as f64 });
    Compensation {
        coulomb_N_m: 9e-4,
        viscous_N_m_s: 6e-5,
        harmonics: Harmonics::of(harmonics).unwrap_or_default(),
        ..Compensation::default()
    }
}
