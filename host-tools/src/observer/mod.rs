//! State observers of a gyrotheodolite: design, simulation, frequency response (docs/theory.md §1 and §2).
//!
//! Input: the element's parameters ([`Plant`]: a preset or a TOML file), the poles, the kind of observer. Output: continuous and exact discrete
//! gains ([`Design`]), estimation errors ([`Simulated`]), frequency response ([`Bode`]), warnings ([`Warning`]), and the azimuth error
//! under vibration ([`vibration`]). Gains are computed with 77 digits and rounded once. The firmware's own code rejects what the firmware would refuse.

pub mod bode;
mod design;
mod discrete;
mod error;
mod exact;
mod plant;
mod poles;
mod request;
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
pub use design::Design;
pub use discrete::Discrete;
pub use error::ObserverError;
pub use plant::{Element, PRESETS, Plant};
pub use poles::Poles;
pub use request::{Integral, Kind, Request};
pub use simulate::{Disturbance, Regulator, SideBySide, Simulated, Start, Trace};
pub use warnings::Warning;
