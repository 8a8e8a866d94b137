//! One cycle: exact sums, and their conversion to drift rates.

use super::{Scales, Sums};
use crate::board::{ROW_HZ, Ticks};
use crate::status::Fault;

/// Sign of the first pulse.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Polarity {
    /// +, then −.
    #[default]
    PlusMinus,
    /// −, then +.
    MinusPlus,
    /// No pulse: the offsets of integrator and current.
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

/// Reason to reject a cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rejection {
    /// Accepted.
    #[default]
    None,
    /// The angle sensor was at its limit, or its wire is broken.
    Saturated,
    /// The torquer's current did not follow its command.
    Limited,
    /// A sample was lost or came late.
    SampleLost,
    /// No angle sensor, or no sample from it.
    Silent,
    /// Aborted by command.
    Aborted,
    /// A fault switched the stand off.
    Fault(Fault),
}

impl Rejection {
    /// The reason in a few words, for replies.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "good",
            Self::Saturated => "angle sensor saturated",
            Self::Limited => "current limited",
            Self::SampleLost => "sample lost",
            Self::Silent => "no angle sensor",
            Self::Aborted => "aborted",
            Self::Fault(fault) => fault.name(),
        }
    }

    /// Whether the session ends, too.
    pub fn ends_session(self) -> bool {
        matches!(self, Self::Silent | Self::Aborted | Self::Fault(_))
    }
}

/// A finished cycle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cycle {
    /// Number since power-on, from 1.
    pub number: u32,
    /// Number of the gyroscope's position, as set at the console.
    pub position: u8,
    /// Sign of the first pulse.
    pub polarity: Polarity,
    /// N: samples in one pulse.
    pub samples: u32,
    /// Start of the first pulse.
    pub start: Ticks,
    /// The sums; of a rejected cycle up to the rejection.
    pub sums: Sums,
    /// Current during the lead: sum of the codes, and number of conversions.
    pub rest_current: (i64, u32),
    /// Reason of rejection, if any.
    pub rejection: Rejection,
}

impl Cycle {
    /// Drift rate by (13), ω = −ACC2·LSB·Δt/(2 T²), rad/s. `zero_input`: sums of the zero-input cycle of the same length.
    pub fn raw_rad_s(&self, scales: &Scales, zero_input: Option<&Sums>) -> f32 {
        let acc2 = self.sums.acc2.wrapping_sub(zero_input.map_or(0, |sums| sums.acc2));
        -(acc2 as f32) * scales.rad_per_code * ROW_HZ as f32 / self.weights()
    }

    /// (K_m/H) ∫ W i du: rate by which the two pulses differ, from the measured current minus the current at rest (of the zero-input cycle,
    /// else of the lead), rad/s.
    pub fn residual_rad_s(&self, scales: &Scales, zero_input: Option<&Sums>) -> f32 {
        let conversions = self.sums.conversions as f32;
        let at_rest = match (zero_input, self.rest_current) {
            (Some(sums), _) => sums.current as f32 / self.weights(),
            (None, (codes, count)) => codes as f32 / count as f32 * conversions,
        };
        let residual = (self.sums.current as f32 / self.weights() - at_rest) / conversions * scales.rad_s_per_code;
        // Not finite without a conversion.
        if residual.is_finite() { residual } else { 0.0 }
    }

    /// Σ wₙ = 2 N².
    fn weights(&self) -> f32 {
        let n = self.samples as f32;
        2.0 * n * n
    }

    /// Drift rate corrected by the current, rad/s.
    pub fn rate_rad_s(&self, scales: &Scales, zero_input: Option<&Sums>) -> f32 {
        self.raw_rad_s(scales, zero_input) - self.residual_rad_s(scales, zero_input)
    }
}
