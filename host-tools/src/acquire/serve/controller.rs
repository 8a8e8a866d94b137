//! The simulated controller in real time, behind a port.
//!
//! Before each jump of the virtual clock: what a client has written goes onto the simulated line, what the stand has said goes to the client, and
//! the wall's clock is waited for. The line's own byte timing is in virtual time, so a client sees 921 600 baud.

use std::cell::RefCell;
use std::future::poll_fn;
use std::task::Poll;
use std::time::{Duration, Instant};

use hal_sim::board::PlantPort;
use hal_sim::controller::{Controller, ControllerError};
use stand_firmware::board::Ticks;

use super::pty::PtyError;
use super::{Pacer, Pty};

/// Why the stand is no longer served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// The port is broken.
    #[error(transparent)]
    Port(#[from] PtyError),
    /// The controller cannot run.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}

/// Serves until `ends` says so; it is asked at each millisecond. `behind` is told what time was given up because the computer was too slow.
///
/// # Errors
/// The port or the controller is broken.
pub fn serve<P: PlantPort>(
    controller: &Controller<'_, P>,
    pty: &mut Pty,
    ends: impl Fn(Duration) -> bool,
    mut behind: impl FnMut(Duration),
) -> Result<(), ServeError> {
    let mut pace = Pacer::new(Instant::now());
    let (mut said, mut heard) = (Vec::new(), Vec::new());
    let failed = RefCell::new(None);
    let over = std::cell::Cell::new(false);
    let until_over = poll_fn(|_| if over.get() { Poll::Ready(()) } else { Poll::Pending });
    controller.run(until_over, |to| {
        let to = since_power_on(to);
        if ends(to) {
            over.set(true);
            return;
        }
        let mut exchange = |pty: &mut Pty| {
            controller.line().receive(&mut said);
            pty.exchange(&mut said, &mut heard)?;
            if !heard.is_empty() {
                controller.line().send(&heard);
                heard.clear();
            }
            Ok::<(), PtyError>(())
        };
        let done = exchange(pty).and_then(|()| {
            if let Some(given_up) = pace.give_up(to, Instant::now()) {
                behind(given_up);
            }
            let wait = pace.wait(to, Instant::now());
            // What is shorter than the system's own pause is not slept for; the next one is longer by it.
            if wait < Duration::from_micros(300) { Ok(()) } else { pty.wait(wait) }
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
