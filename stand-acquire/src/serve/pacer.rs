//! Synchronisation of virtual time with real time.
//!
//! In: the virtual time of the stand. Out: the real time to wait. A lag up to [`MAX_LAG`] is made up by running faster; a larger lag is skipped. While
//! the stand makes up a lag, its host cannot answer in time: the lag counts as silence of the host, after 2 s of which the stand stops its drive.

use std::time::{Duration, Instant};

/// Largest lag that is made up, in virtual time.
pub const MAX_LAG: Duration = Duration::from_millis(100);

/// Virtual and real clock.
#[derive(Debug)]
pub struct Pacer {
    begin: Instant,
    /// Virtual time in a unit of real time.
    speed: f64,
}

impl Pacer {
    /// Virtual time 0 is `now`; it passes `speed` times as fast as real time.
    pub fn new(now: Instant, speed: f64) -> Self {
        Self { begin: now, speed }
    }

    /// Real time at which the stand may reach `to` after power-on.
    fn due(&self, to: Duration) -> Instant {
        self.begin + to.div_f64(self.speed)
    }

    /// Real time until the stand may reach `to` after power-on; zero if it is late.
    pub fn wait(&self, to: Duration, now: Instant) -> Duration {
        self.due(to).saturating_duration_since(now)
    }

    /// Skips the lag of a stand that is about to reach `to` if the lag is larger than [`MAX_LAG`]; returns the skipped virtual time.
    pub fn skip_lag(&mut self, to: Duration, now: Instant) -> Option<Duration> {
        let behind = now.saturating_duration_since(self.due(to));
        let lag = behind.mul_f64(self.speed);
        if lag <= MAX_LAG {
            return None;
        }
        self.begin += behind;
        Some(lag)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lag_is_made_up_and_large_lag_is_skipped() {
        let begin = Instant::now();
        let ms = Duration::from_millis;
        let mut pace = Pacer::new(begin, 1.0);
        assert_eq!(pace.wait(ms(10), begin + ms(4)), ms(6));
        assert_eq!(pace.wait(ms(10), begin + ms(80)), ms(0), "no wait while late");
        assert_eq!(pace.skip_lag(ms(10), begin + ms(80)), None);
        assert_eq!(pace.wait(ms(180), begin + ms(80)), ms(100), "on time again");
        assert_eq!(pace.skip_lag(ms(180), begin + ms(5180)), Some(ms(5000)));
        assert_eq!(pace.wait(ms(280), begin + ms(5180)), ms(100), "real time counts from there");
    }

    #[test]
    fn faster_stand_waits_less_and_its_lag_is_in_its_own_time() {
        let begin = Instant::now();
        let ms = Duration::from_millis;
        let mut pace = Pacer::new(begin, 4.0);
        assert_eq!(pace.wait(ms(40), begin + ms(4)), ms(6));
        assert_eq!(pace.skip_lag(ms(40), begin + ms(30)), None);
        assert_eq!(pace.skip_lag(ms(40), begin + ms(110)), Some(ms(400)));
        assert_eq!(pace.wait(ms(80), begin + ms(110)), ms(10));
    }
}
