//! Drift of a gyro by pulses of alternating sign: the torquer turns the gyro to and fro by equal and opposite pulses, and the integral of its
//! angle, added up during the first pulse and taken away during the second, is the drift.
//!
//! In: a sample of the gyro's angle and of its torquer's current at each whole millisecond ([`GyroSample`](crate::board::GyroSample)), and the fault
//! that is latched. Out: what the torquer is given in the millisecond after the next, and a [`Cycle`] for each pair of pulses: exact whole numbers, with their
//! conversion beside them. One clock paces edges and samples. The correction loop, which holds the gyro at its zero, is open while a cycle
//! measures, and closed after it and after whatever goes wrong; a cycle that is bad says why and enters no mean.
//!
//! * [`Pulse`]: the reference pulses, in steps of the torquer's converter; [`Integrator`]: the sums over a cycle;
//! * [`Due`]: what is given in which tick, from the task to the control interrupt;
//! * [`Commutator`]: rest, lead, pulses, and the loop around them; [`Tally`]: means over a session, and the pair of positions.
//!
//! *T* is the duration of one pulse, N samples; a cycle is 2 T. *Own* drift is the gyro's, *apparent* drift is the rotation of the Earth. The sources
//! of the formulas are theory.md §3.

mod commutator;
mod cycle;
mod due;
mod integrator;
pub mod observer;
mod plan;
mod settings;
mod shape;
mod shared;
mod tally;
#[cfg(test)]
mod tests;

pub use commutator::{Commutator, LEAD_ROWS, Phase};
pub use cycle::{Bad, Cycle, Polarity};
pub use due::Due;
pub use integrator::{Integrator, Sums};
pub use plan::{Asked, MOST_ROWS, Plan, Sequence};
pub use settings::{Scales, Settings};
pub use shape::{Pulse, Shape};
pub use shared::Shared;
pub use tally::{Drift, Pair, Register, Tally};
