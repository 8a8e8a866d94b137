//! What was learnt of the drive, in a person's units: friction and torques that depend on the angle.
//!
//! In: numbers of a fit or of the stand's own calibration ([`crate::calibration`]). Out: a checked [`Compensation`], which the
//! speed loop feeds forward (`speed_loop/feed_forward.rs`). A harmonic is written as the *disturbance* is, a sin(nθ + φ) on the rotor
//! (effects.md, `cogging` and `unbalance`), with θ = 0 at the index; the loop applies its opposite. The list holds at most
//! [`MOST_HARMONICS`]: what a tick can afford.

mod files;

use crate::config::{ConfigError, within};

/// Greatest number of harmonics.
pub const MOST_HARMONICS: usize = 8;
/// Highest order of a harmonic, periods per turn; the catalogue's limit, too.
pub const HIGHEST_ORDER: u16 = 400;

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

/// Up to [`MOST_HARMONICS`] harmonics, in the order in which they were given.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Harmonics {
    list: [Harmonic; MOST_HARMONICS],
    count: usize,
}

impl Harmonics {
    /// The harmonics of a list; `None` where there are too many.
    pub fn of(harmonics: impl IntoIterator<Item = Harmonic>) -> Option<Self> {
        let mut all = Self::default();
        harmonics.into_iter().try_for_each(|harmonic| all.push(harmonic))?;
        Some(all)
    }

    /// Adds one; `None` where there is no room.
    pub fn push(&mut self, harmonic: Harmonic) -> Option<()> {
        *self.list.get_mut(self.count)? = harmonic;
        self.count += 1;
        Some(())
    }

    /// As a slice.
    pub fn as_slice(&self) -> &[Harmonic] {
        self.list.get(..self.count).unwrap_or_default()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// The learnt compensation. The default compensates nothing.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Compensation {
    /// Dry friction, by the sign of the commanded rate, N m.
    pub coulomb_N_m: f64,
    /// Commanded rate from which on dry friction is compensated whole; below, in proportion, rad/s.
    pub coulomb_fade_rad_s: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_N_m_s: f64,
    /// Time by which the winding's torque is behind its voltage, L/R, s.
    pub winding_lag_s: f64,
    /// Torques that depend on the angle; they wait for the index.
    pub harmonics: Harmonics,
}

impl Default for Compensation {
    fn default() -> Self {
        Self {
            coulomb_N_m: 0.0,
            // Slower than that, the default stand with its dry friction stands still for part of each turn anyway.
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

    /// Checks all numbers; `torque_limit_N_m` is what the drive has at its current limit.
    ///
    /// # Errors
    /// The name of the first parameter that is not a number or makes no sense.
    pub fn check(&self, torque_limit_N_m: f64) -> Result<(), ConfigError> {
        within("compensation.coulomb_N_m", self.coulomb_N_m, 0.0, torque_limit_N_m)?;
        within("compensation.coulomb_fade_rad_s", self.coulomb_fade_rad_s, 1e-6, 1e3)?;
        within("compensation.viscous_N_m_s", self.viscous_N_m_s, 0.0, 1e3)?;
        within("compensation.winding_lag_s", self.winding_lag_s, 0.0, 0.1)?;
        let mut sum_N_m = 0.0;
        for harmonic in self.harmonics.as_slice() {
            within("compensation.harmonics.order", f64::from(harmonic.order), 1.0, f64::from(HIGHEST_ORDER))?;
            sum_N_m += within("compensation.harmonics.torque_N_m", harmonic.torque_N_m, 0.0, torque_limit_N_m)?;
            within("compensation.harmonics.phase_rad", harmonic.phase_rad, -1e3, 1e3)?;
        }
        // Where all of them meet, the drive must still be able to give it.
        within("compensation.harmonics.torque_N_m (sum)", sum_N_m, 0.0, torque_limit_N_m).map(|_| ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ninth_harmonic_has_no_room() {
        let one = Harmonic { order: 7, torque_N_m: 1e-3, phase_rad: 0.0 };
        assert_eq!(Harmonics::of([one; MOST_HARMONICS]).map(|h| h.as_slice().len()), Some(MOST_HARMONICS));
        assert_eq!(Harmonics::of([one; MOST_HARMONICS + 1]), None);
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
