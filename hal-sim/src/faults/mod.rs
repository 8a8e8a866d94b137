//! Faults of the simulated stand, and when they occur.
//!
//! Input: a list, from a stand file or a test. Times are seconds from power-on. Defaults: from the start, without end, with
//! the default magnitude of the kind.
//!
//! ```toml
//! [[faults]]
//! what   = "supply-dip"
//! from_s = 2.0
//! for_s  = 0.5
//! size   = 7.0
//! ```
//! Output: at each tick, the active faults ([`ActiveFaults`]), which the bench queries; `encoder` simulates a quadrature counter with
//! disconnected wires. A list holds [`MAX_FAULTS`]; nothing is allocated while the stand runs.

mod active;
mod encoder;
mod kind;
mod list;

pub use active::ActiveFaults;
pub use encoder::Decoder;
pub use kind::{FaultKind, Magnitude};
pub use list::{FaultError, Faults, MAX_FAULTS};

use serde::{Deserialize, Serialize};

/// A fault over a period of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// The kind.
    #[serde(rename = "what")]
    pub kind: FaultKind,
    /// Start, s.
    #[serde(default)]
    pub from_s: f64,
    /// Duration, s.
    #[serde(default = "for_ever", skip_serializing_if = "is_for_ever")]
    pub for_s: f64,
    /// Magnitude ([`FaultKind::magnitude`]); the default of the kind if missing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size: Option<f64>,
}

fn for_ever() -> f64 {
    f64::INFINITY
}

fn is_for_ever(for_s: &f64) -> bool {
    *for_s == f64::INFINITY
}

impl Fault {
    /// A fault from `from_s` on for `for_s` seconds, with the default magnitude.
    pub fn new(kind: FaultKind, from_s: f64, for_s: f64) -> Self {
        Self { kind, from_s, for_s, size: None }
    }

    /// With another magnitude.
    pub fn with_magnitude(self, size: f64) -> Self {
        Self { size: Some(size), ..self }
    }

    /// The magnitude, or the default; 0 where the kind has none.
    pub fn magnitude(&self) -> f64 {
        self.size.or(self.kind.magnitude().map(|m| m.default)).unwrap_or(0.0)
    }

    /// End, s; the only computation, so that rounding is equal for all uses.
    pub fn until_s(&self) -> f64 {
        self.from_s + self.for_s
    }

    /// Whether the fault is active at `at_s`.
    pub fn is_at(&self, at_s: f64) -> bool {
        at_s >= self.from_s && at_s < self.until_s()
    }
}
