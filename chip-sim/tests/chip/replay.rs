//! The tick's arithmetic on the chip and on the host, bit for bit: one drive of `hal-sim`, whose readings and commands are replayed in the
//! library compiled for the chip. Compared in each tick: the output, the rate estimate, the setpoint, the fault, and each millisecond the
//! whole report (sum of the duties, ramp, rate by the edges, limits).
#![allow(clippy::unwrap_used)]

#[path = "../../../firmware/src/bin/replay/words.rs"]
mod words;

use crate::common;
use chip_sim::board::Board;
use chip_sim::image::Image;
use chip_sim::machine::Machine;
use chip_sim::soc::RAM;
use chip_sim::time::{PER_MS, Time};
use common::built;
use hal_sim::board::Bench;
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{CONTROL_HZ, Drive, EncoderCount, Hardware, Sensed, TickIo, Ticks};
use stand_firmware::speed_loop::{Command, Fault, Segment, SpeedLoop, Zero};
use words::{BATCH, INPUT, OUTPUT, TickInput, config, high, tick};

/// Longest time of a batch: the program runs at 16 MHz.
const BATCH_TIME: Time = 200 * PER_MS;

/// The command given at a tick: voltage into the limit, a fast and a slow rate, a reversal, a profile of segments, an angle, an overspeed,
/// its clearing, off.
fn command(n: u64) -> Option<Command> {
    let hardware = Hardware::default();
    let hold = u16::MAX;
    let rate = |from, to, ticks| Some(Segment::rate(&hardware, n + 10, ticks, from, to));
    let segment = match n {
        1_000 => Some(Segment::voltage(&hardware, n + 1, hold, 1.5)),
        3_000 => Some(Segment::voltage(&hardware, n + 3, hold, -6.0)),
        4_000 => rate(0.05, 0.05, hold),
        8_000 => rate(0.0, 30.0, 6_000),
        20_000 => rate(-20.0, -20.0, hold),
        32_000..40_000 if n.is_multiple_of(100) => {
            let at = |n: u64| 3.0 * f64::sin(n as f64 / 500.0);
            rate(at(n), at(n + 100), 100)
        }
        40_000 => Some(Segment::position(&hardware, n + 10, Zero::Index, 2.5, None)),
        50_000 => Some(Segment::position(&hardware, n + 10, Zero::PowerOn, -1.0, Some(1.0))),
        55_000 => Some(Segment::voltage(&hardware, n + 10, hold, 3.0)),
        60_000 => Some(Segment::off(n + 1)),
        _ => None,
    };
    let clear = if n < 60_000 { 0 } else { 1 };
    let trip = if n == 58_000 { Fault::SensorSilent } else { Fault::None };
    let command = |segment| Command { segment, clear, trip };
    segment.or((trip != Fault::None).then(Segment::default)).map(command)
}

impl TickInput {
    /// As words.
    pub fn to_words(self) -> [u32; INPUT] {
        let Self { sensed, index, command } = self;
        let Command { segment, clear, trip } = command.unwrap_or_default();
        let flags = [sensed.is_stale, sensed.stop, sensed.announced_stall, index.is_some(), command.is_some(), segment.zero == Zero::Index];
        let flags = flags.iter().enumerate().fold(0, |word, (bit, flag)| word | u32::from(*flag) << bit);
        [
            flags,
            sensed.tick as u32,
            high(sensed.tick),
            u32::from(sensed.encoder.0),
            sensed.edge_age,
            sensed.current.0 as u32,
            sensed.supply.0,
            u32::from(index.unwrap_or_default().0),
            segment.start_tick as u32,
            high(segment.start_tick),
            u32::from(segment.ticks),
            segment.mode as u32,
            segment.value as u32,
            high(segment.value as u64),
            segment.slope as u32,
            high(segment.slope as u64),
            u32::from(clear),
            trip.code(),
        ]
    }
}

const TICKS: u64 = 64_000;

/// The law on the simulated hardware, with its inputs and outputs of each tick.
struct Recorded {
    speed_loop: SpeedLoop,
    inputs: Vec<TickInput>,
    outputs: Vec<[u32; OUTPUT]>,
}

impl Recorded {
    fn run(&mut self, io: &mut impl TickIo) {
        let (sensed, index): (Sensed, Option<EncoderCount>) = (io.sense(), io.index());
        let input = TickInput { sensed, index, command: command(sensed.tick) };
        // The chip is given what has gone through the words.
        assert_eq!(format!("{input:?}"), format!("{:?}", TickInput::of_words(&input.to_words())));
        let output = tick(&mut self.speed_loop, &input);
        io.drive(if output[1] == 1 { Drive::Off } else { Drive::Duty(output[0] as i16) });
        self.inputs.push(input);
        self.outputs.push(output);
    }
}

fn on_host() -> Recorded {
    let stand = Stand::default();
    let plant = Plant::new(&stand, -0.1).unwrap();
    let mut bench = Bench::new(&stand.hardware, &stand.sensors, 1, Box::new(plant));
    let mut recorded = Recorded { speed_loop: SpeedLoop::new(config().unwrap()), inputs: Vec::new(), outputs: Vec::new() };
    for n in 0..TICKS {
        bench.advance(Ticks::of_control(n), |io| recorded.run(io));
    }
    recorded
}

fn on_chip(inputs: &[TickInput]) -> Vec<[u32; OUTPUT]> {
    let image = Image::read(&built("replay")).unwrap();
    let address = |name: &str| (image.symbol(name).unwrap() - RAM) as usize;
    let (input, output, go) = (address("REPLAY_INPUT"), address("REPLAY_OUTPUT"), address("REPLAY_GO"));
    let stand = Stand::default();
    let board = Board::new(&stand.setup(), Box::new(Plant::new(&stand, 0.0).unwrap()), stand.drive.motor_constant_N_m_A, 1);
    let mut machine = Machine::new(&image, board);
    let run = |machine: &mut Machine<'_>, time: Time| {
        let to = machine.now() + time;
        machine.run_until(to).unwrap_or_else(|halt| panic!("{halt}"));
    };
    run(&mut machine, BATCH_TIME);
    let mut outputs = Vec::new();
    for batch in inputs.chunks_exact(BATCH) {
        let words = batch.iter().flat_map(|input| input.to_words()).flat_map(u32::to_le_bytes);
        for (place, byte) in machine.soc.ram_mut()[input..input + 4 * BATCH * INPUT].iter_mut().zip(words) {
            *place = byte;
        }
        machine.soc.ram_mut()[go] = 1;
        let end = machine.now() + BATCH_TIME;
        while machine.soc.ram()[go] != 0 {
            assert!(machine.now() < end, "the program does not compute");
            run(&mut machine, PER_MS);
        }
        let words =
            machine.soc.ram()[output..output + 4 * BATCH * OUTPUT].chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap()));
        let words: Vec<u32> = words.collect();
        outputs.extend(words.chunks_exact(OUTPUT).map(|words| <[u32; OUTPUT]>::try_from(words).unwrap()));
    }
    outputs
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn tick_agrees_with_the_host_bit_for_bit_in_output_and_state() {
    let host = on_host();
    let chip = on_chip(&host.inputs);
    assert_eq!(chip.len(), host.inputs.len());
    // The drive has been through what it was to go through.
    let any = |condition: &dyn Fn(&[u32; OUTPUT]) -> bool| host.outputs.iter().any(condition);
    for mode in 0..4 {
        assert!(any(&|words| words[14] == mode), "mode {mode}");
    }
    assert!(any(&|words| words[5] == Fault::SensorSilent.code()) && any(&|words| words[17] != 0) && any(&|words| words[15] & 4 == 4));
    let fastest = host.outputs.iter().map(|words| f32::from_bits(words[3]).abs()).fold(0.0, f32::max);
    assert!(f64::from(fastest) * CONTROL_HZ as f64 * Hardware::default().rad_per_count() > 25.0, "{fastest} counts per tick");
    for (n, ((chip, host), input)) in chip.iter().zip(&host.outputs).zip(&host.inputs).enumerate() {
        assert_eq!(chip, host, "tick {n}, {input:?}");
    }
    println!("{} ticks, {} words each: equal", chip.len(), OUTPUT);
}
