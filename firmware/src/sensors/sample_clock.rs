//! Conversion of the chip's time stamps to the board's clock.
//!
//! The chip's oscillator is off by up to some per cent and drifts; its time stamps have steps of about 25 µs. At intervals the chip's time
//! is read together with the board's. Between such pairs the frequency is taken as constant: that of the last interval of 2 s, or before
//! its end that since the start.

use crate::board::{TICKS_PER_S, Ticks};

/// Interval from which the frequency is estimated, s: a step of 25 µs is 13 ppm of it.
const INTERVAL_S: f64 = 2.0;
/// Greatest accepted relative deviation from the trimmed frequency.
const MAX_DEVIATION: f64 = 0.05;

/// The time of the chip.
#[derive(Clone, Copy, Debug)]
pub struct SampleClock {
    /// Board clock steps per step of the chip: nominal, and estimated.
    nominal: f64,
    steps_per_stamp: f64,
    /// The pair from which samples are extrapolated, and the pair at the start of the interval.
    pair: Option<(u32, Ticks)>,
    interval: Option<(u32, Ticks)>,
    /// A whole interval was measured.
    settled: bool,
}

impl SampleClock {
    /// A chip with time stamps in steps of `stamp_s`.
    pub fn new(stamp_s: f64) -> Self {
        let steps_per_stamp = stamp_s * TICKS_PER_S as f64;
        Self { nominal: steps_per_stamp, steps_per_stamp, pair: None, interval: None, settled: false }
    }

    /// Takes a pair: the chip's time was `stamp` at `at`.
    pub fn pair(&mut self, stamp: u32, at: Ticks) {
        self.pair = Some((stamp, at));
        let Some((begin, from)) = self.interval else {
            self.interval = Some((stamp, at));
            return;
        };
        let steps = (at - from) as f64;
        let whole = steps >= INTERVAL_S * TICKS_PER_S as f64;
        if whole || !self.settled {
            let steps_per_stamp = steps / f64::from(stamp.wrapping_sub(begin).max(1));
            if libm::fabs(steps_per_stamp / self.nominal - 1.0) < MAX_DEVIATION {
                self.steps_per_stamp = steps_per_stamp;
            }
        }
        if whole {
            self.settled = true;
            self.interval = Some((stamp, at));
        }
    }

    /// Time of a sample by the board's clock; `None` before the first pair.
    pub fn at(&self, stamp: u32) -> Option<Ticks> {
        self.pair.map(|(known, at)| {
            let steps = f64::from(stamp.wrapping_sub(known) as i32) * self.steps_per_stamp;
            Ticks(at.0.saturating_add_signed(steps as i64))
        })
    }

    /// Frequency of the chip's oscillator relative to its nominal frequency.
    pub fn relative_frequency(&self) -> f64 {
        self.nominal / self.steps_per_stamp
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_oscillator_is_tracked_across_a_wrap() {
        let mut clock = SampleClock::new(25e-6);
        assert_eq!(clock.at(5), None);
        // 1 % slow, wrapping on the way.
        let stamp = |at: u64| (u64::from(u32::MAX) - 90_000 + (at as f64 / 252.5) as u64) as u32;
        for n in 0..20_u64 {
            clock.pair(stamp(n * 2_500_000), Ticks(n * 2_500_000));
        }
        assert!((clock.relative_frequency() - 1.0 / 1.01).abs() < 3e-5, "{}", clock.relative_frequency());
        for at in [47_000_000_u64, 47_500_000, 49_000_000] {
            let found = clock.at(stamp(at)).unwrap().0;
            assert!(found.abs_diff(at) < 600, "{found} {at}: two steps of the chip");
        }
    }
}
