//! Frequency of the crystal by a second clock: a reference with one pulse per second (1PPS).
//!
//! In: the captured times of its pulses, in steps of the edge timer, whose clock is the crystal's. Out: [`ClockReading`]: steps of the
//! timer in a whole number of seconds of the reference. A pulse comes a whole number of seconds after the one before; after a missing pulse
//! that number is larger. An edge at another time is rejected and counted. Two rejected edges a whole number of seconds apart, with no
//! pulse between them, are pulses of another phase (the reference was switched on or the first edge was interference): the measurement
//! restarts with them.

use crate::board::EdgeTime;

/// Relative frequency error up to which an interval is a whole number of seconds, as its inverse: 200 ppm.
const MAX_FREQUENCY_ERROR_PART: u32 = 5_000;
/// Largest deviation of an interval from the one before, as parts of a second and of the interval: 2 µs for jitter, 10 ppm for a crystal
/// that warms.
const MAX_DEVIATION_PART: u32 = 500_000;
const MAX_FREQUENCY_CHANGE_PART: u32 = 100_000;
/// Longest interval between two pulses, s: fits 32 bits at 90 MHz.
const MAX_INTERVAL_S: u32 = 40;

/// The crystal compared with the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClockReading {
    /// Pulses in the measurement.
    pub pulses: u32,
    /// Edges since the restart that are not in the measurement.
    pub rejected: u32,
    /// Seconds of the reference between the first and the last pulse.
    pub seconds: u32,
    /// Steps of the edge timer between them.
    pub steps: u64,
    /// Standard deviation of the steps per second, interval by interval: √2 times the jitter of a pulse; `None` before the third pulse.
    pub deviation_Hz: Option<f64>,
}

/// Pulses at whole seconds from each other.
#[derive(Clone, Copy, Debug)]
struct Sequence {
    first: EdgeTime,
    last: EdgeTime,
    pulses: u32,
    seconds: u32,
    /// Steps per second in the last interval; 0 before the second pulse.
    steps_per_s: u32,
    /// Sum of the intervals' deviations from the nominal steps per second, and of their squares. Whole numbers: nothing cancels.
    deviations: i64,
    squares: i64,
}

impl Sequence {
    fn begin(at: EdgeTime) -> Self {
        Self { first: at, last: at, pulses: 1, seconds: 0, steps_per_s: 0, deviations: 0, squares: 0 }
    }

    /// Adds an edge if it is a pulse; returns whether it is.
    #[inline(never)] // for the size of the image
    fn add(&mut self, at: EdgeTime, timer_Hz: u32) -> bool {
        let Ok(interval) = u32::try_from(at.0.wrapping_sub(self.last.0)) else { return false };
        let seconds = interval.saturating_add(timer_Hz >> 1).checked_div(timer_Hz).unwrap_or(0);
        if seconds > MAX_INTERVAL_S {
            return false;
        }
        let nominal = seconds.saturating_mul(timer_Hz);
        let is_near = |expected: u32, tolerance: u32| interval.abs_diff(expected) <= tolerance;
        let change = part_of(timer_Hz, MAX_DEVIATION_PART).saturating_add(part_of(nominal, MAX_FREQUENCY_CHANGE_PART));
        let is_as_before = self.steps_per_s == 0 || is_near(seconds.saturating_mul(self.steps_per_s), change);
        let Some(steps_per_s) = interval.checked_div(seconds) else { return false };
        if !(is_near(nominal, part_of(nominal, MAX_FREQUENCY_ERROR_PART)) && is_as_before) {
            return false;
        }
        self.last = at;
        self.pulses = self.pulses.saturating_add(1);
        self.seconds = self.seconds.saturating_add(seconds);
        self.steps_per_s = steps_per_s;
        let deviation = i64::from(steps_per_s.wrapping_sub(timer_Hz) as i32);
        self.deviations = self.deviations.saturating_add(deviation);
        self.squares = self.squares.saturating_add(deviation.saturating_mul(deviation));
        true
    }

    fn deviation_Hz(&self) -> Option<f64> {
        let intervals = f64::from(self.pulses.saturating_sub(1));
        let sum = self.deviations as f64;
        let squares = self.squares as f64 - sum * sum / intervals;
        (self.pulses > 2).then(|| libm::sqrt(f64::max(squares, 0.0) / (intervals - 1.0)))
    }
}

/// `whole` divided by a constant of this module, none of which is zero.
fn part_of(whole: u32, parts: u32) -> u32 {
    whole.checked_div(parts).unwrap_or(0)
}

/// Compares the crystal with the reference.
#[derive(Clone, Copy, Debug)]
pub struct CrystalComparison {
    timer_Hz: u32,
    sequence: Option<Sequence>,
    /// The last edge, if it was rejected.
    last_rejected: Option<EdgeTime>,
    rejected: u32,
}

impl CrystalComparison {
    /// No pulse yet; the edge timer has `timer_Hz` steps per second of the crystal.
    pub fn new(timer_Hz: u32) -> Self {
        Self { timer_Hz, sequence: None, last_rejected: None, rejected: 0 }
    }

    /// Adds an edge on the reference's input.
    #[inline(never)] // for the size of the image
    pub fn add(&mut self, at: EdgeTime) {
        let Some(sequence) = &mut self.sequence else {
            self.sequence = Some(Sequence::begin(at));
            return;
        };
        if sequence.add(at, self.timer_Hz) {
            self.last_rejected = None;
            return;
        }
        self.rejected = self.rejected.saturating_add(1);
        if let Some(mut other) = self.last_rejected.replace(at).map(Sequence::begin)
            && other.add(at, self.timer_Hz)
        {
            // Both are pulses of the new sequence; those of the former one are not.
            self.rejected = self.rejected.saturating_sub(other.pulses).saturating_add(sequence.pulses);
            self.last_rejected = None;
            *sequence = other;
        }
    }

    /// Forgets all edges.
    pub fn restart(&mut self) {
        *self = Self::new(self.timer_Hz);
    }

    /// The comparison so far.
    pub fn reading(&self) -> ClockReading {
        let rejected = self.rejected;
        self.sequence.map_or(ClockReading { rejected, ..ClockReading::default() }, |sequence| ClockReading {
            pulses: sequence.pulses,
            rejected,
            seconds: sequence.seconds,
            steps: sequence.last.0.wrapping_sub(sequence.first.0),
            deviation_Hz: sequence.deviation_Hz(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMER_HZ: f64 = 90e6;
    const TIMER_STEPS: u32 = 90_000_000;

    /// Edges at these times of the reference, s, by a crystal with this relative frequency error.
    fn compared(error: f64, at_s: impl IntoIterator<Item = f64>) -> ClockReading {
        let mut reference = CrystalComparison::new(TIMER_STEPS);
        at_s.into_iter().for_each(|at_s| reference.add(EdgeTime((at_s * (1.0 + error) * TIMER_HZ).round() as u64)));
        reference.reading()
    }

    /// Pulses at 0.3 s, 1.3 s, …
    fn pulses(count: u32) -> impl Iterator<Item = f64> {
        (0..count).map(|k| 0.3 + f64::from(k))
    }

    /// Pulses and other edges in the order of time.
    fn with_edges(count: u32, other: &[f64]) -> Vec<f64> {
        let mut all: Vec<f64> = pulses(count).chain(other.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        all
    }

    fn assert_error(reading: &ClockReading, error: f64) {
        let found = reading.steps as f64 / (f64::from(reading.seconds) * TIMER_HZ) - 1.0;
        assert!((found - error).abs() < 1.0 / (f64::from(reading.seconds) * TIMER_HZ), "{found}, true {error}: {reading:?}");
    }

    #[test]
    fn the_frequency_is_exact_to_a_step_of_the_timer() {
        for error in [0.0, 40e-6, -150e-6] {
            let reading = compared(error, pulses(11));
            assert_eq!((reading.pulses, reading.rejected, reading.seconds), (11, 0, 10));
            assert_error(&reading, error);
            assert!(reading.deviation_Hz.unwrap() < 1.0);
        }
    }

    #[test]
    fn missing_pulses_lengthen_an_interval() {
        let reading = compared(40e-6, pulses(30).enumerate().filter(|(k, _)| !(4..9).contains(k) && *k != 20).map(|(_, at_s)| at_s));
        assert_eq!((reading.pulses, reading.rejected, reading.seconds), (24, 0, 29));
        assert_error(&reading, 40e-6);
    }

    #[test]
    fn edges_between_the_pulses_are_rejected() {
        let reading = compared(-20e-6, with_edges(20, &[2.7, 2.8, 5.301, 5.303, 9.2999]));
        assert_eq!((reading.pulses, reading.rejected, reading.seconds), (20, 5, 19));
        assert_error(&reading, -20e-6);
    }

    #[test]
    fn interference_as_the_first_edge_costs_no_more_than_a_pulse() {
        let reading = compared(40e-6, with_edges(10, &[0.05]));
        assert_eq!((reading.pulses, reading.rejected, reading.seconds), (10, 1, 9));
        assert_error(&reading, 40e-6);
        // So close to the first pulse that its interval is a whole second by the tolerance without a known interval.
        let reading = compared(40e-6, with_edges(10, &[0.2999]));
        assert!(reading.pulses >= 8 && reading.seconds >= 7, "{reading:?}");
        assert_error(&reading, 40e-6);
    }

    #[test]
    fn another_phase_restarts_the_measurement() {
        let reading = compared(10e-6, pulses(5).chain(pulses(8).map(|at_s| 6.25 + at_s)));
        assert_eq!((reading.pulses, reading.rejected, reading.seconds), (8, 5, 7));
        assert_error(&reading, 10e-6);
    }

    #[test]
    fn a_clock_that_is_too_far_off_gives_no_interval() {
        let reading = compared(300e-6, pulses(10));
        assert_eq!((reading.pulses, reading.rejected, reading.seconds), (1, 9, 0));
    }

    #[test]
    fn deviation_shows_the_jitter_and_a_restart_forgets_all() {
        let mut reference = CrystalComparison::new(TIMER_STEPS);
        // ± 1 µs in turn: intervals of 1 s ± 2 µs.
        (0..20).for_each(|k| reference.add(EdgeTime((f64::from(k) * TIMER_HZ) as u64 + if k % 2 == 0 { 180 } else { 0 })));
        let deviation_Hz = reference.reading().deviation_Hz.unwrap();
        assert!((170.0..200.0).contains(&deviation_Hz), "{deviation_Hz}");
        reference.restart();
        assert_eq!(reference.reading(), ClockReading::default());
    }
}
