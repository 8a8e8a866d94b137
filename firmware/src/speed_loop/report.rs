//! Report of the interrupt to the tasks, one each millisecond; the newest wins.
//!
//! Quantities that must not be lost between two reports only grow: the sum of the duty over all ticks, and for each limit the number of
//! milliseconds in which it was in force.

use super::ONE;
use super::feed_forward::Compensating;
use super::segment::Mode;
use crate::status::{Fault, Limits};

/// State of the speed loop at the beginning of tick `tick`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Report {
    /// Number of the tick.
    pub tick: u64,
    /// Sum of the compare counts over all ticks before this one, wrapping: see [`Report::duty_since`].
    pub duty_sum: i32,
    /// Sum of `duty_sum` over all ticks up to this one, wrapping: see [`Report::duty_slope_since`].
    pub duty_moment: i32,
    /// Position command at this tick, 2⁻³² counts from the counter's zero, whole counts wrapping; valid in rate and position mode.
    pub position_command: i64,
    /// Rate command at this tick, 2⁻³² counts per tick; valid in rate and position mode.
    pub rate_command: i64,
    /// Rate by the encoder's edges, counts per tick; since the last edge at most one count in its age.
    pub rate: f32,
    /// Age of `rate`: steps of the edge timer since the last edge, at most 2³⁰.
    pub edge_age: u32,
    /// Mode during this tick.
    pub mode: Mode,
    /// Active parts of the compensation.
    pub compensating: Compensating,
    /// The latched fault.
    pub fault: Fault,
    /// The limits that were in force within the last millisecond.
    pub limits: Limits,
    /// For each limit, the number of milliseconds in which it was in force since power-on, wrapping.
    pub limited_ms: [u32; Limits::COUNT],
}

impl Report {
    /// The limits that were in force at some time after `earlier`.
    pub fn limits_since(&self, earlier: &Report) -> Limits {
        let pairs = self.limited_ms.iter().zip(&earlier.limited_ms).enumerate();
        Limits(pairs.fold(0, |flags, (bit, (now, then))| if now == then { flags } else { flags | 1 << bit }))
    }

    /// Sum of the compare counts over the ticks from `earlier` to this one; valid up to 47 s.
    pub fn duty_since(&self, earlier: &Report) -> i32 {
        self.duty_sum.wrapping_sub(earlier.duty_sum)
    }

    /// Slope of the compare counts over the ticks from `earlier` to this one: the straight line with the same mean and the same first
    /// moment ends that much above its mean. Zero without a tick between the reports.
    pub fn duty_slope_since(&self, earlier: &Report) -> f64 {
        let ticks = self.tick.wrapping_sub(earlier.tick);
        if ticks == 0 {
            return 0.0;
        }
        let n = ticks as f64;
        // The duty of the tick that is k ticks before this one counts k times.
        let before = self.duty_moment.wrapping_sub(earlier.duty_moment).wrapping_sub(earlier.duty_sum.wrapping_mul(ticks as i32));
        let moment = f64::from(self.duty_since(earlier)) * (n + 1.0) - 2.0 * f64::from(before);
        3.0 * moment / (n * n)
    }

    /// The position command in counts from the counter's zero, unwrapped: the value nearest to `near_counts`.
    pub fn position_command_counts(&self, near_counts: i64) -> f64 {
        let whole = (self.position_command >> 32) as i32;
        let ahead = whole.wrapping_sub(near_counts as i32);
        near_counts.wrapping_add(i64::from(ahead)) as f64 + f64::from(self.position_command as u32) / ONE
    }
}
