//! Over many cycles: the mean drift with its error, and the register that holds (15) or (16) over a pair of positions.
//!
//! Bad cycles enter neither.

use super::{Bad, Cycle, Polarity, Scales};
use crate::board::ROW_HZ;

/// Numbers as they come: how many, mean, sum of squares about it (Welford).
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    count: u32,
    mean: f32,
    squares: f32,
}

impl Moments {
    fn take(&mut self, value: f32) {
        self.count = self.count.saturating_add(1);
        let off = value - self.mean;
        self.mean += off / self.count as f32;
        self.squares += off * (value - self.mean);
    }
}

/// A mean drift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drift {
    /// rad/s.
    pub rate_rad_s: f32,
    /// Its standard error by the scatter of the cycles, rad/s; `None` from one cycle of each polarity.
    pub sigma_rad_s: Option<f32>,
}

/// A session's cycles.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    by_polarity: [Moments; 2],
    /// Cycles that entered no mean.
    pub bad: u32,
}

impl Tally {
    /// Takes a cycle whose drift rate is this.
    pub fn take(&mut self, cycle: &Cycle, rate_rad_s: f32) {
        let place = match (cycle.bad, cycle.polarity) {
            (Bad::No, Polarity::MinusPlus) => &mut self.by_polarity[1],
            (Bad::No, _) => &mut self.by_polarity[0],
            _ => {
                self.bad = self.bad.saturating_add(1);
                return;
            }
        };
        place.take(rate_rad_s);
    }

    /// Cycles that did.
    pub fn good(&self) -> u32 {
        self.by_polarity[0].count + self.by_polarity[1].count
    }

    /// The mean of the polarities' means; `None` before the first good cycle.
    pub fn drift(&self) -> Option<Drift> {
        let used = || self.by_polarity.iter().filter(|moments| moments.count > 0);
        let kinds = used().count() as f32;
        let mean = used().map(|moments| moments.mean).sum::<f32>() / kinds;
        let free: u32 = used().map(|moments| moments.count - 1).sum();
        let variance = used().map(|moments| moments.squares).sum::<f32>() / free as f32;
        let of_mean = used().map(|moments| variance / moments.count as f32).sum::<f32>() / (kinds * kinds);
        (kinds > 0.0).then(|| Drift { rate_rad_s: mean, sigma_rad_s: (free > 0).then(|| libm::sqrt(f64::from(of_mean)) as f32) })
    }
}

/// What the register is to hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pair {
    /// Nothing.
    #[default]
    Off,
    /// U + U′, the numerator of (15): the second position's samples are added and taken away as the first one's.
    Own,
    /// U − U′, that of (16): in the second position the switch is thrown the other way round.
    Apparent,
}

/// The integrator that is not zeroed between the positions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Register {
    /// What it holds.
    pub pair: Pair,
    /// Σ ± ACC2 over the good cycles of both positions.
    pub acc2: i64,
    /// How many in positions 1 and 2.
    pub cycles: [u32; 2],
    /// Σ of the polarities' signs, second position taken off: 0 where what is odd in the reference goes out.
    odd: i32,
    samples: u32,
}

impl Register {
    /// Zeroed, to hold this.
    pub fn new(pair: Pair) -> Self {
        Self { pair, ..Self::default() }
    }

    /// Takes a cycle of position 1 or 2; others, bad ones, and ones of another length than the first are passed over.
    pub fn take(&mut self, cycle: &Cycle, null_acc2: i64) {
        let place = usize::from(cycle.position).wrapping_sub(1);
        let fits = self.acc2 == 0 && self.cycles == [0, 0] || self.samples == cycle.samples;
        let Some(count) = self.cycles.get_mut(place) else { return };
        if self.pair == Pair::Off || cycle.bad != Bad::No || cycle.polarity == Polarity::Zero || !fits {
            return;
        }
        *count = count.saturating_add(1);
        self.samples = cycle.samples;
        let acc2 = cycle.sums.acc2.saturating_sub(null_acc2);
        let swapped = place == 1 && self.pair == Pair::Apparent;
        self.acc2 = self.acc2.saturating_add(if swapped { -acc2 } else { acc2 });
        self.odd += i32::from(cycle.polarity.sign()) * if place == 1 { -1 } else { 1 };
    }

    /// The drift of its kind, ω = −Σ LSB Δt/(2 · 2 T²) per cycle of a position, rad/s. `None` unless both positions have as many cycles of
    /// each polarity.
    pub fn rate_rad_s(&self, scales: &Scales) -> Option<f32> {
        let [first, second] = self.cycles;
        let (n, cycles) = (self.samples as f32, first as f32);
        (first == second && first > 0 && self.odd == 0)
            .then(|| -(self.acc2 as f32) * scales.rad_per_code * ROW_HZ as f32 / (4.0 * n * n * cycles))
    }
}
