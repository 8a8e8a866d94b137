//! From one level to another under an acceleration and a jerk limit, as fast as these allow.
//!
//! Seven-segment motion without its middle (the level is what moves, not the position): the change per second rises for
//! [`Slope::corner_s`], stays, falls for as long. Where the way is too short for the full acceleration the stay falls out.
//! Without a jerk limit the corners have no length. Symmetric about its middle, so its mean is the mean of its ends.
//! L. Biagiotti, C. Melchiorri, Trajectory Planning for Automatic Machines and Robots, §3.4 ("double S", one derivative lower).

use super::ProfileConfig;
use crate::maths;

/// What holds a slope back.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Hold {
    /// Change per second.
    acceleration: f64,
    /// Change of that per second; infinite: no limit.
    jerk: f64,
}

impl Hold {
    pub(super) fn straight(c: &ProfileConfig) -> Self {
        Self { acceleration: c.acceleration, jerk: f64::INFINITY }
    }

    pub(super) fn rounded(c: &ProfileConfig) -> Self {
        Self { acceleration: c.acceleration, jerk: c.jerk }
    }

    /// The greatest level from which one can come, from zero up and to zero down again, with an `area` (level × s) under the way.
    pub(super) fn greatest_within(&self, area: f64) -> f64 {
        // Without full acceleration: 2 v √(v/j) = A; with it: v (v/a + a/j) = A.
        let rounded = maths::cube_root(0.25 * area * area * self.jerk);
        let corner = self.acceleration / self.jerk;
        if rounded * self.jerk <= self.acceleration * self.acceleration {
            return rounded;
        }
        let half = 0.5 * self.acceleration * corner;
        crate::maths::sqrt(half * half + self.acceleration * area) - half
    }
}

/// The way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slope {
    from: f64,
    /// Where it ends.
    pub(super) to: f64,
    /// Change per second in the middle, with its sign.
    acceleration: f64,
    corner_s: f64,
    /// From the first to the last moment, s.
    pub(super) length_s: f64,
}

impl Slope {
    pub(super) fn new(from: f64, to: f64, hold: &Hold) -> Self {
        let way = (to - from).abs();
        let (corner_s, greatest) = if way * hold.jerk < hold.acceleration * hold.acceleration {
            let corner_s = crate::maths::sqrt(way / hold.jerk);
            (corner_s, hold.jerk * corner_s)
        } else {
            (hold.acceleration / hold.jerk, hold.acceleration)
        };
        let length_s = if greatest > 0.0 { way / greatest + corner_s } else { 0.0 };
        Self { from, to, acceleration: libm::copysign(greatest, to - from), corner_s, length_s }
    }

    /// The level `t_s` after the beginning.
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

    /// The area under the levels from the beginning to `t_s`; past the end the last level goes on, before the beginning is nothing.
    pub(super) fn area(&self, t_s: f64) -> f64 {
        let (a, corner_s, left_s) = (self.acceleration, self.corner_s, self.length_s - t_s);
        let way = self.to - self.from;
        if t_s <= 0.0 {
            return 0.0;
        }
        self.from * t_s
            + if left_s <= 0.0 {
                way * (t_s - 0.5 * self.length_s)
            } else if t_s < corner_s {
                a * t_s * t_s * t_s / (6.0 * corner_s)
            } else if left_s < corner_s {
                way * (t_s - 0.5 * self.length_s) + a * left_s * left_s * left_s / (6.0 * corner_s)
            } else {
                let straight_s = t_s - 0.5 * corner_s;
                0.5 * a * straight_s * straight_s + a * corner_s * corner_s / 24.0
            }
    }
}
