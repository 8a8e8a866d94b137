//! State observers of a gyro: from one angle, all that cannot be measured (theory §1, §2).
//!
//! In: an angle each millisecond, the control moment that was in force, numbers that a tool has designed. Out: an estimate of all states, and of
//! a disturbance where the observer is astatic. The form is the exact discrete one,
//!
//! ```text
//! x̂[n+1] = Φ x̂[n] + Γ u[n] + K (y[n] − x̂₁[n])
//! ```
//!
//! so that x̂[n+1] is known a whole step before it is true, and what a regulator makes of it acts on time. An astatic observer is the same with one
//! state more, the last: what the integral channel has found of the disturbance, in its own unit. So static, PI and augmented observers are one
//! law with other numbers.
//!
//! [`Shared`] is one at work: stepped by the measurement loop on the gyro's angle at 1 kHz, set up by the console.
//!
//! *Design* (numbers, checked: building can fail and names what is wrong) and *observer* (state: running cannot fail) are two things.
//! [`Stability`] is the check that takes long: in pieces, for who must not wait.

mod law;
pub mod numbers;
mod real;
mod regulator;
mod shared;
mod stability;
#[cfg(test)]
mod tests;
mod vibration;

pub use law::{Design, Observer};
pub use numbers::Numbers;
pub use real::Real;
pub use regulator::Regulator;
pub use shared::{MOST_MISSED, Observed, Phase, Seen, Shared};
pub use stability::Stability;
pub use vibration::{Corrected, Motion, Vibration};

/// Most states: six of the gyrotheodolite's sensitive element, and a disturbance.
pub const MOST_STATES: usize = 7;
