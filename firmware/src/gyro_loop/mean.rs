//! Drift over many cycles: the mean with its standard error, and the register of (15) or (16) over a pair of positions. Rejected cycles
//! enter neither.

use super::{Cycle, Polarity, Rejection, Scales};
use crate::board::ROW_HZ;

/// Running count, mean and sum of squares about it (Welford).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u32,
    mean: f32,
    squares: f32,
}

impl Moments {
    fn add(&mut self, value: f32) {
        self.count = self.count.saturating_add(1);
        let deviation = value - self.mean;
        self.mean += deviation / self.count as f32;
        self.squares += deviation * (value - self.mean);
    }
}

/// A mean drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// rad/s.
    pub rate_rad_s: f32,
    /// Standard error from the scatter of the cycles, rad/s; `None` with one cycle of each polarity.
    pub sigma_rad_s: Option<f32>,
}

/// Mean over the cycles of a session.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriftMean {
    by_polarity: [Moments; 2],
    /// Number of rejected cycles.
    pub rejected: u32,
}

impl DriftMean {
    /// Adds a cycle with this drift rate.
    pub fn add(&mut self, cycle: &Cycle, rate_rad_s: f32) {
        let moments = match (cycle.rejection, cycle.polarity) {
            (Rejection::None, Polarity::MinusPlus) => &mut self.by_polarity[1],
            (Rejection::None, _) => &mut self.by_polarity[0],
            _ => {
                self.rejected = self.rejected.saturating_add(1);
                return;
            }
        };
        moments.add(rate_rad_s);
    }

    /// Number of accepted cycles.
    pub fn accepted(&self) -> u32 {
        self.by_polarity[0].count + self.by_polarity[1].count
    }

    /// The mean of the polarities' means; `None` before the first accepted cycle.
    pub fn drift(&self) -> Option<Drift> {
        let used = || self.by_polarity.iter().filter(|moments| moments.count > 0);
        let polarities = used().count() as f32;
        let mean = used().map(|moments| moments.mean).sum::<f32>() / polarities;
        let freedom: u32 = used().map(|moments| moments.count - 1).sum();
        let variance = used().map(|moments| moments.squares).sum::<f32>() / freedom as f32;
        let mean_variance = used().map(|moments| variance / moments.count as f32).sum::<f32>() / (polarities * polarities);
        (polarities > 0.0)
            .then(|| Drift { rate_rad_s: mean, sigma_rad_s: (freedom > 0).then(|| libm::sqrt(f64::from(mean_variance)) as f32) })
    }
}

/// Quantity of the register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pair {
    /// Nothing.
    #[default]
    Off,
    /// Own drift: U + U′, the numerator of (15); the second position is commutated as the first one.
    Own,
    /// Apparent drift: U − U′, the numerator of (16); in the second position the commutation is inverted.
    Apparent,
}

/// Integrator over a pair of positions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Register {
    /// Its quantity.
    pub pair: Pair,
    /// Σ ± ACC2 over the accepted cycles of both positions.
    pub acc2: i64,
    /// Cycles in positions 1 and 2.
    pub cycles: [u32; 2],
    /// Σ of the polarities' signs, second position subtracted: errors odd in the reference cancel at 0.
    sign_balance: i32,
    samples: u32,
}

impl Register {
    /// A zeroed register.
    pub fn new(pair: Pair) -> Self {
        Self { pair, ..Self::default() }
    }

    /// Adds a cycle of position 1 or 2. Other positions, rejected cycles and cycles of another length are ignored.
    pub fn add(&mut self, cycle: &Cycle, zero_input_acc2: i64) {
        let place = usize::from(cycle.position).wrapping_sub(1);
        let fits = self.acc2 == 0 && self.cycles == [0, 0] || self.samples == cycle.samples;
        let Some(count) = self.cycles.get_mut(place) else { return };
        if self.pair == Pair::Off || cycle.rejection != Rejection::None || cycle.polarity == Polarity::Zero || !fits {
            return;
        }
        *count = count.saturating_add(1);
        self.samples = cycle.samples;
        let acc2 = cycle.sums.acc2.saturating_sub(zero_input_acc2);
        let swapped = place == 1 && self.pair == Pair::Apparent;
        self.acc2 = self.acc2.saturating_add(if swapped { -acc2 } else { acc2 });
        self.sign_balance += i32::from(cycle.polarity.sign()) * if place == 1 { -1 } else { 1 };
    }

    /// Drift rate of the register's quantity, ω = −Σ LSB Δt/(2 · 2 T²) per cycle of a position, rad/s. `None` unless both positions have
    /// the same number of cycles of each polarity.
    pub fn rate_rad_s(&self, scales: &Scales) -> Option<f32> {
        let [first, second] = self.cycles;
        let (n, cycles) = (self.samples as f32, first as f32);
        (first == second && first > 0 && self.sign_balance == 0)
            .then(|| -(self.acc2 as f32) * scales.rad_per_code * ROW_HZ as f32 / (4.0 * n * n * cycles))
    }
}
