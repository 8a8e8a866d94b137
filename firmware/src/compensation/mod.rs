//! Compensation in SI units: friction, and torques that depend on the angle.
//!
//! In: parameters of a fit or of the stand's own calibration (`calibration`). Out: a checked [`Compensation`], which the speed loop feeds
//! forward (`speed_loop/feed_forward.rs`). A harmonic is given as the *disturbance*, a sin(nθ + φ) on the rotor (docs/effects.md, `cogging`
//! and `unbalance`), with θ = 0 at the index; the loop applies its opposite.

mod files;

use crate::config::{ConfigError, all_within, within};

/// Largest number of harmonics.
pub const MAX_HARMONICS: usize = 8;
/// Highest harmonic order, periods per turn, as in the catalogue of effects.
pub const MAX_HARMONIC_ORDER: u16 = 400;

/// A torque on the rotor, `torque_N_m · sin(order · θ + phase_rad)`.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Harmonic {
    /// Periods per turn, 1 … 400.
    pub order: u16,
    /// Amplitude, N m.
    pub torque_N_m: f64,
    /// Phase at the index, rad.
    pub phase_rad: f64,
}

/// Up to [`MAX_HARMONICS`] harmonics, in the sequence given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics {
    list: [Harmonic; MAX_HARMONICS],
    count: usize,
}

impl Harmonics {
    /// The harmonics of a list; `None` if there are too many.
    pub fn of(harmonics: impl IntoIterator<Item = Harmonic>) -> Option<Self> {
        let mut all = Self::default();
        harmonics.into_iter().try_for_each(|harmonic| all.push(harmonic))?;
        Some(all)
    }

    /// Adds one; `None` if the list is full.
    pub fn push(&mut self, harmonic: Harmonic) -> Option<()> {
        *self.list.get_mut(self.count)? = harmonic;
        self.count += 1;
        Some(())
    }

    /// The harmonics.
    pub fn as_slice(&self) -> &[Harmonic] {
        self.list.get(..self.count).unwrap_or_default()
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A compensation. The default compensates nothing.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Compensation {
    /// Coulomb friction, by the sign of the commanded rate, N m.
    pub coulomb_N_m: f64,
    /// Commanded rate above which Coulomb friction is fully compensated; below, in proportion, rad/s.
    pub coulomb_fade_rad_s: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_N_m_s: f64,
    /// Delay of the torque behind the voltage by the winding, L/R, s.
    pub winding_lag_s: f64,
    /// Torques that depend on the angle; they need the index.
    pub harmonics: Harmonics,
}

impl Default for Compensation {
    fn default() -> Self {
        Self {
            coulomb_N_m: 0.0,
            // Below that rate the default stand stops during part of each turn anyway, by its friction.
            coulomb_fade_rad_s: 0.02,
            viscous_N_m_s: 0.0,
            winding_lag_s: 0.238e-3 / 2.32, // maxon RE 25, 118752: terminal inductance over terminal resistance
            harmonics: Harmonics::default(),
        }
    }
}

impl Compensation {
    /// Whether friction is compensated.
    pub fn has_friction(&self) -> bool {
        self.coulomb_N_m != 0.0 || self.viscous_N_m_s != 0.0
    }

    /// Checks all numbers; `torque_limit_N_m`: the drive's torque at its current limit.
    ///
    /// # Errors
    /// The name of the first parameter that is not finite or out of its range.
    pub fn check(&self, torque_limit_N_m: f64) -> Result<(), ConfigError> {
        within("compensation.coulomb_N_m", self.coulomb_N_m, 0.0, torque_limit_N_m)?;
        all_within! { of self, "compensation.";
            coulomb_fade_rad_s: 1e-6, 1e3;
            viscous_N_m_s: 0.0, 1e3;
            winding_lag_s: 0.0, 0.1;
        }?;
        let mut sum_N_m = 0.0;
        for harmonic in self.harmonics.as_slice() {
            all_within! { of harmonic, "compensation.harmonics.";
                order: 1.0, MAX_HARMONIC_ORDER as f64;
                phase_rad: -1e3, 1e3;
            }?;
            sum_N_m += within("compensation.harmonics.torque_N_m", harmonic.torque_N_m, 0.0, torque_limit_N_m)?;
        }
        // The drive must be able to oppose the sum of all harmonics.
        within("compensation.harmonics.torque_N_m (sum)", sum_N_m, 0.0, torque_limit_N_m).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ninth_harmonic_is_refused() {
        let one = Harmonic { order: 7, torque_N_m: 1e-3, phase_rad: 0.0 };
        assert_eq!(Harmonics::of([one; MAX_HARMONICS]).map(|h| h.as_slice().len()), Some(MAX_HARMONICS));
        assert_eq!(Harmonics::of([one; MAX_HARMONICS + 1]), None);
    }

    #[test]
    fn every_number_that_makes_no_sense_is_refused_by_its_name() {
        type Spoil = fn(&mut Compensation);
        let cases: [(&str, Spoil); 9] = [
            ("compensation.coulomb_N_m", |c| c.coulomb_N_m = -1e-3),
            ("compensation.coulomb_N_m", |c| c.coulomb_N_m = 1.0),
            ("compensation.coulomb_fade_rad_s", |c| c.coulomb_fade_rad_s = 0.0),
            ("compensation.viscous_N_m_s", |c| c.viscous_N_m_s = f64::NAN),
            ("compensation.winding_lag_s", |c| c.winding_lag_s = -1.0),
            ("compensation.harmonics.order", |c| c.harmonics = one(0, 1e-3, 0.0)),
            ("compensation.harmonics.torque_N_m", |c| c.harmonics = one(7, -1e-3, 0.0)),
            ("compensation.harmonics.phase_rad", |c| c.harmonics = one(7, 1e-3, f64::INFINITY)),
            ("compensation.harmonics.torque_N_m (sum)", |c| {
                c.harmonics = Harmonics::of([7, 14, 21].map(|order| Harmonic { order, torque_N_m: 0.02, phase_rad: 0.0 })).unwrap();
            }),
        ];
        for (name, spoil) in cases {
            let mut bad = Compensation::default();
            assert_eq!(bad.check(0.035), Ok(()));
            spoil(&mut bad);
            assert_eq!(bad.check(0.035).map_err(|e| e.parameter()), Err(name));
        }
    }

    fn one(order: u16, torque_N_m: f64, phase_rad: f64) -> Harmonics {
        Harmonics::of([Harmonic { order, torque_N_m, phase_rad }]).unwrap()
    }
}
