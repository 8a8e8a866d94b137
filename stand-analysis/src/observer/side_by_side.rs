//! One observer of a side-by-side simulation: its errors alone, then in the closed loop.

use super::{Design, Disturbance, ObserverError, Regulator, Simulated, Start};

/// Points of the closed-loop simulation.
const CLOSED_LOOP_POINTS: f64 = 4000.0;
/// The loop is closed no earlier than this, s.
const MIN_CLOSING_TIME_S: f64 = 0.5;

/// The closed-loop part of a simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedLoop {
    /// The regulator.
    pub regulator: Regulator,
    /// Duration, s.
    pub seconds: f64,
}

/// Simulates `design` for `seconds` at `step_s`, then in the closed loop. The observer starts at the angle that it measures; the loop is
/// closed when the observer has settled.
///
/// # Errors
/// The closed loop is unstable.
pub fn simulate(
    design: &Design,
    disturbance: Disturbance,
    seconds: f64,
    step_s: f64,
    closed_loop: ClosedLoop,
) -> Result<Simulated, ObserverError> {
    let mut run = design.simulate(disturbance, seconds, step_s);
    let closed_from_s = run.settled_s.unwrap_or(MIN_CLOSING_TIME_S).max(MIN_CLOSING_TIME_S);
    let start = Start { angle_rad: 0.0, moment: disturbance.moment, closed_from_s };
    run.closed = Some(design.regulate(closed_loop.regulator, start, closed_loop.seconds, closed_loop.seconds / CLOSED_LOOP_POINTS)?);
    Ok(run)
}
