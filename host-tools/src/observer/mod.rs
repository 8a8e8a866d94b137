//! State observers of a gyrotheodolite: designed, simulated, seen over frequency (theory §1, §2).
//!
//! In: an element's parameters ([`Plant`]: a preset or a TOML file), where the poles shall lie, which kind of observer. Out: gains, continuous
//! and exact discrete ([`Design`]), what its errors do ([`Simulated`]), where it distorts ([`Bode`]), what to beware of; and what vibration does
//! to an azimuth ([`vibration`]). Gains are worked out in 77 digits and rounded once; what the firmware would refuse is refused here, by its own code.

pub mod answer;
pub mod bode;
mod design;
mod discrete;
mod error;
mod exact;

mod plant;
mod poles;
mod simulate;
mod single;
#[cfg(test)]
mod tests;
pub mod vibration;
mod warnings;

pub use answer::{Beside, bode_json, bode_text, design_json, design_text, simulate_json, simulate_text, vibration_json, vibration_text};
pub use bode::{Bode, Limit};
pub use design::{Design, Integral, Kind, Request};
pub use discrete::Discrete;
pub use error::ObserverError;
pub use plant::{Element, PRESETS, Plant};
pub use poles::Poles;
pub use simulate::{Disturbed, Regulated, Simulated, Start, Trace};
