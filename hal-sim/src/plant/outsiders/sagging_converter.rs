//! A converter that sags under its recent output: u (1 − s z) for the command u, where z follows |u| with a time constant.
//!
//! The log contains the command; `supply_V` is measured before the converter and stays constant. Input of a tick: the command, constant
//! within it.

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Sags per volt that are clearly visible on the default stand, 1/V.
pub const TEST_RANGE_PER_V: (f64, f64) = (0.08, 0.3);
/// Corresponding time constants, s.
pub const TEST_RANGE_S: (f64, f64) = (0.3, 3.0);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SaggingConverter {
    /// Relative sag per volt of recent output, 1/V.
    pub sag_per_V: f64,
    /// Time constant of the memory, s.
    pub sag_s: f64,
}

impl Default for SaggingConverter {
    fn default() -> Self {
        SaggingConverter { sag_per_V: 0.15, sag_s: 0.8 }
    }
}

impl SaggingConverter {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("sagging-converter", "sag_per_V", self.sag_per_V, (0.0, 10.0))?;
        // A control tick does not resolve shorter times.
        within("sagging-converter", "sag_s", self.sag_s, (1e-3, 1e6))
    }
}

/// State of the converter.
#[derive(Debug, Clone)]
pub struct Sag {
    converter: SaggingConverter,
    /// The tick: start, magnitude of the command, memory at its start.
    from_s: f64,
    command_V: f64,
    memory_V: f64,
}

impl Sag {
    /// A converter without recent output.
    pub fn new(converter: &SaggingConverter) -> Self {
        Sag { converter: *converter, from_s: 0.0, command_V: 0.0, memory_V: 0.0 }
    }

    /// Starts a tick with its command; `t_s` must not decrease.
    pub fn tick(&mut self, command_V: f64, t_s: f64) {
        self.memory_V = self.memory_at(t_s);
        self.from_s = t_s;
        self.command_V = command_V.abs();
    }

    fn memory_at(&self, t_s: f64) -> f64 {
        self.command_V + (self.memory_V - self.command_V) * libm::exp(-(t_s - self.from_s) / self.converter.sag_s)
    }

    /// Output voltage over the command at a time within the tick.
    pub fn factor(&self, t_s: f64) -> f64 {
        (1.0 - self.converter.sag_per_V * self.memory_at(t_s)).max(0.0)
    }
}
