//! The times of rows: how far apart the samples were taken, where some are missing, and where stamps come in bursts.
//!
//! In: times row by row, twice ([`Steps`], then [`Marks`]), so that no column of times is kept. Out: a [`Timing`]: the interval, runs of rows without a gap,
//! what a person should know.
//!
//! A step above 1.5 × the median is a gap (interfaces.md). Not so where many steps are: a sensor with a buffer gives its samples in *bursts*, with the time
//! at which they were fetched. Then the samples are evenly spaced and the stamps are not: the interval is that of time per row between bursts, and a gap is
//! where the stamps fall behind the count of rows for good.

use std::ops::Range;

use crate::log::GAP_INTERVALS;
use crate::report::significant;
use crate::statistics::Extremes;
use crate::statistics::robust::{median, median_in_place};

/// Steps that are kept for their median.
const KEPT: usize = 1 << 16;
/// Steps above the limit in a larger share than this are bursts, not gaps.
const MANY: f64 = 0.02;
/// Bursts that are looked at after a late one: was it only late?
const LATER: usize = 8;
/// Stamps that scatter by more than this part of the interval are worth a word.
const SCATTER: f64 = 0.02;

/// The first pass: what steps are usual.
#[derive(Debug, Clone)]
pub struct Steps {
    window_s: [f64; 2],
    /// Rows before the window.
    before: usize,
    rows: usize,
    last_s: f64,
    kept: Vec<f64>,
    draws: u64,
}

impl Steps {
    /// Of the rows within these times.
    pub fn new(window_s: [f64; 2]) -> Self {
        Self { window_s, before: 0, rows: 0, last_s: f64::NAN, kept: Vec::new(), draws: 0x9e37_79b9_7f4a_7c15 }
    }

    /// The next time.
    pub fn push(&mut self, t_s: f64) {
        if t_s < self.window_s[0] {
            self.before += 1;
        } else if t_s <= self.window_s[1] {
            self.rows += 1;
            if self.rows > 1 {
                self.keep(t_s - self.last_s);
            }
            self.last_s = t_s;
        }
    }

    /// A sample of all steps, each as likely: one in so many would always meet the same place of a burst.
    fn keep(&mut self, step_s: f64) {
        if self.kept.len() < KEPT {
            self.kept.push(step_s);
            return;
        }
        // xorshift64.
        self.draws ^= self.draws << 13;
        self.draws ^= self.draws >> 7;
        self.draws ^= self.draws << 17;
        if let Some(place) = self.kept.get_mut((self.draws % (self.rows as u64 - 1)) as usize) {
            *place = step_s;
        }
    }

    /// The rows within the window.
    pub fn rows(&self) -> Range<usize> {
        self.before..self.before + self.rows
    }

    /// The second pass, for the same times.
    pub fn marks(mut self) -> Marks {
        let median_s = median_in_place(&mut self.kept).unwrap_or(0.0);
        let longest_s = GAP_INTERVALS * median_s;
        let above = self.kept.iter().filter(|step| **step > longest_s).count();
        let bursts = above as f64 > MANY * self.kept.len() as f64;
        Marks {
            window_s: self.window_s,
            longest_s,
            bursts,
            row: 0,
            last_s: f64::NAN,
            first_s: f64::NAN,
            marks: Vec::new(),
            squares: 0.0,
            usual: 0,
            median_s,
        }
    }
}

/// A row that comes after a long step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    row: usize,
    t_s: f64,
    step_s: f64,
}

/// The second pass: where the long steps are.
#[derive(Debug, Clone)]
pub struct Marks {
    window_s: [f64; 2],
    median_s: f64,
    longest_s: f64,
    bursts: bool,
    row: usize,
    first_s: f64,
    last_s: f64,
    marks: Vec<Mark>,
    /// Of the usual steps less the median.
    squares: f64,
    usual: usize,
}

/// What the times say.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// τ₀, s.
    pub interval_s: f64,
    /// Runs of rows without a gap, counted within the window; they cover it.
    pub segments: Vec<Range<usize>>,
    /// Samples that are missing in the gaps, by time.
    pub missing: f64,
    /// The stamps come in bursts.
    pub bursts: bool,
    /// What a person should know, a line each.
    pub says: Vec<String>,
}

impl Marks {
    /// The next time.
    pub fn push(&mut self, t_s: f64) {
        if t_s < self.window_s[0] || t_s > self.window_s[1] {
            return;
        }
        if self.row == 0 {
            self.first_s = t_s;
        } else {
            let step_s = t_s - self.last_s;
            if step_s > self.longest_s {
                self.marks.push(Mark { row: self.row, t_s, step_s });
            } else {
                self.squares += (step_s - self.median_s).powi(2);
                self.usual += 1;
            }
        }
        self.last_s = t_s;
        self.row += 1;
    }

    /// What the times say.
    pub fn timing(self) -> Timing {
        if self.bursts { self.in_bursts() } else { self.even() }
    }

    fn even(&self) -> Timing {
        let gaps_s: f64 = self.marks.iter().map(|m| m.step_s).sum();
        let interval_s = if self.usual > 0 { (self.last_s - self.first_s - gaps_s) / self.usual as f64 } else { self.median_s };
        let missing = self.marks.iter().map(|m| m.step_s / interval_s - 1.0).sum();
        let mut says = Vec::new();
        let scatter = (self.squares / self.usual.max(1) as f64).sqrt() / interval_s;
        if scatter > SCATTER {
            says.push(format!(
                "time stamps scatter by {} % of the interval; the samples are taken as evenly spaced",
                significant(100.0 * scatter, 2)
            ));
        }
        says.extend(gap_words(self.marks.len(), missing));
        Timing { interval_s, segments: cut(self.row, self.marks.iter().map(|m| m.row)), missing, bursts: false, says }
    }

    fn in_bursts(&self) -> Timing {
        // A burst each: its first row and time. What comes before the first long step may be part of one.
        let starts = &self.marks;
        let mean_s = (self.last_s - self.first_s) / (self.row.max(2) - 1) as f64;
        let pairs = || starts.windows(2).map(|w| (w[1].row - w[0].row, w[1].t_s - w[0].t_s));
        let rough_s = median(pairs().map(|(rows, s)| s / rows as f64)).unwrap_or(mean_s);
        let period_s = (self.last_s - self.first_s) / starts.len().max(1) as f64;
        // How far the stamps are behind the count of rows, at each burst.
        let behind = |k: usize| starts[k].t_s - starts[k].row as f64 * rough_s;
        let mut gaps = Vec::new();
        for k in 1..starts.len() {
            let jump = behind(k) - behind(k - 1);
            let stays = (k..starts.len().min(k + LATER)).map(|j| behind(j) - behind(k - 1)).min_or_infinity();
            if jump > (GAP_INTERVALS * rough_s).max(0.75 * period_s) && stays > 0.5 * jump {
                gaps.push(Mark { step_s: jump + rough_s, ..starts[k] });
            }
        }
        // Time per row between bursts of the same run.
        let (mut rows, mut seconds) = (0, 0.0);
        for (n, s) in starts
            .windows(2)
            .filter(|w| gaps.binary_search_by_key(&w[1].row, |g| g.row).is_err())
            .map(|w| (w[1].row - w[0].row, w[1].t_s - w[0].t_s))
        {
            rows += n;
            seconds += s;
        }
        let interval_s = if rows > 0 { seconds / rows as f64 } else { mean_s };
        let missing = gaps.iter().map(|g| g.step_s / interval_s - 1.0).sum();
        let mut says = vec![format!(
            "time stamps come in bursts, of {} rows on average: the samples are taken as evenly spaced by {} s, the time per row",
            significant(self.row as f64 / (starts.len() + 1) as f64, 3),
            significant(interval_s, 6)
        )];
        says.extend(gap_words(gaps.len(), missing));
        Timing { interval_s, segments: cut(self.row, gaps.iter().map(|g| g.row)), missing, bursts: true, says }
    }
}

fn gap_words(gaps: usize, missing: f64) -> Option<String> {
    let plural = if gaps == 1 { "gap" } else { "gaps" };
    let lost = missing.round().max(1.0);
    (gaps > 0).then(|| {
        format!("{gaps} {plural}, about {lost} samples missing: no difference is taken across a gap, those of all runs are pooled")
    })
}

fn cut(rows: usize, at: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut segments = Vec::new();
    let mut from = 0;
    for row in at.chain([rows]) {
        if row > from {
            segments.push(from..row);
        }
        from = row;
    }
    segments
}
