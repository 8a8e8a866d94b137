//! A grinding bearing: an additional Coulomb torque c |x| that varies at random.
//!
//! x is an Ornstein–Uhlenbeck process of unit variance and correlation time τ (Gillespie, Phys. Rev. E 54 (1996) 2084: its exact step is
//! x e^(−Δ/τ) + √(1 − e^(−2Δ/τ)) n). It is drawn each millisecond and interpolated linearly, so that the path depends on the seed and
//! not on the tick length.

use crate::peripherals::standard_normal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

use super::{StandError, within};

/// Torques c that are clearly visible on the default stand, N m.
pub const TEST_RANGE_N_M: (f64, f64) = (8e-4, 2e-3);
/// Corresponding correlation times, s.
pub const TEST_RANGE_S: (f64, f64) = (0.05, 0.5);

/// Time between two draws, s.
const DRAW_INTERVAL_S: f64 = 1e-3;

/// Parameters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GrindingBearing {
    /// Root mean square of the additional Coulomb torque, N m.
    pub grinding_N_m: f64,
    /// Correlation time, s.
    pub grinding_s: f64,
    /// Seed of the path.
    pub seed: u64,
}

impl Default for GrindingBearing {
    fn default() -> Self {
        GrindingBearing { grinding_N_m: 1e-3, grinding_s: 0.2, seed: 1 }
    }
}

impl GrindingBearing {
    pub(super) fn check(&self) -> Result<(), StandError> {
        within("grinding-bearing", "grinding_N_m", self.grinding_N_m, (0.0, 1e3))?;
        // The draws do not resolve shorter times.
        within("grinding-bearing", "grinding_s", self.grinding_s, (0.01, 1e6))
    }
}

/// State of the bearing: the process between two draws.
#[derive(Debug, Clone)]
pub struct Grinding {
    level_N_m: f64,
    keeps: f64,
    generator: Xoshiro256PlusPlus,
    /// Number of draws, and the last two.
    draws: u64,
    last: f64,
    next: f64,
    /// The tick: start, length, torques at its ends.
    from_s: f64,
    length_s: f64,
    at_begin: f64,
    at_end: f64,
}

impl Grinding {
    /// The bearing at time 0.
    pub fn new(bearing: &GrindingBearing) -> Self {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(bearing.seed);
        let first = standard_normal(&mut generator);
        let keeps = libm::exp(-DRAW_INTERVAL_S / bearing.grinding_s);
        let level_N_m = bearing.grinding_N_m;
        let mut grinding = Grinding {
            level_N_m,
            keeps,
            generator,
            draws: 0,
            last: first,
            next: first,
            from_s: 0.0,
            length_s: 1.0,
            at_begin: 0.0,
            at_end: level_N_m * f64::abs(first),
        };
        grinding.draw();
        grinding
    }

    fn draw(&mut self) {
        let deviate = standard_normal(&mut self.generator);
        self.last = self.next;
        self.next = self.keeps * self.last + (1.0 - self.keeps * self.keeps).sqrt() * deviate;
        self.draws += 1;
    }

    /// Starts a tick of length `dt_s`; `t_s` must not decrease.
    pub fn tick(&mut self, t_s: f64, dt_s: f64) {
        let end = (t_s + dt_s) / DRAW_INTERVAL_S;
        while end > self.draws as f64 {
            self.draw();
        }
        let part = end - (self.draws - 1) as f64;
        self.from_s = t_s;
        self.length_s = dt_s;
        self.at_begin = self.at_end;
        self.at_end = self.level_N_m * (self.last + (self.next - self.last) * part).abs();
    }

    /// Additional Coulomb torque at a time within the tick, N m.
    pub fn level_N_m(&self, t_s: f64) -> f64 {
        self.at_begin + (self.at_end - self.at_begin) * (t_s - self.from_s) / self.length_s
    }
}
