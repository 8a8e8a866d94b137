//! What a quadrature counter shows when a wire of its encoder is off.
//!
//! The two channels go through (A, B) = 00, 10, 11, 01 as the count rises. An input without its wire is pulled up. The counter steps
//! by one as its inputs change: with one wire off it dithers between two neighbours, with both off it stands. When the wires
//! are on again it goes on from there: the counts that passed meanwhile are lost for good.

/// The levels of A and B at each quarter of a period.
const LEVELS: [(bool, bool); 4] = [(false, false), (true, false), (true, true), (false, true)];

/// The counter behind the wires.
#[derive(Clone, Copy, Debug, Default)]
pub struct Decoder {
    /// What the counter is ahead of the disc, with its wires on.
    offset: i64,
    /// What it shows while a wire is off, and the quarter of a period that it sees.
    shows: Option<(i64, i64)>,
}

impl Decoder {
    /// A counter that begins at 0, as the chip's does at power-on, where the disc is at the count `disc`.
    pub fn at(disc: i64) -> Self {
        Self { offset: -disc, shows: None }
    }

    /// What the counter shows when the disc is at the count `disc`.
    #[inline]
    pub fn show(&mut self, disc: i64, a_off: bool, b_off: bool) -> i64 {
        if self.shows.is_none() && !a_off && !b_off {
            return disc + self.offset;
        }
        self.broken(disc, a_off, b_off)
    }

    /// The same without a step: what it showed for `disc` last.
    #[inline]
    pub fn shown(&self, disc: i64) -> i64 {
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
                // Both inputs at once: no step that a decoder counts.
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
    fn with_one_wire_off_the_counter_dithers_and_afterwards_it_counts_on_from_there() {
        for (a_off, b_off) in [(true, false), (false, true), (true, true)] {
            let mut decoder = Decoder::default();
            assert_eq!(decoder.show(1000, false, false), 1000);
            let broken: Vec<i64> = (1001..=1400).map(|disc| decoder.show(disc, a_off, b_off)).collect();
            let (least, greatest) = (broken.iter().min().unwrap(), broken.iter().max().unwrap());
            assert!(greatest - least <= 1 && (least - 1000).abs() <= 2, "{least} … {greatest}");
            assert_eq!(least == greatest, a_off && b_off, "both off: it stands");
            let first = decoder.show(1401, false, false);
            assert!((first - greatest).abs() <= 2);
            for disc in 1402..1500 {
                assert_eq!(decoder.show(disc, false, false) - first, disc - 1401, "each edge counts again");
            }
            assert!(1401 - first > 395, "what passed meanwhile is lost");
        }
    }

    #[test]
    fn it_begins_at_nothing_wherever_the_disc_stands() {
        let mut decoder = Decoder::at(-6367);
        assert_eq!((decoder.shown(-6367), decoder.show(-6360, false, false)), (0, 7));
    }

    #[test]
    fn turning_back_with_a_wire_off_ends_where_it_began() {
        let mut decoder = Decoder::default();
        for disc in (0..400).chain((0..400).rev()) {
            decoder.show(disc, true, false);
        }
        assert!((decoder.show(0, false, false)).abs() <= 4);
    }
}
