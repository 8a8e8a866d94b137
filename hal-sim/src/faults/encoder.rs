//! The reading of a quadrature counter with a disconnected wire.
//!
//! The channels pass through (A, B) = 00, 10, 11, 01 as the count rises. A disconnected input is pulled up. The counter steps
//! by one as its inputs change: with one wire disconnected it alternates between two counts, with both it stands still. When the wires
//! are connected again it continues from there: the counts in between are lost.

/// Levels of A and B in each quarter of a period.
const LEVELS: [(bool, bool); 4] = [(false, false), (true, false), (true, true), (false, true)];

/// The counter behind the wires.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    /// Difference of counter and disc with connected wires.
    offset: i64,
    /// Count while a wire is disconnected, and the quarter of a period at its inputs.
    shows: Option<(i64, i64)>,
}

impl Decoder {
    /// A counter that starts at 0, as at power-on, where the disc is at the count `disc`.
    pub fn at(disc: i64) -> Self {
        Self { offset: -disc, shows: None }
    }

    /// Advances to the count `disc` of the disc and returns the count of the counter.
    #[inline]
    pub fn advance(&mut self, disc: i64, a_off: bool, b_off: bool) -> i64 {
        if self.shows.is_none() && !a_off && !b_off {
            return disc + self.offset;
        }
        self.broken(disc, a_off, b_off)
    }

    /// The count of the counter for the last position, without a step.
    #[inline]
    pub fn count(&self, disc: i64) -> i64 {
        self.shows.map_or(disc + self.offset, |(count, _)| count)
    }

    #[cold]
    fn broken(&mut self, disc: i64, a_off: bool, b_off: bool) -> i64 {
        let (before, quarter_before) = self.shows.unwrap_or((disc + self.offset, disc.rem_euclid(4)));
        let (a, b) = LEVELS[disc.rem_euclid(4) as usize];
        let seen = (a || a_off, b || b_off);
        let quarter = LEVELS.iter().position(|levels| *levels == seen).unwrap_or(0) as i64;
        let now = before
            + match (quarter - quarter_before).rem_euclid(4) {
                3 => -1,
                // Both inputs changed at once: the decoder does not count.
                2 => 0,
                step => step,
            };
        if a_off || b_off {
            self.shows = Some((now, quarter));
        } else {
            self.shows = None;
            self.offset = now - disc;
        }
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_one_wire_off_the_counter_alternates_and_later_continues_from_there() {
        for (a_off, b_off) in [(true, false), (false, true), (true, true)] {
            let mut decoder = Decoder::default();
            assert_eq!(decoder.advance(1000, false, false), 1000);
            let broken: Vec<i64> = (1001..=1400).map(|disc| decoder.advance(disc, a_off, b_off)).collect();
            let (least, greatest) = (broken.iter().min().unwrap(), broken.iter().max().unwrap());
            assert!(greatest - least <= 1 && (least - 1000).abs() <= 2, "{least} … {greatest}");
            assert_eq!(least == greatest, a_off && b_off, "both off: constant count");
            let first = decoder.advance(1401, false, false);
            assert!((first - greatest).abs() <= 2);
            for disc in 1402..1500 {
                assert_eq!(decoder.advance(disc, false, false) - first, disc - 1401, "each edge counts again");
            }
            assert!(1401 - first > 395, "the edges in between are lost");
        }
    }

    #[test]
    fn the_counter_starts_at_zero_at_any_disc_position() {
        let mut decoder = Decoder::at(-6367);
        assert_eq!((decoder.count(-6367), decoder.advance(-6360, false, false)), (0, 7));
    }

    #[test]
    fn a_return_with_a_wire_off_ends_at_the_start_count() {
        let mut decoder = Decoder::default();
        for disc in (0..400).chain((0..400).rev()) {
            decoder.advance(disc, true, false);
        }
        assert!((decoder.advance(0, false, false)).abs() <= 4);
    }
}
