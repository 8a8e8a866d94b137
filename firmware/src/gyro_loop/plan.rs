//! Plan of a session of cycles.

use super::{Polarity, Pulse, Scales, Shape};
use crate::board::ROW_HZ;
use crate::config::ConfigError;
use core::cell::Cell;

/// Most samples in one pulse, one minute: the sums fit 64 bits.
pub const MAX_PULSE_SAMPLES: u32 = 60_000;

/// Signs of the pulses from cycle to cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sequence {
    /// + − in each cycle.
    PlusMinus,
    /// − + in each.
    MinusPlus,
    /// Alternating: errors odd in the reference cancel in the mean.
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

/// Plan of a session, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Shape of a pulse.
    pub shape: Shape,
    /// The second pulse runs backwards.
    pub reversed: bool,
    /// Signs of the pulses.
    pub sequence: Sequence,
    /// Greatest reference rate, rad/s.
    pub rate_rad_s: f64,
    /// Duration of one pulse, s; see [`Plan::samples`].
    pub duration_s: f64,
    /// Period of vibration or mains of which the duration is made a multiple, s; 0: none.
    pub period_s: f64,
    /// Time with the loop closed before each cycle, s.
    pub rest_s: f64,
    /// Number of cycles.
    pub cycles: u32,
    /// Number of the gyroscope's position, for the result.
    pub position: u8,
}

impl Plan {
    /// Ten cycles of 10 s at 0.05 °/s, alternating signs, for 50 Hz mains.
    pub const DEFAULT: Self = Self {
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
        Self::DEFAULT
    }
}

/// The plan as it is set at the console, number by number.
pub struct PlanSettings {
    /// Shape of a pulse.
    pub shape: Cell<Shape>,
    /// The second pulse runs backwards.
    pub reversed: Cell<bool>,
    /// Signs of the pulses.
    pub sequence: Cell<Sequence>,
    /// Greatest reference rate, rad/s.
    pub rate_rad_s: Cell<f64>,
    /// Duration of one pulse, s.
    pub duration_s: Cell<f64>,
    /// Period of which the duration is a multiple, s.
    pub period_s: Cell<f64>,
    /// Rest before each cycle, s.
    pub rest_s: Cell<f64>,
    /// Number of cycles.
    pub cycles: Cell<f64>,
    /// Number of the position.
    pub position: Cell<f64>,
}

impl Default for PlanSettings {
    fn default() -> Self {
        let plan = Plan::DEFAULT;
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

impl PlanSettings {
    /// The plan with these settings.
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
    /// N: the duration rounded to a multiple of the period (at least one), then to a sample; 0 without a duration.
    pub fn samples(&self) -> u32 {
        let (duration_s, period_s) = (self.duration_s as f32, self.period_s as f32);
        let seconds = if duration_s > 0.0 && period_s > 0.0 { nearest(duration_s / period_s).max(1) as f32 * period_s } else { duration_s };
        nearest(seconds * ROW_HZ as f32)
    }

    /// The pulses of cycle `k`.
    ///
    /// # Errors
    /// The pulse is shorter than a sample or longer than a minute; the rate is less than one step or above the torquer's limit.
    pub fn pulse(&self, k: u32, scales: &Scales) -> Result<Pulse, ConfigError> {
        let samples = self.samples();
        if samples == 0 || samples > MAX_PULSE_SAMPLES {
            return Err(ConfigError::Unfit("duration of a pulse", "must be 1 ms to 60 s"));
        }
        let steps = nearest(self.rate_rad_s as f32 / scales.rad_s_per_step);
        if steps == 0 || steps > scales.max_steps as u32 {
            return Err(ConfigError::Unfit("rate of a pulse", "is less than a step of the torquer, or above its limit"));
        }
        let amplitude = steps as i16 * self.sequence.polarity(k).sign();
        Ok(Pulse { shape: self.shape, reversed: self.reversed, amplitude, samples })
    }
}

/// Rounds to an integer; negative numbers and NaN become 0.
pub(super) fn nearest(value: f32) -> u32 {
    (value + 0.5) as u32
}
