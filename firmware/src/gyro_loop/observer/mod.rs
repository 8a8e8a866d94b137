//! State observers of a gyroscope: estimate all states from its one measured angle (docs/theory.md §1, §2).
//!
//! In: the angle and the control moment, each millisecond; matrices designed by `stand observer design`. Out: estimates of all states, and
//! of a disturbance if the observer is astatic. The form is the exact discrete one,
//!
//! ```text
//! x̂[n+1] = Φ x̂[n] + Γ u[n] + K (y[n] − x̂₁[n])
//! ```
//!
//! so that x̂[n+1] is known a whole step ahead and the regulator's moment acts in time. An astatic observer has one more state, the last:
//! the disturbance found by the integral channel, in its own unit. Static, PI and augmented observers are one law with different
//! parameters.
//!
//! [`Design`] holds the checked matrices; [`Observer`] is the state. [`Stability`] checks the poles in small steps. [`RunningObserver`]
//! joins them at 1 kHz on the gyroscope's angle.

mod law;
pub mod parameters;
mod real;
mod regulator;
mod running;
mod stability;
#[cfg(test)]
mod tests;
mod vibration;

pub use law::{Design, Observer};
pub use parameters::ObserverParameters;
pub use real::Real;
pub use regulator::Regulator;
pub use running::{MAX_MISSED_ROWS, ObservedState, ObserverInput, Phase, RunningObserver};
pub use stability::Stability;
pub use vibration::{Motion, Vibration, VibrationCorrection};

/// Most states: six of the gyrotheodolite's sensitive element and a disturbance.
pub const MAX_STATES: usize = 7;
