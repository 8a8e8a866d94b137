//! Ramp: the command as an integrated position in integers, so that the mean rate is as accurate as the crystal.
//!
//! In, once in a millisecond: the rate to be reached at its end. Out, each tick: position and rate command in fixed point (2⁻³² counts,
//! 2⁻³² counts per tick; whole counts wrap with the counter's). The rate follows its target under the acceleration limit and is then averaged
//! over [`AVERAGED_MS`] milliseconds, so that the acceleration, and with it the voltage, changes in small steps, at the beginnings of the
//! log's rows only. Within a millisecond the rate is linear and the position is its exact trapezoid.

use super::segment::fixed_to_f32;
use crate::board::CONTROL_PER_ROW;

/// Milliseconds over which the rate command is averaged: the time in which the acceleration rises to its limit.
pub const AVERAGED_MS: usize = 1 << AVERAGED_SHIFT;
const AVERAGED_SHIFT: u32 = 5;
const TICKS_PER_MS: i64 = CONTROL_PER_ROW as i64;

/// Limits of the ramp.
#[derive(Clone, Copy, Debug)]
pub(super) struct Config {
    /// Change of the rate in a millisecond, 2⁻³² counts per tick.
    pub acceleration: i64,
    /// Greatest distance from the platform, 2⁻³² counts.
    pub slip: i64,
}

/// The ramp at one tick.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ramp {
    /// Position command, 2⁻³² counts.
    pub position: i64,
    /// Rate command, 2⁻³² counts per tick.
    pub rate: i64,
    /// Its change per tick.
    pub acceleration: i64,
    /// Rate at the end of the millisecond under way.
    end_rate: i64,
    unsmoothed: Unsmoothed,
    average: MovingAverage,
}

/// The command at the end of the millisecond under way, before it is smoothed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Unsmoothed {
    pub rate: i64,
    pub position: i64,
}

impl Ramp {
    /// Starts at this position and with this rate.
    pub fn start(&mut self, position: i64, rate: i64) {
        *self = Self {
            position,
            rate,
            acceleration: 0,
            end_rate: rate,
            unsmoothed: Unsmoothed { rate, position },
            average: MovingAverage::filled_with(rate),
        };
    }

    /// The command before it is smoothed, for the approach to an angle.
    pub fn unsmoothed(&self) -> Unsmoothed {
        self.unsmoothed
    }

    /// One tick further.
    #[inline]
    pub fn advance(&mut self) {
        self.position = self.position.wrapping_add(self.rate).wrapping_add(self.acceleration >> 1);
        self.rate = self.rate.wrapping_add(self.acceleration);
    }

    /// At the beginning of a millisecond: plans it towards the rate `target`. Returns whether the acceleration limit is in force.
    #[inline]
    pub fn plan_millisecond(&mut self, target: i64, config: &Config) -> bool {
        let wanted = target.wrapping_sub(self.unsmoothed.rate);
        // Not `clamp`: it panics if its limits are exchanged.
        let step = wanted.max(config.acceleration.wrapping_neg()).min(config.acceleration);
        let mean_rate = self.unsmoothed.rate.wrapping_add(step >> 1);
        self.unsmoothed.position = self.unsmoothed.position.wrapping_add(mean_rate.wrapping_mul(TICKS_PER_MS));
        self.unsmoothed.rate = self.unsmoothed.rate.wrapping_add(step);
        // Exactly the planned rate: ten rounded steps may have missed it by a few units.
        self.rate = self.end_rate;
        self.end_rate = self.average.update(self.unsmoothed.rate);
        self.acceleration = self.end_rate.wrapping_sub(self.rate).wrapping_div(TICKS_PER_MS);
        step != wanted
    }

    /// Position command minus the platform's position (a boundary and a fraction of a count), counts.
    #[inline]
    pub fn position_error(&self, boundary: i32, fraction: f32) -> f32 {
        fixed_to_f32(self.distance_from(boundary)) - fraction
    }

    /// Keeps the position command within the slip of the platform. Returns whether it slipped.
    #[inline]
    pub fn slip(&mut self, boundary: i32, config: &Config) -> bool {
        let distance = self.distance_from(boundary);
        let excess = distance.wrapping_sub(distance.max(config.slip.wrapping_neg()).min(config.slip));
        self.position = self.position.wrapping_sub(excess);
        self.unsmoothed.position = self.unsmoothed.position.wrapping_sub(excess);
        excess != 0
    }

    #[inline]
    fn distance_from(&self, boundary: i32) -> i64 {
        self.position.wrapping_sub(i64::from(boundary) << 32)
    }
}

/// Mean of the last [`AVERAGED_MS`] values.
#[derive(Clone, Copy, Debug, Default)]
struct MovingAverage {
    values: [i64; AVERAGED_MS],
    sum: i64,
    next: usize,
}

impl MovingAverage {
    fn filled_with(value: i64) -> Self {
        Self { values: [value; AVERAGED_MS], sum: value << AVERAGED_SHIFT, next: 0 }
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
