//! The fastest slope between two levels under an acceleration and a jerk limit.
//!
//! A double-S trajectory of one derivative lower, since the level takes the place of the position: the acceleration rises for
//! [`Slope::corner_s`], stays constant, and falls for the same time. A small step does not reach the acceleration limit and has no constant
//! part. Without a jerk limit the corners have no duration. The slope is symmetric, so its mean is the mean of its ends. L. Biagiotti, C.
//! Melchiorri, Trajectory Planning for Automatic Machines and Robots, §3.4.

use super::ProfileConfig;

/// Limits of a slope.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlopeLimits {
    /// Limit of the change per second.
    acceleration: f64,
    /// Limit of the change of the acceleration per second; infinite: no limit.
    jerk: f64,
}

impl SlopeLimits {
    pub(super) fn straight(c: &ProfileConfig) -> Self {
        Self { acceleration: c.acceleration, jerk: f64::INFINITY }
    }

    pub(super) fn rounded(c: &ProfileConfig) -> Self {
        Self { acceleration: c.acceleration, jerk: c.jerk }
    }

    /// The greatest level of a pulse from zero and back to zero with a given `area` (level × s).
    pub(super) fn greatest_level(&self, area: f64) -> f64 {
        // Below the acceleration limit: 2 v √(v/j) = A; at the limit: v (v/a + a/j) = A.
        let rounded = libm::cbrt(0.25 * area * area * self.jerk);
        let corner = self.acceleration / self.jerk;
        if rounded * self.jerk <= self.acceleration * self.acceleration {
            return rounded;
        }
        let half = 0.5 * self.acceleration * corner;
        libm::sqrt(half * half + self.acceleration * area) - half
    }
}

/// A slope between two levels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    from: f64,
    /// Level at its end.
    pub(super) to: f64,
    /// Signed acceleration in the middle.
    acceleration: f64,
    corner_s: f64,
    /// Duration, s.
    pub(super) length_s: f64,
}

impl Slope {
    pub(super) fn new(from: f64, to: f64, limits: &SlopeLimits) -> Self {
        let rise = (to - from).abs();
        let (corner_s, greatest) = if rise * limits.jerk < limits.acceleration * limits.acceleration {
            let corner_s = libm::sqrt(rise / limits.jerk);
            (corner_s, limits.jerk * corner_s)
        } else {
            (limits.acceleration / limits.jerk, limits.acceleration)
        };
        let length_s = if greatest > 0.0 { rise / greatest + corner_s } else { 0.0 };
        Self { from, to, acceleration: libm::copysign(greatest, to - from), corner_s, length_s }
    }

    /// The level at `t_s` after the start.
    pub(super) fn level(&self, t_s: f64) -> f64 {
        let left_s = self.length_s - t_s;
        if left_s <= 0.0 {
            self.to
        } else if t_s <= 0.0 {
            self.from
        } else if t_s < self.corner_s {
            self.from + 0.5 * self.acceleration * t_s * t_s / self.corner_s
        } else if left_s < self.corner_s {
            self.to - 0.5 * self.acceleration * left_s * left_s / self.corner_s
        } else {
            self.from + self.acceleration * (t_s - 0.5 * self.corner_s)
        }
    }

    /// The area under the slope from the start to `t_s`; the last level continues after the end, and the area before the start is zero.
    pub(super) fn area(&self, t_s: f64) -> f64 {
        let (a, corner_s, left_s) = (self.acceleration, self.corner_s, self.length_s - t_s);
        let rise = self.to - self.from;
        if t_s <= 0.0 {
            return 0.0;
        }
        self.from * t_s
            + if left_s <= 0.0 {
                rise * (t_s - 0.5 * self.length_s)
            } else if t_s < corner_s {
                a * t_s * t_s * t_s / (6.0 * corner_s)
            } else if left_s < corner_s {
                rise * (t_s - 0.5 * self.length_s) + a * left_s * left_s * left_s / (6.0 * corner_s)
            } else {
                let straight_s = t_s - 0.5 * corner_s;
                0.5 * a * straight_s * straight_s + a * corner_s * corner_s / 24.0
            }
    }
}
