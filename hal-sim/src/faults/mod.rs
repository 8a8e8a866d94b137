//! What can be broken on the simulated stand, and when.
//!
//! In: a list, from a stand's file or from a test. Times are seconds from power-on; what a fault does not say is from the beginning, for ever,
//! of the usual size.
//!
//! ```toml
//! [[faults]]
//! what   = "supply-dip"
//! from_s = 2.0
//! for_s  = 0.5
//! size   = 7.0
//! ```
//! Out: at each tick, what is broken now ([`Broken`]), which the bench asks where it senses and drives; `encoder` is what wires that are
//! off do to a quadrature counter. A list holds [`MOST_FAULTS`]; nothing is allocated while the stand runs.

mod broken;
mod encoder;
mod list;
mod what;

pub use broken::Broken;
pub use encoder::Decoder;
pub use list::{FaultError, Faults, MOST_FAULTS};
pub use what::{Size, What};

use serde::{Deserialize, Serialize};

/// One thing that is broken for a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fault {
    /// What is broken.
    pub what: What,
    /// From when on, s.
    #[serde(default)]
    pub from_s: f64,
    /// For how long, s.
    #[serde(default = "for_ever", skip_serializing_if = "is_for_ever")]
    pub for_s: f64,
    /// How much ([`What::size`]); the usual size where it is not said.
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
    /// This is broken from `from_s` on for `for_s` seconds, of the usual size.
    pub fn new(what: What, from_s: f64, for_s: f64) -> Self {
        Self { what, from_s, for_s, size: None }
    }

    /// Of another size.
    pub fn of_size(self, size: f64) -> Self {
        Self { size: Some(size), ..self }
    }

    /// Its size, or the usual one; 0 where it has none.
    pub fn size(&self) -> f64 {
        self.size.or(self.what.size().map(|size| size.usual)).unwrap_or(0.0)
    }

    /// When it is over; told in one way, so that its end is not passed by where the digits are rounded.
    pub fn until_s(&self) -> f64 {
        self.from_s + self.for_s
    }

    /// Whether it is so at `at_s`.
    pub fn is_at(&self, at_s: f64) -> bool {
        at_s >= self.from_s && at_s < self.until_s()
    }
}
