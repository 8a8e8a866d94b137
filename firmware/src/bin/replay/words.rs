//! Inputs and outputs of the replayed ticks as words; the program and its host (chip-sim/tests/chip/replay.rs) compile this file.

use stand_firmware::board::{CONTROL_PER_ROW, CurrentCode, Drive, EncoderCount, Hardware, Sensed, SupplyCode};
use stand_firmware::compensation::{Compensation, Harmonic};
use stand_firmware::speed_loop::{Command, Config, Fault, Mode, Report, Segment, Settings, SpeedLoop, Zero};

/// Ticks of one batch.
pub const BATCH: usize = 100;
/// Words of a tick's input.
pub const INPUT: usize = 18;
/// Words of a tick's output.
pub const OUTPUT: usize = 24;

/// The default stand with friction and eight harmonics fed forward.
pub fn config() -> Option<Config> {
    let orders = [1_u16, 2, 3, 7, 14, 28, 60, 120];
    let harmonics =
        orders.iter().map(|order| Harmonic { order: *order, torque_N_m: 4e-4 / f64::from(*order), phase_rad: 0.1 * f64::from(*order) });
    let mut compensation = Compensation { coulomb_N_m: 1e-3, viscous_N_m_s: 1e-5, ..Compensation::default() };
    for harmonic in harmonics {
        compensation.harmonics.push(harmonic)?;
    }
    Config::new(&Settings { compensation, ..Settings::default() }, &Hardware::default()).ok()
}

/// What a tick is given.
#[derive(Clone, Copy, Debug, Default)]
pub struct TickInput {
    pub sensed: Sensed,
    pub index: Option<EncoderCount>,
    pub command: Option<Command>,
}

/// The upper word.
pub fn high(value: u64) -> u32 {
    (value >> 32) as u32
}

fn joined(low: u32, high: u32) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

impl TickInput {
    /// From words.
    pub fn of_words(words: &[u32; INPUT]) -> Self {
        let [
            flags,
            tick,
            tick_high,
            encoder,
            edge_age,
            current,
            supply,
            index,
            start,
            start_high,
            ticks,
            mode,
            value,
            value_high,
            slope,
            slope_high,
            clear,
            trip,
        ] = *words;
        let flag = |bit: u32| flags >> bit & 1 == 1;
        let sensed = Sensed {
            tick: joined(tick, tick_high),
            encoder: EncoderCount(encoder as u16),
            edge_age,
            current: CurrentCode(current as i32),
            supply: SupplyCode(supply),
            is_stale: flag(0),
            stop: flag(1),
            announced_stall: flag(2),
        };
        let segment = Segment {
            start_tick: joined(start, start_high),
            ticks: ticks as u16,
            mode: [Mode::Off, Mode::Voltage, Mode::Rate, Mode::Position].into_iter().nth(mode as usize).unwrap_or_default(),
            value: joined(value, value_high) as i64,
            slope: joined(slope, slope_high) as i64,
            zero: if flag(5) { Zero::Index } else { Zero::PowerOn },
        };
        let command = Command { segment, clear: clear as u16, trip: Fault::of_code(trip) };
        Self { sensed, index: flag(3).then_some(EncoderCount(index as u16)), command: flag(4).then_some(command) }
    }
}

/// One tick of the law: its output and everything that the law reports of its state.
pub fn tick(speed_loop: &mut SpeedLoop, input: &TickInput) -> [u32; OUTPUT] {
    let TickInput { sensed, index, command } = input;
    speed_loop.sense(sensed, *index);
    let report = if sensed.tick.is_multiple_of(CONTROL_PER_ROW) { speed_loop.report() } else { Report::default() };
    if let Some(command) = command {
        speed_loop.set_command(command, sensed);
    }
    let drive = speed_loop.compute(sensed);
    let (fault, fault_tick) = speed_loop.fault();
    let [a, b, c, d, e, f] = report.limited_ms;
    [
        i32::from(drive.counts()) as u32,
        u32::from(drive == Drive::Off),
        i32::from(speed_loop.duty()) as u32,
        speed_loop.rate_estimate().to_bits(),
        speed_loop.setpoint() as u32,
        fault.code(),
        fault_tick,
        report.duty_sum as u32,
        report.position_command as u32,
        high(report.position_command as u64),
        report.rate_command as u32,
        high(report.rate_command as u64),
        report.rate.to_bits(),
        report.edge_age,
        report.mode as u32,
        u32::from(report.compensating.0),
        report.fault.code(),
        u32::from(report.limits.0),
        a,
        b,
        c,
        d,
        e,
        f,
    ]
}
