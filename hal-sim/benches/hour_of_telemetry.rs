//! An hour of virtual time with the stand turning and all rows on the line at 1 kHz: no frame may be lost, memory must stay flat.
//!
//! Method: the whole controller runs behind its serial line at 921 600 baud. Each 10 ms the host reads what has arrived and decodes it with
//! the firmware's own deframer. Frames and rows are counted by their numbers. Resident memory is read from the system after the first
//! minute and at the end. Fails where a frame or row is missing or damaged, or where memory grew by more than a megabyte; a run of one
//! minute or less does not measure memory. `cargo bench -p hal-sim --bench hour_of_telemetry [-- MINUTES]`.
#![allow(clippy::unwrap_used)]

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, ROW_HZ, TICKS_PER_S};
use stand_firmware::telemetry::frame::{Frame, Piece};
use stand_firmware::telemetry::{Body, Deframer};
use std::time::Instant;

/// Period in which the host reads the line, s.
const READ_PERIOD_S: f64 = 0.01;
/// Rows that may be missing before the stream begins and after the last reading.
const MAX_ROWS_OUTSIDE: f64 = 100.0;
/// Growth of resident memory that counts as flat, kB.
const MAX_GROWTH_KB: u64 = 1024;
/// Angle of the platform from its index at power-on, rad.
const START_RAD: f64 = -1.0;
/// Seed of flash and sensors.
const SEED: u64 = 1;

/// Frames and rows received so far.
#[derive(Default)]
struct Received {
    rows: u64,
    missing_frames: u64,
    missing_rows: u64,
    last_frame: Option<u16>,
    last_row: Option<u32>,
}

impl Received {
    fn count(&mut self, frame: &Frame<'_>) {
        if let Some(last) = self.last_frame.replace(frame.seq) {
            self.missing_frames += u64::from(frame.seq.wrapping_sub(last.wrapping_add(1)));
        }
        if let Body::Row(row) = &frame.body {
            if let Some(last) = self.last_row.replace(row.sequence) {
                self.missing_rows += u64::from(row.sequence.wrapping_sub(last.wrapping_add(1)));
            }
            self.rows += 1;
        }
    }
}

/// Resident memory, kB; `None` where the system does not report it.
fn resident_kB() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

fn main() {
    let minutes = std::env::args().skip(1).find_map(|word| word.parse::<f64>().ok()).unwrap_or(60.0);
    let stand = Stand::default();
    let clock = VirtualClock::default();
    let plant = Plant::new(&stand, START_RAD).unwrap();
    let controller = Controller::new(&clock, &stand.setup(), plant, flash(SEED), SEED).unwrap();
    let begun = Instant::now();
    let host = async {
        let (line, clock) = (controller.line(), controller.clock());
        let wait = async |seconds: f64| clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        wait(0.1).await;
        line.send(b"HOST:UNATTended 1E6;:SOURce:RATE 5 RAD/S;:SOURce:MODE RATE;:STReam ON\n");
        let mut bytes = Vec::new();
        let mut deframer = Deframer::default();
        let mut received = Received::default();
        let mut after_a_minute_kB = None;
        for reading in 0..(minutes * 60.0 / READ_PERIOD_S) as u64 {
            wait(READ_PERIOD_S).await;
            bytes.clear();
            line.receive(&mut bytes);
            for byte in &bytes {
                if let Some(Piece::Frame(frame)) = deframer.push(*byte) {
                    received.count(&frame);
                }
            }
            if reading == (60.0 / READ_PERIOD_S) as u64 {
                after_a_minute_kB = resident_kB();
            }
        }
        (received, deframer.damaged(), after_a_minute_kB)
    };
    let (received, damaged, after_a_minute_kB) = controller.run(host, |_| ()).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    let growth_kB = resident_kB().zip(after_a_minute_kB).map(|(at_end, before)| at_end.saturating_sub(before));
    let Received { rows, missing_frames, missing_rows, .. } = received;
    let counts = controller.line().counts();
    println!("{minutes} min of virtual time in {seconds:.1} s: {:.0} times real time", minutes * 60.0 / seconds);
    println!("{rows} rows, {missing_frames} frames missing, {missing_rows} rows missing, {damaged} damaged, {} bytes", counts.sent);
    match growth_kB {
        Some(growth_kB) => println!("resident memory grew by {growth_kB} kB after the first minute"),
        None => println!("resident memory was not measured"),
    }
    let expected_rows = minutes * 60.0 * ROW_HZ as f64;
    assert!(rows as f64 > expected_rows - MAX_ROWS_OUTSIDE, "{rows} rows, {expected_rows} expected");
    assert_eq!((missing_frames, missing_rows, damaged, counts.overrun, counts.unread), (0, 0, 0, 0, 0));
    assert!(growth_kB.is_none_or(|growth_kB| growth_kB <= MAX_GROWTH_KB), "memory is not flat: {growth_kB:?} kB");
}
