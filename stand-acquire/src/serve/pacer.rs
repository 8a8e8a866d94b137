//! Synchronisation of virtual time with real time.
//!
//! In: the virtual time of the stand. Out: the time to wait. A lag up to [`MAX_LAG`] is made up by running faster; a larger lag is skipped, so
//! that the stand does not run faster than real time for minutes.

use std::time::{Duration, Instant};

/// Largest lag that is made up.
pub const MAX_LAG: Duration = Duration::from_secs(1);

/// Virtual and real clock.
#[derive(Debug)]
pub struct Pacer {
    begin: Instant,
    skipped: Duration,
}

impl Pacer {
    /// Virtual time 0 is `now`.
    pub fn new(now: Instant) -> Self {
        Self { begin: now, skipped: Duration::ZERO }
    }

    /// Time until the stand may reach `to` after power-on; zero if it is late.
    pub fn wait(&self, to: Duration, now: Instant) -> Duration {
        (self.begin + to).saturating_duration_since(now)
    }

    /// Skips the lag of a stand that is about to reach `to` if the lag is larger than [`MAX_LAG`]; returns the skipped time.
    pub fn skip_lag(&mut self, to: Duration, now: Instant) -> Option<Duration> {
        let lag = now.saturating_duration_since(self.begin + to);
        if lag <= MAX_LAG {
            return None;
        }
        self.begin += lag;
        self.skipped += lag;
        Some(lag)
    }

    /// Total skipped time.
    pub fn skipped(&self) -> Duration {
        self.skipped
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lag_is_made_up_and_large_lag_is_skipped() {
        let begin = Instant::now();
        let ms = Duration::from_millis;
        let mut pace = Pacer::new(begin);
        assert_eq!(pace.wait(ms(10), begin + ms(4)), ms(6));
        assert_eq!(pace.wait(ms(10), begin + ms(500)), ms(0), "no wait while late");
        assert_eq!(pace.skip_lag(ms(10), begin + ms(500)), None);
        assert_eq!(pace.wait(ms(600), begin + ms(500)), ms(100), "on time again");
        assert_eq!(pace.skip_lag(ms(600), begin + ms(5600)), Some(ms(5000)));
        assert_eq!(pace.wait(ms(700), begin + ms(5600)), ms(100), "real time counts from there");
        assert_eq!(pace.skipped(), ms(5000));
    }
}
