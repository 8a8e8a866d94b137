//! The emulated chip in real time, with its serial line at a pseudo-terminal or a TCP port.

use std::time::{Duration, Instant};

use chip_sim::machine::{Halt, Machine};
use chip_sim::time::{PER_MS, Time, seconds};

use super::{Pacer, ServedLine, ServedLineError};

/// Rate of the line, baud.
const BAUD: u64 = 921_600;

/// Why serving ended.
#[derive(Debug, thiserror::Error)]
pub enum ServeChipError {
    /// The line failed.
    #[error(transparent)]
    Line(#[from] ServedLineError),
    /// The program did something that the chip cannot do.
    #[error("the emulated chip halted: {0}")]
    Halt(#[from] Halt),
}

/// Serves at `speed` times real time until `ends`, called every millisecond, returns true. `skipped` receives each time skipped because the computer was too slow.
///
/// # Errors
/// The line failed, or the chip halted.
pub fn serve_chip(
    machine: &mut Machine<'_>,
    line: &mut ServedLine,
    speed: f64,
    ends: &dyn Fn(Duration) -> bool,
    skipped: &mut dyn FnMut(Duration),
) -> Result<(), ServeChipError> {
    let mut pace = Pacer::new(Instant::now(), speed);
    let mut from_client = Vec::new();
    loop {
        let to: Time = machine.now() + PER_MS;
        machine.run_until(to)?;
        let now = Duration::from_secs_f64(seconds(machine.now()));
        if ends(now) {
            return Ok(());
        }
        line.exchange(&mut machine.take_sent(), &mut from_client)?;
        if !from_client.is_empty() {
            machine.send(&from_client, BAUD);
            from_client.clear();
        }
        if let Some(lag) = pace.skip_lag(now, Instant::now()) {
            skipped(lag);
        }
        let wait = pace.wait(now, Instant::now());
        if wait >= Duration::from_micros(300) {
            line.wait(wait)?;
        }
    }
}
