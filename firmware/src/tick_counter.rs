//! Number of the present tick by the core's cycle counter, lost ticks included.
//!
//! In: the cycle counter at the entry of the control interrupt. Out: the tick that the entry belongs to. Ticks begin at exact multiples of a
//! tick's cycles after the start of the timer, which has the same clock. The entry comes later by the latency of the interrupt, or, after a
//! stalled core, at any time within a tick; counting from the exact beginnings makes both harmless. (Rounding the time between two entries to
//! whole ticks counted a tick twice after each stall that ended in the second half of a tick: the stall was rounded up, and the update event that
//! followed within the same tick counted as one more.) The cycle counter wraps after 24 s at 180 MHz, longer than the watchdog allows a stall.

/// Counts ticks.
#[derive(Clone, Copy, Debug)]
pub struct TickCounter {
    tick: u64,
    /// Cycle counter at the beginning of that tick.
    begin_cycles: u32,
    cycles_per_tick: u32,
}

impl TickCounter {
    /// A counter for ticks of `cycles_per_tick`, of which tick 0 begins at `begin_cycles`.
    pub const fn new(begin_cycles: u32, cycles_per_tick: u32) -> Self {
        Self { tick: 0, begin_cycles, cycles_per_tick }
    }

    /// The interrupt is entered at `cycles`: ticks begun since the last entry. 0 where none has begun; more than 1 after lost ticks.
    #[inline]
    pub fn enter(&mut self, cycles: u32) -> u32 {
        let since = cycles.wrapping_sub(self.begin_cycles);
        let ticks = since.checked_div(self.cycles_per_tick).unwrap_or(0);
        self.tick += u64::from(ticks);
        self.begin_cycles = self.begin_cycles.wrapping_add(ticks.wrapping_mul(self.cycles_per_tick));
        ticks
    }

    /// Number of the present tick.
    #[inline]
    pub fn tick(&self) -> u64 {
        self.tick
    }

    /// Cycle counter at the beginning of the present tick.
    #[inline]
    pub fn begin_cycles(&self) -> u32 {
        self.begin_cycles
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK: u32 = 18_000;

    /// Ticks counted by a core that is entered at each beginning of a tick, after `latency`, and that is stalled for `stall` cycles from
    /// `from` on: a pending event enters at the end of the stall. Cycles are from the start.
    fn ticks_counted(from: u32, stall: u32, latency: impl Fn(u32) -> u32, start: u32, seconds_ticks: u32) -> (u64, u32) {
        let mut counter = TickCounter::new(start, TICK);
        let (mut pending, mut lost) = (false, 0);
        for n in 1..=seconds_ticks {
            let event = n * TICK;
            let stalled = event >= from && event < from + stall;
            pending |= stalled;
            let end = from + stall;
            if pending && !stalled {
                // Events during the stall set one flag: one entry.
                pending = false;
                if end < event {
                    lost += counter.enter(start.wrapping_add(end)) - 1;
                }
            }
            if !stalled {
                lost += counter.enter(start.wrapping_add(event + latency(n))).saturating_sub(1);
            }
        }
        (counter.tick(), lost)
    }

    #[test]
    fn each_tick_is_counted_once_after_a_stall_that_ends_anywhere_in_a_tick() {
        for end_permille in (0..1000).step_by(7) {
            let stall = 2_500 * TICK + TICK / 1000 * end_permille;
            // The last start makes the cycle counter wrap within the stall.
            for start in [0, 77, u32::MAX - 1000 * TICK] {
                let (ticks, lost) = ticks_counted(100 * TICK + 1, stall, |n| 30 + n % 90, start, 4_000);
                assert_eq!(ticks, 4_000, "the stall ends at {end_permille} ‰ of a tick");
                assert!((2_498..=2_500).contains(&lost), "{lost} lost");
            }
        }
    }

    #[test]
    fn latency_neither_loses_nor_adds_ticks() {
        // Up to a tenth of a tick late, in no pattern.
        let (ticks, lost) = ticks_counted(0, 0, |n| 12 + n.wrapping_mul(2_654_435_761) % 1_800, 5, 10_000);
        assert_eq!((ticks, lost), (10_000, 0));
    }

    #[test]
    fn an_entry_before_the_next_beginning_counts_nothing() {
        let mut counter = TickCounter::new(1_000, TICK);
        assert_eq!(counter.enter(1_000 + TICK - 1), 0);
        assert_eq!(counter.enter(1_000 + TICK), 1);
        assert_eq!((counter.tick(), counter.begin_cycles()), (1, 1_000 + TICK));
    }
}
