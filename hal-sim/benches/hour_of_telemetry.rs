//! An hour of virtual time with the stand turning and all rows on the line at 1 kHz: no frame may be lost, memory must stay flat.
//!
//! Method: the whole controller behind its serial line at 921 600 baud; each 10 ms the host takes what has come and puts it through the firmware's
//! own deframer; frames and rows are counted by their numbers, resident memory is read from the system after the first minute and at the end. Fails
//! where a frame is missing or damaged, or memory grew by more than a megabyte. `cargo bench -p hal-sim --bench hour_of_telemetry [-- MINUTES]`.
#![allow(clippy::unwrap_used)]

use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::plant::{Plant, Stand};
use stand_firmware::board::{Clock, TICKS_PER_S};
use stand_firmware::telemetry::frame::Piece;
use stand_firmware::telemetry::{Body, Deframer};
use std::time::Instant;

/// How often the host takes what has come, s.
const EACH_S: f64 = 0.01;

/// Resident memory, kB; 0 where the system does not say.
fn resident_kB() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmRSS:"));
    line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok()).unwrap_or(0)
}

fn main() {
    let minutes = std::env::args().skip(1).find_map(|word| word.parse::<f64>().ok()).unwrap_or(60.0);
    let stand = Stand::default();
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand.setup(), Plant::new(&stand, -1.0).unwrap(), flash(1), 1).unwrap();
    let begun = Instant::now();
    let host = async {
        let (line, clock) = (controller.line(), controller.clock());
        let wait = async |seconds: f64| clock.until(clock.now() + (seconds * TICKS_PER_S as f64) as u64).await;
        wait(0.1).await;
        line.send(b"SOURce:RATE 5 RAD/S;:SOURce:MODE RATE;:STReam ON\n");
        let mut bytes = Vec::new();
        let mut deframer = Deframer::default();
        let (mut seq, mut last, mut rows, mut missing) = (None, None, 0_u64, 0_u64);
        let mut after_a_minute_kB = 0;
        for step in 0..(minutes * 60.0 / EACH_S) as u64 {
            wait(EACH_S).await;
            bytes.clear();
            line.receive(&mut bytes);
            for byte in &bytes {
                let Some(Piece::Frame(frame)) = deframer.push(*byte) else { continue };
                missing += seq.map_or(0, |seq: u16| u64::from(frame.seq.wrapping_sub(seq.wrapping_add(1))));
                seq = Some(frame.seq);
                if let Body::Row(row) = frame.body {
                    missing += last.map_or(0, |last: u32| u64::from(row.sequence.wrapping_sub(last.wrapping_add(1))));
                    last = Some(row.sequence);
                    rows += 1;
                }
            }
            if step == (60.0 / EACH_S) as u64 {
                after_a_minute_kB = resident_kB();
            }
        }
        (rows, missing, deframer.damaged(), after_a_minute_kB)
    };
    let (rows, missing, damaged, after_a_minute_kB) = controller.run(host, |_| ()).unwrap();
    let seconds = begun.elapsed().as_secs_f64();
    let grown_kB = resident_kB().saturating_sub(after_a_minute_kB);
    let counts = controller.line().counts();
    println!("{minutes} min of virtual time in {seconds:.1} s: {:.0} times real time", minutes * 60.0 / seconds);
    println!("{rows} rows, {missing} frames or rows missing, {damaged} damaged, {} bytes", counts.sent);
    println!("resident memory grew by {grown_kB} kB after the first minute");
    assert!(rows as f64 > minutes * 60.0 * 1000.0 - 100.0, "rows are missing at an end: {rows}");
    assert_eq!((missing, damaged, counts.overrun, counts.unread), (0, 0, 0, 0));
    assert!(grown_kB <= 1024 || after_a_minute_kB == 0, "memory is not flat: {grown_kB} kB");
}
