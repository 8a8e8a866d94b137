//! The chip's own time on the board's clock.
//!
//! The chip stamps its samples in steps of about 25 µs of an oscillator that is off by up to some per cent and drifts. Now and then its
//! time is read with the board's beside it; between such pairs it is taken to run evenly, at the pace of the last long stretch, and before
//! there was one at the pace of all that was seen.

use crate::board::{TICKS_PER_S, Ticks};

/// Length of a stretch that tells the pace: a step of 25 µs is then 13 ppm of it.
const STRETCH_S: f64 = 2.0;
/// No oscillator is further off its trimmed pace, as a part of it.
const FURTHEST_OFF: f64 = 0.05;

/// The chip's time.
#[derive(Clone, Copy, Debug)]
pub struct SampleClock {
    /// Board clock steps in one of the chip's: as it should be, and as it was seen.
    nominal: f64,
    pace: f64,
    /// The pair from which samples are reckoned, and the one at which the stretch began.
    pair: Option<(u32, Ticks)>,
    stretch: Option<(u32, Ticks)>,
    /// A whole stretch was seen.
    settled: bool,
}

impl SampleClock {
    /// A chip with steps of `stamp_s`.
    pub fn new(stamp_s: f64) -> Self {
        let pace = stamp_s * TICKS_PER_S as f64;
        Self { nominal: pace, pace, pair: None, stretch: None, settled: false }
    }

    /// The chip's time was `stamp` at `at`.
    pub fn pair(&mut self, stamp: u32, at: Ticks) {
        self.pair = Some((stamp, at));
        let Some((begin, from)) = self.stretch else {
            self.stretch = Some((stamp, at));
            return;
        };
        let steps = (at - from) as f64;
        let whole = steps >= STRETCH_S * TICKS_PER_S as f64;
        if whole || !self.settled {
            let pace = steps / f64::from(stamp.wrapping_sub(begin).max(1));
            if libm::fabs(pace / self.nominal - 1.0) < FURTHEST_OFF {
                self.pace = pace;
            }
        }
        if whole {
            self.settled = true;
            self.stretch = Some((stamp, at));
        }
    }

    /// The board's time of a sample; `None` before the first pair.
    pub fn at(&self, stamp: u32) -> Option<Ticks> {
        self.pair.map(|(known, at)| {
            let steps = f64::from(stamp.wrapping_sub(known) as i32) * self.pace;
            Ticks(at.0.saturating_add_signed(crate::maths::to_i64(steps)))
        })
    }

    /// How fast the chip's oscillator runs, as a part of what it should.
    pub fn relative_pace(&self) -> f64 {
        self.nominal / self.pace
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_oscillator_is_followed_to_a_step_through_its_wrap() {
        let mut clock = SampleClock::new(25e-6);
        assert_eq!(clock.at(5), None);
        // 1 % slow, wrapping on the way.
        let stamp = |at: u64| (u64::from(u32::MAX) - 90_000 + (at as f64 / 252.5) as u64) as u32;
        for n in 0..20_u64 {
            clock.pair(stamp(n * 2_500_000), Ticks(n * 2_500_000));
        }
        assert!((clock.relative_pace() - 1.0 / 1.01).abs() < 3e-5, "{}", clock.relative_pace());
        for at in [47_000_000_u64, 47_500_000, 49_000_000] {
            let found = clock.at(stamp(at)).unwrap().0;
            assert!(found.abs_diff(at) < 600, "{found} {at}: two steps of the chip");
        }
    }
}
