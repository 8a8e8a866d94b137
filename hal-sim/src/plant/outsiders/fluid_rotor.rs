//! A second rotor in a fluid: a body that only viscous friction couples to the rotor.
//!
//! J_f ω_f' = d (ω − ω_f), and the torque −d (ω − ω_f) on the rotor: a drag with memory, without stiffness.

use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Inertias as fractions of that of the default stand that are clearly visible.
pub const TEST_RANGE_SHARE: (f64, f64) = (0.2, 0.6);
/// Corresponding time constants J_f/d, s.
pub const TEST_RANGE_S: (f64, f64) = (0.1, 0.6);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FluidRotor {
    /// Inertia of the second rotor, kg m².
    pub fluid_kg_m2: f64,
    /// Coefficient of the viscous coupling, N m s.
    pub fluid_N_m_s: f64,
}

impl Default for FluidRotor {
    fn default() -> Self {
        FluidRotor { fluid_kg_m2: 1e-4, fluid_N_m_s: 4e-4 }
    }
}

impl FluidRotor {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("fluid-rotor", "fluid_kg_m2", self.fluid_kg_m2, (1e-12, 1e6))?;
        within("fluid-rotor", "fluid_N_m_s", self.fluid_N_m_s, (0.0, 1e6))
    }

    /// Torque on the rotor at a rate ahead of the second rotor, N m.
    pub fn torque_N_m(&self, ahead_rad_s: f64) -> f64 {
        -self.fluid_N_m_s * ahead_rad_s
    }

    /// Shortest time constant with a rotor of this inertia, s.
    pub fn fastest_s(&self, inertia_kg_m2: f64) -> f64 {
        let reduced = self.fluid_kg_m2 * inertia_kg_m2 / (self.fluid_kg_m2 + inertia_kg_m2);
        reduced / self.fluid_N_m_s.max(1e-12)
    }
}
