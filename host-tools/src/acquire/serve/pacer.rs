//! Virtual time held to the wall's.
//!
//! In: how far the stand has come. Out: how long to wait before it goes on. What was lost to a busy computer is caught up; where it falls behind
//! by more than [`MAX_LAG`], the time is given up, so that the stand does not race through the past for minutes, and the person is told.

use std::time::{Duration, Instant};

/// Beyond that, the stand's clock is set back.
pub const MAX_LAG: Duration = Duration::from_secs(1);

/// The two clocks.
#[derive(Debug)]
pub struct Pacer {
    begin: Instant,
    given_up: Duration,
}

impl Pacer {
    /// Virtual time 0 is now.
    pub fn new(now: Instant) -> Self {
        Self { begin: now, given_up: Duration::ZERO }
    }

    /// How long until the stand may come to `to` after its power-on; zero if it is late already.
    pub fn wait(&self, to: Duration, now: Instant) -> Duration {
        (self.begin + to).saturating_duration_since(now)
    }

    /// The stand is about to come to `to`. Where it is too late for that ever to be caught up, how much was given up.
    pub fn give_up(&mut self, to: Duration, now: Instant) -> Option<Duration> {
        let behind = now.saturating_duration_since(self.begin + to);
        if behind <= MAX_LAG {
            return None;
        }
        self.begin += behind;
        self.given_up += behind;
        Some(behind)
    }

    /// All that was given up so far.
    pub fn given_up(&self) -> Duration {
        self.given_up
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_a_little_late_is_caught_up_and_what_is_hopeless_is_given_up() {
        let begin = Instant::now();
        let ms = Duration::from_millis;
        let mut pace = Pacer::new(begin);
        assert_eq!(pace.wait(ms(10), begin + ms(4)), ms(6));
        assert_eq!(pace.wait(ms(10), begin + ms(500)), ms(0), "no wait until it has caught up");
        assert_eq!(pace.give_up(ms(10), begin + ms(500)), None);
        assert_eq!(pace.wait(ms(600), begin + ms(500)), ms(100), "and then it is on time");
        assert_eq!(pace.give_up(ms(600), begin + ms(5600)), Some(ms(5000)));
        assert_eq!(pace.wait(ms(700), begin + ms(5600)), ms(100), "it goes on from there");
        assert_eq!(pace.given_up(), ms(5000));
    }
}
