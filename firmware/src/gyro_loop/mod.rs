//! Gyroscope loop: correction loop, drift measurement by pulses, and a state observer, on the angle sensor and torquer of a gyroscope.
//!
//! Drift measurement: the torquer turns the gyroscope to and fro by equal and opposite pulses. The integral of the angle, added during the
//! first pulse and subtracted during the second, is the drift. The correction loop, which holds the gyroscope at its zero, is open while a
//! cycle measures, and closed otherwise and after any error. A rejected cycle carries its reason and enters no mean.
//!
//! In, at each whole millisecond: a sample of the angle and of the torquer's current ([`GyroSample`]), and the latched fault. Out: the
//! torquer's step from the next millisecond on, and a [`Cycle`] for each pair of pulses, as exact integers with their conversion. One timer
//! paces pulse edges and samples.
//!
//! * [`Pulse`]: the reference pulses, in steps of the torquer's converter; [`Integrator`]: the sums over a cycle;
//! * [`Commutator`]: rest, lead, pulses; [`DriftMean`]: means over a session; [`Register`]: a pair of positions;
//! * [`DriftMeasurement`]: the above as one session, shared with the console; [`observer`]: state observers;
//! * [`GyroLoop`]: samples and drives the gyroscope once in a millisecond; [`TimedOutput`]: the torquer's value from task to interrupt.
//!
//! *T* is the duration of one pulse, N samples; a cycle is 2 T. *Own* drift belongs to the gyroscope, *apparent* drift is the rotation of
//! the Earth. Formula (13) is ω = −(1/2T²) (∫₀ᵀ θ dt − ∫ᵀ²ᵀ θ dt), (15) and (16) its half sum and half difference over two positions.

mod commutator;
mod cycle;
mod drift;
mod integrator;
mod mean;
pub mod observer;
mod plan;
mod settings;
mod shape;
#[cfg(test)]
mod tests;
mod timed_output;
mod torquer;

pub use commutator::{Commutator, LEAD_ROWS, Phase};
pub use cycle::{Cycle, Polarity, Rejection};
pub use drift::DriftMeasurement;
pub use integrator::{Integrator, Sums};
pub use mean::{Drift, DriftMean, Pair, Register};
pub use plan::{MAX_PULSE_SAMPLES, Plan, PlanSettings, Sequence};
pub use settings::{Scales, Settings};
pub use shape::{Pulse, Shape};
pub use timed_output::TimedOutput;
pub use torquer::{GyroLoop, GyroReading};

#[cfg(doc)]
use crate::board::GyroSample;
