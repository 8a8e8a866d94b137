//! Ramp: the rate command under an acceleration limit, and the position command as its integral.
//!
//! Both are integers in fixed point (2⁻³² counts, 2⁻³² counts per tick), so that no rounding accumulates and the mean rate is as accurate
//! as the crystal. The whole counts of a position wrap as those of the encoder do.
//!
//! In, once in a millisecond: the target rate. Out, each tick: position and rate command. The rate follows its target under the
//! acceleration limit and is then averaged over [`AVERAGED_MS`] milliseconds: the acceleration, and with it the voltage, changes in small
//! steps, and only where a millisecond (a row of the log) begins. Within a millisecond the rate is linear and the position its integral by
//! the trapezoidal rule.

use super::segment::fixed_to_f32;
use crate::board::CONTROL_PER_ROW;

/// Milliseconds over which the rate command is averaged: the time in which the acceleration rises to its limit.
pub const AVERAGED_MS: usize = 1 << AVERAGED_SHIFT;
const AVERAGED_SHIFT: u32 = 5;
const TICKS_PER_MS: i64 = CONTROL_PER_ROW as i64;

/// Limits of the ramp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    /// Greatest change of the rate command in a millisecond, 2⁻³² counts per tick: the acceleration limit.
    pub max_rate_step: i64,
    /// Greatest difference between the position command and the platform's position, 2⁻³² counts.
    pub max_slip: i64,
}

/// The ramp at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ramp {
    /// Position command, 2⁻³² counts.
    pub position: i64,
    /// Rate command, 2⁻³² counts per tick.
    pub rate: i64,
    /// Change of the rate command in a tick, 2⁻³² counts per tick².
    pub acceleration: i64,
    /// Rate command at the end of the current millisecond, 2⁻³² counts per tick.
    end_rate: i64,
    unsmoothed: Unsmoothed,
    average: MovingAverage,
}

/// The command at the end of the current millisecond, before averaging.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unsmoothed {
    /// 2⁻³² counts per tick.
    pub rate: i64,
    /// 2⁻³² counts.
    pub position: i64,
}

impl Ramp {
    /// Starts at this position (2⁻³² counts) and with this rate (2⁻³² counts per tick).
    pub fn start(&mut self, position: i64, rate: i64) {
        (self.position, self.rate, self.acceleration, self.end_rate) = (position, rate, 0, rate);
        self.unsmoothed = Unsmoothed { rate, position };
        self.average.fill(rate);
    }

    /// The command before averaging: the approach to an angle plans with it.
    pub fn unsmoothed(&self) -> Unsmoothed {
        self.unsmoothed
    }

    /// Advances the command by a tick.
    #[inline]
    pub fn advance(&mut self) {
        self.position = self.position.wrapping_add(self.rate).wrapping_add(self.acceleration >> 1);
        self.rate = self.rate.wrapping_add(self.acceleration);
    }

    /// Plans the millisecond that begins now, towards the rate `target`. Returns whether the acceleration limit is in force.
    #[inline]
    pub fn plan_millisecond(&mut self, target: i64, config: &Config) -> bool {
        let wanted = target.wrapping_sub(self.unsmoothed.rate);
        let step = limited(wanted, config.max_rate_step);
        let mean_rate = self.unsmoothed.rate.wrapping_add(step >> 1);
        self.unsmoothed.position = self.unsmoothed.position.wrapping_add(mean_rate.wrapping_mul(TICKS_PER_MS));
        self.unsmoothed.rate = self.unsmoothed.rate.wrapping_add(step);
        // The rounded steps of the last millisecond may have missed the planned rate by a few units.
        self.rate = self.end_rate;
        self.end_rate = self.average.update(self.unsmoothed.rate);
        self.acceleration = self.end_rate.wrapping_sub(self.rate).wrapping_div(TICKS_PER_MS);
        step != wanted
    }

    /// Position command minus the platform's position, counts. The platform is `fraction` counts from a boundary between counts.
    #[inline]
    pub fn position_error(&self, boundary: i32, fraction: f32) -> f32 {
        fixed_to_f32(self.distance_from(boundary)) - fraction
    }

    /// Shifts the position command to within [`Config::max_slip`] of the boundary at the platform. Returns whether it was shifted.
    #[inline]
    pub fn limit_slip(&mut self, boundary: i32, config: &Config) -> bool {
        let distance = self.distance_from(boundary);
        let excess = distance.wrapping_sub(limited(distance, config.max_slip));
        self.position = self.position.wrapping_sub(excess);
        self.unsmoothed.position = self.unsmoothed.position.wrapping_sub(excess);
        excess != 0
    }

    /// Position command minus this boundary, 2⁻³² counts.
    #[inline]
    fn distance_from(&self, boundary: i32) -> i64 {
        self.position.wrapping_sub(i64::from(boundary) << 32)
    }
}

/// `value` limited to ± `limit`. Unlike `clamp`, it cannot panic for a negative limit.
#[inline]
fn limited(value: i64, limit: i64) -> i64 {
    value.max(limit.wrapping_neg()).min(limit)
}

/// Mean of the last [`AVERAGED_MS`] values.
#[derive(Clone, Copy, Debug, Default)]
struct MovingAverage {
    values: [i64; AVERAGED_MS],
    sum: i64,
    next: usize,
}

impl MovingAverage {
    /// All values are this one. In place: a copy of the whole costs the tick 600 instructions.
    fn fill(&mut self, value: i64) {
        self.values.fill(value);
        (self.sum, self.next) = (value << AVERAGED_SHIFT, 0);
    }

    /// Takes the next value; returns the mean.
    #[inline]
    fn update(&mut self, value: i64) -> i64 {
        if let Some(oldest) = self.values.get_mut(self.next) {
            self.sum = self.sum.wrapping_sub(*oldest).wrapping_add(value);
            *oldest = value;
        }
        self.next = (self.next + 1) & (AVERAGED_MS - 1);
        self.sum >> AVERAGED_SHIFT
    }
}
