//! Sums by angle: commanded voltage and deviation from the command, separately for both directions, and the mean current of each measured
//! leg.

use super::trajectory::Leg;
use core::f64::consts::TAU;

/// Bins of a turn, 0.7° each; harmonics far below this order are attenuated by a known factor only.
pub const BINS: usize = 512;

/// Sums of one bin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bin {
    pub voltage_V: f32,
    pub deviation_rad: f32,
    pub count: u32,
}

const EMPTY_TURN: [Bin; BINS] = [Bin { voltage_V: 0.0, deviation_rad: 0.0, count: 0 }; BINS];

/// Mean current over the angle. (The mean over time would be biased: cogging slows the platform where it opposes the motion, which looks
/// like friction; 3 % of it with 2 mN m at 3 rad/s.)
#[derive(Clone, Copy, Debug, Default)]
struct MeanCurrent {
    sum_A_rad: f64,
    angle_rad: f64,
    /// Angle and current of the row before; a row's current belongs to the angle up to the next one.
    last: Option<(f64, f64)>,
}

impl MeanCurrent {
    const ZERO: Self = Self { sum_A_rad: 0.0, angle_rad: 0.0, last: None };

    fn add(&mut self, theta_rad: f64, current_A: f64) {
        if let Some((last_rad, last_A)) = self.last.replace((theta_rad, current_A)) {
            self.sum_A_rad += last_A * (theta_rad - last_rad);
            self.angle_rad += theta_rad - last_rad;
        }
    }

    fn mean_A(&self) -> Option<f64> {
        (self.angle_rad != 0.0).then(|| self.sum_A_rad / self.angle_rad)
    }
}

/// Mean currents in both directions.
#[derive(Clone, Copy, Debug, Default)]
struct CurrentPair {
    forward: MeanCurrent,
    backward: MeanCurrent,
}

impl CurrentPair {
    const ZERO: Self = Self { forward: MeanCurrent::ZERO, backward: MeanCurrent::ZERO };
}

/// All sums, 12 KiB.
pub struct Map {
    forward: [Bin; BINS],
    backward: [Bin; BINS],
    slow: CurrentPair,
    fast: CurrentPair,
}

impl Default for Map {
    fn default() -> Self {
        Self::new()
    }
}

impl Map {
    /// An empty map.
    pub const fn new() -> Self {
        Self { forward: EMPTY_TURN, backward: EMPTY_TURN, slow: CurrentPair::ZERO, fast: CurrentPair::ZERO }
    }

    /// Empties the map, without a second one on the stack.
    pub(super) fn clear(&mut self) {
        self.forward.fill(Bin::default());
        self.backward.fill(Bin::default());
        self.slow = CurrentPair::ZERO;
        self.fast = CurrentPair::ZERO;
    }

    /// Adds the current of a row: angle from a fixed zero, rad; current, A.
    pub(super) fn add_current(&mut self, leg: &Leg, theta_rad: f64, current_A: f64) {
        let pair = if leg.is_slow { &mut self.slow } else { &mut self.fast };
        let mean = if leg.rate_rad_s < 0.0 { &mut pair.backward } else { &mut pair.forward };
        mean.add(theta_rad, current_A);
    }

    /// Adds a row of a slow leg: angle from the index, rad; voltage, V; angle minus its command, rad.
    pub(super) fn add(&mut self, leg: &Leg, angle_rad: f64, voltage_V: f64, deviation_rad: f64) {
        if !leg.is_slow {
            return;
        }
        let bins = if leg.rate_rad_s < 0.0 { &mut self.backward } else { &mut self.forward };
        let turns = angle_rad / TAU;
        let bin = ((turns - libm::floor(turns)) * BINS as f64) as usize;
        if let Some(bin) = bins.get_mut(bin.min(BINS - 1)) {
            bin.voltage_V += voltage_V as f32;
            bin.deviation_rad += deviation_rad as f32;
            bin.count += 1;
        }
    }

    /// The bins of the forward turns.
    pub(super) fn forward(&self) -> &[Bin; BINS] {
        &self.forward
    }

    /// The bins of the backward turns.
    pub(super) fn backward(&self) -> &[Bin; BINS] {
        &self.backward
    }

    /// Current against friction at the slow and at the fast rate, A: half the difference of both directions. `None` without a measurement.
    pub(super) fn friction_currents_A(&self) -> Option<(f64, f64)> {
        let half_difference = |pair: &CurrentPair| Some(0.5 * (pair.forward.mean_A()? - pair.backward.mean_A()?));
        Some((half_difference(&self.slow)?, half_difference(&self.fast)?))
    }
}
