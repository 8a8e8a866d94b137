//! One cycle as it is told: exact sums, and what they are in rad/s.

use super::{Scales, Sums};
use crate::board::{ROW_HZ, Ticks};
use crate::status::Fault;

/// Which pulse comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polarity {
    /// +, then −.
    #[default]
    PlusMinus,
    /// −, then +.
    MinusPlus,
    /// No pulse: what integrator and current show by themselves.
    Zero,
}

impl Polarity {
    /// 1, −1 or 0.
    pub fn sign(self) -> i16 {
        match self {
            Self::PlusMinus => 1,
            Self::MinusPlus => -1,
            Self::Zero => 0,
        }
    }
}

/// Why a cycle counts for nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bad {
    /// It is good.
    #[default]
    No,
    /// The angle sensor showed its end, or its wire is off.
    Saturated,
    /// The torquer's current was another than it was given.
    Limited,
    /// A sample was lost or came late.
    SampleLost,
    /// The board has no gyro, or it gives no sample.
    Silent,
    /// Somebody ended it.
    Aborted,
    /// The stand was switched off by a fault.
    Fault(Fault),
}

impl Bad {
    /// The reason in a few words.
    pub fn name(self) -> &'static str {
        match self {
            Self::No => "good",
            Self::Saturated => "angle sensor saturated",
            Self::Limited => "current limited",
            Self::SampleLost => "sample lost",
            Self::Silent => "no angle sensor",
            Self::Aborted => "aborted",
            Self::Fault(fault) => fault.name(),
        }
    }

    /// Whether the session ends with it.
    pub fn ends_session(self) -> bool {
        matches!(self, Self::Silent | Self::Aborted | Self::Fault(_))
    }
}

/// A cycle that is over.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle {
    /// Its number since power-on, from 1.
    pub number: u32,
    /// The position that it was measured in, as the console was told.
    pub position: u8,
    /// Which pulse came first.
    pub polarity: Polarity,
    /// N: samples in one pulse.
    pub samples: u32,
    /// When its first pulse began.
    pub at: Ticks,
    /// Its sums; of a bad cycle as far as it came.
    pub sums: Sums,
    /// Sum of the current's codes while the loop was open and nothing was given, and over how many conversions.
    pub rest_current: (i64, u32),
    /// Whether it counts.
    pub bad: Bad,
}

impl Cycle {
    /// Drift rate by (13), ω = −ACC2·LSB·Δt/(2 T²), rad/s; `null` is the zero-input cycle of as many samples, where one is kept.
    pub fn raw_rad_s(&self, scales: &Scales, null: Option<&Sums>) -> f32 {
        let acc2 = self.sums.acc2.wrapping_sub(null.map_or(0, |null| null.acc2));
        -(acc2 as f32) * scales.rad_per_code * ROW_HZ as f32 / self.weights()
    }

    /// (K_m/H) ∫ W i du: what the pulses were not equal by, from the measured current, rad/s. The current at rest is taken off: of the zero-input
    /// cycle, else of the lead before the pulses.
    pub fn residual_rad_s(&self, scales: &Scales, null: Option<&Sums>) -> f32 {
        let conversions = self.sums.conversions as f32;
        let at_rest = match (null, self.rest_current) {
            (Some(null), _) => null.current as f32 / self.weights(),
            (None, (codes, count)) => codes as f32 / count as f32 * conversions,
        };
        let off = (self.sums.current as f32 / self.weights() - at_rest) / conversions * scales.rad_s_per_code;
        // Where nothing was converted there is no number.
        if off.is_finite() { off } else { 0.0 }
    }

    /// Σ wₙ = 2 N².
    fn weights(&self) -> f32 {
        let n = self.samples as f32;
        2.0 * n * n
    }

    /// The drift rate without that residual, rad/s.
    pub fn rate_rad_s(&self, scales: &Scales, null: Option<&Sums>) -> f32 {
        self.raw_rad_s(scales, null) - self.residual_rad_s(scales, null)
    }
}
