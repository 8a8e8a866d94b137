//! Sums by angle: what was asked of the motor, and how far the platform was from its command.
//!
//! Two maps of a turn, one for each direction, and the mean current of each measured leg. A bin is 0.7°; orders far below [`BINS`] are
//! whole in it but for a factor that is known.

use super::course::Leg;
use core::f64::consts::TAU;

/// Bins of a turn.
pub const BINS: usize = 512;

/// Sums of one bin.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Bin {
    pub voltage_V: f32,
    pub deviation_rad: f32,
    pub count: u32,
}

/// A mean over the angle. (Over time it would not do: cogging holds the platform back where it pulls back, and its own mean would be
/// taken for friction, 3 % of it with 2 mN m at 3 rad/s.)
#[derive(Clone, Copy, Debug, Default)]
struct Mean {
    sum_A_rad: f64,
    angle_rad: f64,
    /// Angle and current of the row before; a row's current belongs to the angle up to the next.
    last: Option<(f64, f64)>,
}

/// All sums; 12 KiB, the caller's.
pub struct Map {
    /// Forwards, backwards.
    turns: [[Bin; BINS]; 2],
    /// Currents: slow forwards and backwards, faster forwards and backwards.
    currents: [Mean; 4],
}

impl Default for Map {
    fn default() -> Self {
        Self::new()
    }
}

impl Map {
    /// Empty.
    pub const fn new() -> Self {
        const EMPTY: Bin = Bin { voltage_V: 0.0, deviation_rad: 0.0, count: 0 };
        const NONE: Mean = Mean { sum_A_rad: 0.0, angle_rad: 0.0, last: None };
        Self { turns: [[EMPTY; BINS]; 2], currents: [NONE; 4] }
    }

    /// Empties it.
    pub(super) fn clear(&mut self) {
        for bin in self.turns.iter_mut().flatten() {
            *bin = Bin::default();
        }
        self.currents = [Mean::default(); 4];
    }

    /// One row of a measured leg: its angle, rad, from a zero that does not move; its current, A.
    pub(super) fn take_current(&mut self, leg: &Leg, theta_rad: f64, current_A: f64) {
        let backwards = usize::from(leg.rate_rad_s < 0.0);
        let Some(mean) = self.currents.get_mut(backwards + if leg.slow { 0 } else { 2 }) else { return };
        if let Some((before_rad, before_A)) = mean.last.replace((theta_rad, current_A)) {
            mean.sum_A_rad += before_A * (theta_rad - before_rad);
            mean.angle_rad += theta_rad - before_rad;
        }
    }

    /// One row of a measured leg: its angle from the index, rad; voltage, V; angle minus its command, rad.
    pub(super) fn take(&mut self, leg: &Leg, angle_rad: f64, voltage_V: f64, deviation_rad: f64) {
        if !leg.slow {
            return;
        }
        let backwards = usize::from(leg.rate_rad_s < 0.0);
        let turns = angle_rad / TAU;
        let bin = ((turns - libm::floor(turns)) * BINS as f64) as u32 as usize;
        if let Some(bin) = self.turns.get_mut(backwards).and_then(|turn| turn.get_mut(bin.min(BINS - 1))) {
            bin.voltage_V += voltage_V as f32;
            bin.deviation_rad += deviation_rad as f32;
            bin.count += 1;
        }
    }

    /// The bins of one direction.
    pub(super) fn turn(&self, backwards: bool) -> &[Bin; BINS] {
        let [forwards, back] = &self.turns;
        if backwards { back } else { forwards }
    }

    /// Half the difference of the mean currents of both directions, A: what friction takes. `None` where nothing was measured.
    pub(super) fn friction_A(&self, slow: bool) -> Option<f64> {
        let [a, b, c, d] = self.currents;
        let (forwards, backwards) = if slow { (a, b) } else { (c, d) };
        let mean = |m: Mean| (m.angle_rad != 0.0).then(|| m.sum_A_rad / m.angle_rad);
        Some(0.5 * (mean(forwards)? - mean(backwards)?))
    }
}
