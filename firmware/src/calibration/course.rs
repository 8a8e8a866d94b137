//! The way that a calibration turns: known beforehand, row by row.
//!
//! First until the index must have come, then faster and slowly forwards, slowly and faster backwards: one reversal. Each leg lets the loop
//! settle and then measures over whole turns, so that every angle counts the same.

use crate::board::ROW_HZ;
use crate::config::{ConfigError, within};
use crate::profile::{LEGS, Profile};
use crate::speed_loop::Settings;
use core::f64::consts::TAU;

/// The slow rate, rad/s: the loop follows there what order 14 asks (8 rad/s against poles at 40), so that little is left to correct.
const SLOW_RAD_S: f64 = 0.6;
/// The faster rate, which tells viscous from dry friction, and at which the index is looked for, rad/s.
const FAST_RAD_S: f64 = 3.0;
/// Whole turns of each measured leg.
const TURNS: f64 = 2.0;
/// Turns within which the index must come; the platform begins anywhere.
const SEEK_TURNS: f64 = 1.25;
/// What the loop (poles at 40 rad/s) needs to settle, and then some, s.
const SETTLE_S: f64 = 1.0;
/// The last rows of a leg: in the last the command goes over to the next (see [`crate::profile::ProfileRunner`]), and the one before it ends
/// with the tick that computes the first step of that.
const HAND_OVER_ROWS: u64 = 2;

/// One leg.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Leg {
    /// Rate, with its sign, rad/s.
    pub rate_rad_s: f64,
    /// Whether it is one of the slow ones, whose voltage is mapped.
    pub slow: bool,
    settle_rows: u64,
    rows: u64,
}

impl Leg {
    fn all_rows(&self) -> u64 {
        self.settle_rows + self.rows + HAND_OVER_ROWS
    }
}

/// All legs.
#[derive(Clone, Copy, Debug)]
pub struct Course {
    legs: [Leg; LEGS],
}

impl Course {
    /// The usual course, slower where the stand's overspeed asks for it.
    ///
    /// # Errors
    /// A setting that makes no sense, by name.
    pub fn usual(settings: &Settings) -> Result<Self, ConfigError> {
        let acceleration = within("acceleration_rad_s2", settings.acceleration_rad_s2, 1e-3, 1e5)?;
        let overspeed = within("overspeed_rad_s", settings.overspeed_rad_s, 1e-3, 1e4)?;
        let fast = f64::min(FAST_RAD_S, 0.5 * overspeed);
        let slow = f64::min(SLOW_RAD_S, 0.2 * fast);
        let rows = |seconds: f64| libm::round(seconds * ROW_HZ as f64) as u64;
        let settle_rows = rows(SETTLE_S + 2.0 * fast / acceleration);
        let leg =
            |rate_rad_s: f64, is_slow: bool| Leg { rate_rad_s, slow: is_slow, settle_rows, rows: rows(TURNS * TAU / rate_rad_s.abs()) };
        // The seeking leg has nothing to measure: all of it is settling.
        let seek = Leg { rate_rad_s: fast, slow: false, settle_rows: settle_rows + rows(SEEK_TURNS * TAU / fast), rows: 0 };
        Ok(Self { legs: [seek, leg(fast, false), leg(slow, true), leg(-slow, true), leg(-fast, false)] })
    }

    /// All rows.
    pub fn rows(&self) -> u64 {
        self.legs.iter().map(Leg::all_rows).sum()
    }

    /// Rows after which the index must have come.
    pub fn seek_rows(&self) -> u64 {
        let [seek, ..] = &self.legs;
        seek.settle_rows
    }

    /// The leg whose rate is held and measured in row `k`; `None` while the loop settles.
    pub fn measured(&self, k: u64) -> Option<&Leg> {
        let mut begins = 0;
        for leg in &self.legs {
            let measured = begins + leg.settle_rows;
            if k < begins + leg.all_rows() {
                return (k >= measured && k < measured + leg.rows).then_some(leg);
            }
            begins += leg.all_rows();
        }
        None
    }

    /// What the legs ask for.
    pub fn profile(&self) -> Profile {
        Profile::legs(self.legs.map(|leg| (leg.rate_rad_s, leg.all_rows() as u32)))
    }

    /// Slow and faster rate, rad/s.
    pub fn rates_rad_s(&self) -> (f64, f64) {
        let [_, fast, slow, ..] = &self.legs;
        (slow.rate_rad_s, fast.rate_rad_s)
    }
}
