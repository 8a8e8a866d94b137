//! State observers of a gyrotheodolite: design, simulation, frequency response (docs/theory.md §1 and §2).
//!
//! Input: the element's parameters ([`Plant`]: a preset or a TOML file), the poles, the kind of observer. Output: continuous and exact
//! discrete gains ([`Design`]), estimation errors ([`Simulated`]), frequency response ([`Bode`]), warnings ([`Warning`]), and the azimuth
//! error under vibration ([`vibration`]), estimates over a recorded log ([`recorded`]). Gains are computed with 77 digits and rounded once.
//! The firmware's own code rejects what the firmware would refuse.

pub mod bode;
mod closed_loop;
mod design;
mod discrete;
mod error;
mod exact;
pub mod moment;
mod plant;
mod poles;
pub mod recorded;
mod request;
mod response;
pub mod serial_stand;
pub mod side_by_side;
mod simulate;
mod single;
#[cfg(test)]
mod tests;
pub mod vibration;
pub mod vibration_log;
mod warnings;

pub use bode::{Bode, Limit};
pub use closed_loop::{Regulator, closed_loop_poles, discrete_loop_radius};
pub use design::Design;
pub use discrete::Discrete;
pub use error::ObserverError;
pub use moment::Moment;
pub use plant::{Element, PRESETS, Plant};
pub use poles::Poles;
pub use request::{DEFAULT_INTEGRAL_ROW, Integral, Kind, Request};
pub use response::RateResponse;
pub use simulate::{ClosedTrace, Disturbance, SideBySide, Simulated, Start, Trace};
pub use warnings::Warning;
