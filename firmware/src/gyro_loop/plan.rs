//! What a session of cycles is to be.

use super::{Polarity, Pulse, Scales, Shape};
use crate::board::ROW_HZ;
use crate::config::ConfigError;
use core::cell::Cell;

/// Most samples in one pulse: a minute. The sums hold it.
pub const MOST_ROWS: u32 = 60_000;

/// The order of the pulses' signs from cycle to cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sequence {
    /// + − in each cycle.
    PlusMinus,
    /// − + in each.
    MinusPlus,
    /// By turns: what is odd in the reference cancels from their mean.
    #[default]
    Both,
}

impl Sequence {
    /// The polarity of cycle `k` of a session.
    pub fn polarity(self, k: u32) -> Polarity {
        match self {
            Self::PlusMinus => Polarity::PlusMinus,
            Self::MinusPlus => Polarity::MinusPlus,
            Self::Both if k & 1 == 0 => Polarity::PlusMinus,
            Self::Both => Polarity::MinusPlus,
        }
    }
}

/// A session, in a person's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// What a pulse looks like.
    pub shape: Shape,
    /// The second pulse runs backwards.
    pub reversed: bool,
    /// The signs.
    pub sequence: Sequence,
    /// Greatest reference rate, rad/s.
    pub rate_rad_s: f64,
    /// Duration of one pulse as it is asked for, s.
    pub duration_s: f64,
    /// Period of the vibration or the mains of which it is to be a multiple, s; 0: none.
    pub period_s: f64,
    /// Time with the loop closed before each cycle, s.
    pub rest_s: f64,
    /// How many cycles.
    pub cycles: u32,
    /// The position's number, for the result.
    pub position: u8,
}

impl Plan {
    /// Ten cycles of 10 s at 0.05 °/s, both ways, by 50 Hz mains.
    pub const USUAL: Self = Self {
        shape: Shape::Rectangular,
        reversed: false,
        sequence: Sequence::Both,
        rate_rad_s: 0.05 * core::f64::consts::PI / 180.0,
        duration_s: 5.0,
        period_s: 0.02,
        rest_s: 4.0,
        cycles: 10,
        position: 1,
    };
}

impl Default for Plan {
    fn default() -> Self {
        Self::USUAL
    }
}

/// The plan as a person sets it, number by number.
pub struct Asked {
    /// What a pulse looks like.
    pub shape: Cell<Shape>,
    /// The second pulse runs backwards.
    pub reversed: Cell<bool>,
    /// The signs.
    pub sequence: Cell<Sequence>,
    /// Greatest reference rate, rad/s.
    pub rate_rad_s: Cell<f64>,
    /// Duration of one pulse, s.
    pub duration_s: Cell<f64>,
    /// Period of which it is a multiple, s.
    pub period_s: Cell<f64>,
    /// Rest before each cycle, s.
    pub rest_s: Cell<f64>,
    /// How many cycles.
    pub cycles: Cell<f64>,
    /// The position's number.
    pub position: Cell<f64>,
}

impl Default for Asked {
    fn default() -> Self {
        let plan = Plan::USUAL;
        Self {
            shape: Cell::new(plan.shape),
            reversed: Cell::new(plan.reversed),
            sequence: Cell::new(plan.sequence),
            rate_rad_s: Cell::new(plan.rate_rad_s),
            duration_s: Cell::new(plan.duration_s),
            period_s: Cell::new(plan.period_s),
            rest_s: Cell::new(plan.rest_s),
            cycles: Cell::new(f64::from(plan.cycles)),
            position: Cell::new(1.0),
        }
    }
}

impl Asked {
    /// All of it together.
    pub fn plan(&self) -> Plan {
        Plan {
            shape: self.shape.get(),
            reversed: self.reversed.get(),
            sequence: self.sequence.get(),
            rate_rad_s: self.rate_rad_s.get(),
            duration_s: self.duration_s.get(),
            period_s: self.period_s.get(),
            rest_s: self.rest_s.get(),
            cycles: nearest(self.cycles.get() as f32),
            position: nearest(self.position.get() as f32) as u8,
        }
    }
}

impl Plan {
    /// N: the duration to the nearest multiple of the period, at least one of it, to the nearest sample; 0 where there is no duration.
    pub fn samples(&self) -> u32 {
        let (duration_s, period_s) = (self.duration_s as f32, self.period_s as f32);
        let seconds = if duration_s > 0.0 && period_s > 0.0 { nearest(duration_s / period_s).max(1) as f32 * period_s } else { duration_s };
        nearest(seconds * ROW_HZ as f32)
    }

    /// The pulses of cycle `k`.
    ///
    /// # Errors
    /// A pulse of no length or of more than a minute; a reference that is no step, or more than the torquer is given.
    pub fn pulse(&self, k: u32, scales: &Scales) -> Result<Pulse, ConfigError> {
        let samples = self.samples();
        if samples == 0 || samples > MOST_ROWS {
            return Err(ConfigError::Unfit("duration of a pulse", "must be 1 ms to 60 s"));
        }
        let steps = nearest(self.rate_rad_s as f32 / scales.rad_s_per_step);
        if steps == 0 || steps > scales.most_steps as u32 {
            return Err(ConfigError::Unfit("rate of a pulse", "is less than a step of the torquer, or above its limit"));
        }
        let amplitude = steps as i16 * self.sequence.polarity(k).sign();
        Ok(Pulse { shape: self.shape, reversed: self.reversed, amplitude, samples })
    }
}

/// To the nearest whole number. A cast saturates; no number, and less than none, become none.
pub(super) fn nearest(value: f32) -> u32 {
    (value + 0.5) as u32
}
