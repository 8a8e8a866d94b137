//! The crystal of the controller with its frequency error, and a second clock: a reference with one pulse per second (1PPS).
//!
//! The plant lives in true time; the controller counts the periods of its crystal. [`Crystal`] converts between both. The times of
//! [`ReferencePulses`] are true times with the reference's own error and jitter.

use super::Noise;
use serde::{Deserialize, Serialize};

/// Stream of the jitter within a seed.
const JITTER_STREAM: u32 = 40;

/// Crystal and reference of a stand, `[clock]` in its file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ClockSetup {
    /// Relative frequency error of the crystal, ppm; positive: fast.
    pub crystal_ppm: f64,
    /// The reference at the input, if one is connected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reference: Option<ReferenceSetup>,
}

/// A reference with one pulse per second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReferenceSetup {
    /// Jitter of a pulse, s rms.
    pub jitter_s: f64,
    /// Relative frequency error, ppm; positive: fast.
    pub error_ppm: f64,
}

impl Default for ReferenceSetup {
    fn default() -> Self {
        Self { jitter_s: 20e-9, error_ppm: 0.0 } // typical of a GNSS timing receiver with a clear sky
    }
}

impl ClockSetup {
    /// Whether the stand has an ideal crystal and no reference.
    pub fn is_default(&self) -> bool {
        *self == Self::default()
    }

    /// The values of a file with their keys and permitted ranges.
    pub fn values(&self) -> impl Iterator<Item = (&'static str, f64, (f64, f64))> {
        let reference = self.reference.into_iter().flat_map(|reference| {
            [("clock.reference.jitter_s", reference.jitter_s, (0.0, 1e-3)), ("clock.reference.error_ppm", reference.error_ppm, (-1e4, 1e4))]
        });
        std::iter::once(("clock.crystal_ppm", self.crystal_ppm, (-1e4, 1e4))).chain(reference)
    }
}

/// Time by the crystal and true time.
#[derive(Clone, Copy, Debug)]
pub struct Crystal {
    /// Frequency over nominal frequency.
    relative_frequency: f64,
}

impl Crystal {
    /// The crystal of a stand.
    pub fn new(setup: &ClockSetup) -> Self {
        Self { relative_frequency: 1.0 + setup.crystal_ppm * 1e-6 }
    }

    /// True time in which the crystal counts `counted_s`.
    #[inline]
    pub fn true_s(self, counted_s: f64) -> f64 {
        counted_s / self.relative_frequency
    }

    /// Time that the crystal counts in the true time `true_s`.
    #[inline]
    pub fn counted_s(self, true_s: f64) -> f64 {
        true_s * self.relative_frequency
    }
}

/// The pulses of a reference.
#[derive(Clone, Debug)]
pub struct ReferencePulses {
    interval_s: f64,
    /// True time of pulse 0 without jitter.
    first_s: f64,
    number: u64,
    jitter: Noise,
    next_s: f64,
}

impl ReferencePulses {
    /// The pulses of this reference; `seed` of their phase and jitter.
    pub fn new(setup: &ReferenceSetup, seed: u64) -> Self {
        let mut jitter = Noise::new(seed, JITTER_STREAM, setup.jitter_s);
        let first_s = 0.5 + jitter.uniform(0.4);
        let next_s = first_s + jitter.draw();
        Self { interval_s: 1.0 / (1.0 + setup.error_ppm * 1e-6), first_s, number: 0, jitter, next_s }
    }

    /// True time of the next pulse, s since power-on.
    pub fn next_s(&self) -> f64 {
        self.next_s
    }

    /// The last pulse up to the true time `now_s`, if one came since the last call.
    #[inline]
    pub fn pass(&mut self, now_s: f64) -> Option<f64> {
        let mut passed = None;
        while self.next_s <= now_s {
            passed = Some(self.next_s);
            self.number += 1;
            self.next_s = self.first_s + self.number as f64 * self.interval_s + self.jitter.draw();
        }
        passed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_come_each_second_with_their_jitter() {
        let setup = ReferenceSetup { jitter_s: 1e-6, error_ppm: 5.0 };
        let mut pulses = ReferencePulses::new(&setup, 3);
        let times: Vec<f64> = (0..200_000).filter_map(|k| pulses.pass(f64::from(k) * 1e-2)).collect();
        assert!((1999..=2000).contains(&times.len()));
        let mean_s = (times[times.len() - 1] - times[0]) / (times.len() - 1) as f64;
        assert!((mean_s - (1.0 - 5e-6)).abs() < 1e-8, "{mean_s}");
        let rms_s = (times.windows(2).map(|t| (t[1] - t[0] - mean_s).powi(2)).sum::<f64>() / (times.len() - 1) as f64).sqrt();
        assert!((rms_s / (2_f64.sqrt() * 1e-6) - 1.0).abs() < 0.1, "{rms_s}");
    }

    #[test]
    fn an_ideal_crystal_changes_no_bit_of_a_time() {
        let crystal = Crystal::new(&ClockSetup::default());
        assert_eq!((crystal.true_s(0.1), crystal.counted_s(0.7)), (0.1, 0.7));
        let fast = Crystal::new(&ClockSetup { crystal_ppm: 40.0, reference: None });
        assert!(fast.counted_s(1.0) > 1.0 && (fast.true_s(fast.counted_s(3.0)) - 3.0).abs() < 1e-15);
    }
}
