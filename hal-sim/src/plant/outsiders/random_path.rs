//! Random processes of the disturbances: Ornstein–Uhlenbeck of unit variance, and a random walk.
//!
//! The exact step of an Ornstein–Uhlenbeck process of correlation time τ is x e^(−Δ/τ) + √(1 − e^(−2Δ/τ)) n (Gillespie, Phys. Rev. E 54
//! (1996) 2084). A random walk has increments √Δ n. Both are drawn each millisecond and interpolated linearly, so that the path depends on
//! the seed and not on the tick length.

use crate::peripherals::standard_normal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// Time between two draws, s.
pub const DRAW_INTERVAL_S: f64 = 1e-3;

/// A process between two draws, scaled to a quantity of the drive.
#[derive(Debug, Clone)]
pub struct RandomPath {
    generator: Xoshiro256PlusPlus,
    /// The quantity at a value of the process.
    scaled: fn(f64, f64) -> f64,
    level: f64,
    /// Factors of the last value and of the deviate in the next one.
    keeps: f64,
    adds: f64,
    /// Number of draws, and the last two.
    draws: u64,
    last: f64,
    next: f64,
    /// The tick: start, length, quantities at its ends.
    from_s: f64,
    length_s: f64,
    at_begin: f64,
    at_end: f64,
}

impl RandomPath {
    /// `level` |x| of a stationary process with a correlation time.
    pub fn folded(level: f64, correlation_s: f64, seed: u64) -> Self {
        let mut generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        let first = standard_normal(&mut generator);
        let keeps = libm::exp(-DRAW_INTERVAL_S / correlation_s);
        Self::begin(generator, |level, x| level * x.abs(), level, (keeps, (1.0 - keeps * keeps).sqrt()), first)
    }

    /// A random walk from zero, of `level` after one second.
    pub fn walk(level: f64, seed: u64) -> Self {
        let generator = Xoshiro256PlusPlus::seed_from_u64(seed);
        Self::begin(generator, |level, x| level * x, level, (1.0, DRAW_INTERVAL_S.sqrt()), 0.0)
    }

    fn begin(generator: Xoshiro256PlusPlus, scaled: fn(f64, f64) -> f64, level: f64, (keeps, adds): (f64, f64), first: f64) -> Self {
        let at_end = scaled(level, first);
        let (last, next) = (first, first);
        let mut path =
            RandomPath { generator, scaled, level, keeps, adds, draws: 0, last, next, from_s: 0.0, length_s: 1.0, at_begin: 0.0, at_end };
        path.draw();
        path
    }

    fn draw(&mut self) {
        let deviate = standard_normal(&mut self.generator);
        self.last = self.next;
        self.next = self.keeps * self.last + self.adds * deviate;
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
        self.at_end = (self.scaled)(self.level, self.last + (self.next - self.last) * part);
    }

    /// The quantity at a time within the tick.
    pub fn at(&self, t_s: f64) -> f64 {
        self.at_begin + (self.at_end - self.at_begin) * (t_s - self.from_s) / self.length_s
    }
}
