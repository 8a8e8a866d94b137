//! An hour of virtual time at 1 kHz telemetry: `cargo run --release -p stand-tests --example hour_of_telemetry [SECONDS]`.
//!
//! The platform turns, all default channels go out over the simulated line, and every frame is looked at. Memory is the process's own.

use hal_sim::plant::Stand;
use stand_tests::bench::at_the_bench;
use stand_tests::streaming::record;

/// Resident memory, KiB, where the system tells it.
fn resident_KiB() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.split_whitespace().next()?.parse().ok()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seconds: u32 = std::env::args().nth(1).map_or(Ok(3600), |word| word.parse())?;
    let begin = std::time::Instant::now();
    let is = at_the_bench(&Stand::default(), async |host| {
        host.tell("SOUR:RATE 10;:SOUR:MODE RATE").await;
        record(host, seconds, |second, is| {
            if second % 600 == 0 || second == 60 {
                println!("{second} s: {is:?}, {} KiB resident", resident_KiB().unwrap_or_default());
            }
        })
        .await
    });
    println!("{seconds} s in {:.1} s: {is:?}", begin.elapsed().as_secs_f64());
    Ok(())
}
