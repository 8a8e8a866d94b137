//! The simulated controller in real time, or a multiple of it, with its serial line at a pseudo-terminal or a TCP port.
//!
//! Before each step of the virtual clock, bytes are exchanged between the client and the simulated line, then real time is awaited. The
//! byte timing of the line is in virtual time, so a client sees 921 600 baud.

use std::cell::RefCell;
use std::future::poll_fn;
use std::task::Poll;
use std::time::{Duration, Instant};

use hal_sim::controller::{Controller, ControllerError};
use stand_firmware::board::Ticks;

use super::{Pacer, ServedLine, ServedLineError};

/// Why serving ended.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The line failed.
    #[error(transparent)]
    Line(#[from] ServedLineError),
    /// The controller cannot run.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}

/// Serves at `speed` times real time until `ends`, called every millisecond, returns true. `skipped` receives each time skipped because the computer was too slow.
///
/// # Errors
/// The line or the controller failed.
pub fn serve(
    controller: &Controller<'_>,
    line: &mut ServedLine,
    speed: f64,
    ends: &dyn Fn(Duration) -> bool,
    skipped: &mut dyn FnMut(Duration),
) -> Result<(), ServeError> {
    let mut pace = Pacer::new(Instant::now(), speed);
    let (mut from_stand, mut from_client) = (Vec::new(), Vec::new());
    let failed = RefCell::new(None);
    let over = std::cell::Cell::new(false);
    let until_over = poll_fn(|_| if over.get() { Poll::Ready(()) } else { Poll::Pending });
    controller.run(until_over, |to| {
        let to = since_power_on(to);
        if ends(to) {
            over.set(true);
            return;
        }
        let mut exchange = |line: &mut ServedLine| {
            controller.line().receive(&mut from_stand);
            line.exchange(&mut from_stand, &mut from_client)?;
            if !from_client.is_empty() {
                controller.line().send(&from_client);
                from_client.clear();
            }
            Ok::<(), ServedLineError>(())
        };
        let done = exchange(line).and_then(|()| {
            if let Some(lag) = pace.skip_lag(to, Instant::now()) {
                skipped(lag);
            }
            let wait = pace.wait(to, Instant::now());
            // A wait shorter than the scheduler's resolution is left to the next step.
            if wait < Duration::from_micros(300) { Ok(()) } else { line.wait(wait) }
        });
        if let Err(error) = done {
            failed.replace(Some(error));
            over.set(true);
        }
    })?;
    failed.into_inner().map_or(Ok(()), |error| Err(error.into()))
}

fn since_power_on(t: Ticks) -> Duration {
    Duration::from_nanos(t.0.saturating_mul(100))
}
