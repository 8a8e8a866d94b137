//! A bad contact of brush or plug: an additional resistance in series with the winding that comes and goes at random.
//!
//! A two-state Markov process: the time to the next change has an exponential distribution. It is drawn each millisecond, so that the path
//! depends on the seed and not on the tick length. The log does not contain it.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};

use super::random_path::DRAW_INTERVAL_S;
use super::{StandError, within};

/// Resistances that are clearly visible on the default stand, Ω.
pub const TEST_RANGE_OHM: (f64, f64) = (4.0, 15.0);
/// Corresponding mean times between two interruptions, s.
pub const TEST_RANGE_EVERY_S: (f64, f64) = (0.2, 1.0);
/// Corresponding mean durations, s.
pub const TEST_RANGE_FOR_S: (f64, f64) = (0.01, 0.05);

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BadContact {
    /// Resistance while the contact is bad, Ω.
    pub contact_ohm: f64,
    /// Mean duration of a good contact, s.
    pub good_for_s: f64,
    /// Mean duration of a bad contact, s.
    pub bad_for_s: f64,
    /// Seed of the path.
    pub seed: u64,
}

impl Default for BadContact {
    fn default() -> Self {
        BadContact { contact_ohm: 8.0, good_for_s: 0.4, bad_for_s: 0.02, seed: 1 }
    }
}

impl BadContact {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("bad-contact", "contact_ohm", self.contact_ohm, (0.0, 100.0))?;
        // The draws do not resolve shorter times.
        within("bad-contact", "good_for_s", self.good_for_s, (2.0 * DRAW_INTERVAL_S, 1e6))?;
        within("bad-contact", "bad_for_s", self.bad_for_s, (2.0 * DRAW_INTERVAL_S, 1e6))
    }
}

/// State of the contact.
#[derive(Debug, Clone)]
pub struct Contact {
    contact: BadContact,
    generator: Xoshiro256PlusPlus,
    draws: u64,
    is_bad: bool,
}

impl Contact {
    /// A good contact at time 0.
    pub fn new(contact: &BadContact) -> Self {
        Contact { contact: *contact, generator: Xoshiro256PlusPlus::seed_from_u64(contact.seed), draws: 0, is_bad: false }
    }

    /// Starts a tick of length `dt_s`; `t_s` must not decrease. The state changes between ticks.
    pub fn tick(&mut self, t_s: f64, dt_s: f64) {
        while (t_s + 0.5 * dt_s) / DRAW_INTERVAL_S > (self.draws + 1) as f64 {
            let mean_s = if self.is_bad { self.contact.bad_for_s } else { self.contact.good_for_s };
            let draw = (self.generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
            if draw < 1.0 - libm::exp(-DRAW_INTERVAL_S / mean_s) {
                self.is_bad = !self.is_bad;
            }
            self.draws += 1;
        }
    }

    /// Resistance in series with the winding in this tick, Ω.
    pub fn series_ohm(&self) -> f64 {
        if self.is_bad { self.contact.contact_ohm } else { 0.0 }
    }
}
