//! Trajectory of a calibration, row by row.
//!
//! First a leg to find the index, then fast forward, slow forward, slow backward, fast backward: one reversal. Each leg waits for the loop
//! to settle and then measures over whole turns, so that all angles have the same weight.

use crate::board::ROW_HZ;
use crate::config::{ConfigError, within};
use crate::profile::{LEGS, Profile};
use crate::speed_loop::Settings;
use core::f64::consts::TAU;

/// Slow rate, rad/s: harmonics up to order 14 (8 rad/s) are within the loop's bandwidth, so that little correction is needed.
const SLOW_RAD_S: f64 = 0.6;
/// Fast rate, rad/s: separates viscous from Coulomb friction; also the rate at which the index is searched.
const FAST_RAD_S: f64 = 3.0;
/// Whole turns of each measured leg.
const TURNS: f64 = 2.0;
/// Turns within which the index must come from any initial angle.
const SEARCH_TURNS: f64 = 1.25;
/// Settling time of the loop, with a margin, s.
const SETTLE_S: f64 = 1.0;
/// Rows at the end of a leg in which the command changes to the next leg (see [`crate::profile::ProfileRunner`]).
const TRANSITION_ROWS: u64 = 2;

/// One leg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leg {
    /// Signed rate, rad/s.
    pub rate_rad_s: f64,
    /// Whether it is a slow leg, whose voltage is mapped.
    pub is_slow: bool,
    settle_rows: u64,
    measured_rows: u64,
}

impl Leg {
    fn rows(&self) -> u64 {
        self.settle_rows + self.measured_rows + TRANSITION_ROWS
    }
}

/// Trajectory of a calibration.
#[derive(Clone, Copy, Debug)]
pub struct Trajectory {
    legs: [Leg; LEGS],
}

impl Trajectory {
    /// The trajectory for these settings, at most half as fast as the overspeed limit.
    ///
    /// # Errors
    /// A setting is out of its range: its name.
    pub fn new(settings: &Settings) -> Result<Self, ConfigError> {
        let acceleration = within("acceleration_rad_s2", settings.acceleration_rad_s2, 1e-3, 1e5)?;
        let overspeed = within("overspeed_rad_s", settings.overspeed_rad_s, 1e-3, 1e4)?;
        let fast = f64::min(FAST_RAD_S, 0.5 * overspeed);
        let slow = f64::min(SLOW_RAD_S, 0.2 * fast);
        let rows = |seconds: f64| libm::round(seconds * ROW_HZ as f64) as u64;
        let settle_rows = rows(SETTLE_S + 2.0 * fast / acceleration);
        let leg =
            |rate_rad_s: f64, is_slow: bool| Leg { rate_rad_s, is_slow, settle_rows, measured_rows: rows(TURNS * TAU / rate_rad_s.abs()) };
        // The search leg measures nothing.
        let search = Leg { rate_rad_s: fast, is_slow: false, settle_rows: settle_rows + rows(SEARCH_TURNS * TAU / fast), measured_rows: 0 };
        Ok(Self { legs: [search, leg(fast, false), leg(slow, true), leg(-slow, true), leg(-fast, false)] })
    }

    /// Number of rows.
    pub fn rows(&self) -> u64 {
        self.legs.iter().map(Leg::rows).sum()
    }

    /// Rows after which the index must have come.
    pub fn search_rows(&self) -> u64 {
        let [search, ..] = &self.legs;
        search.settle_rows
    }

    /// The leg that is measured in row `k`; `None` while the loop settles.
    pub fn measured_leg(&self, k: u64) -> Option<&Leg> {
        let mut start = 0;
        for leg in &self.legs {
            let measured = start + leg.settle_rows;
            if k < start + leg.rows() {
                return (k >= measured && k < measured + leg.measured_rows).then_some(leg);
            }
            start += leg.rows();
        }
        None
    }

    /// The command profile.
    pub fn profile(&self) -> Profile {
        Profile::legs(self.legs.map(|leg| (leg.rate_rad_s, leg.rows() as u32)))
    }

    /// Slow and fast rate, rad/s.
    pub fn rates_rad_s(&self) -> (f64, f64) {
        let [_, fast, slow, ..] = &self.legs;
        (slow.rate_rad_s, fast.rate_rad_s)
    }
}
