//! Sampling interval, gaps and bursts from the time stamps of the rows.
//!
//! Input: the times row by row, twice ([`Steps`], then [`Marks`]), so that no column of times is stored. Output: a [`Timing`]: the interval, segments
//! without a gap, remarks.
//!
//! A step above 1.5 × the median is a gap, unless such steps are frequent: a sensor with a buffer delivers its samples in *bursts*, stamped when they
//! were fetched. Its samples are evenly spaced although the stamps are not. The interval is then the time per row between bursts, and a gap is a
//! permanent delay of the stamps against the row count.

use std::ops::Range;

use crate::log::GAP_INTERVALS;
use crate::statistics::Extremes;
use crate::statistics::robust::{median, median_in_place};

/// Number of steps stored for their median.
const MAX_STORED_STEPS: usize = 1 << 16;
/// Fraction of long steps above which they are bursts and not gaps.
const MIN_BURST_FRACTION: f64 = 0.02;
/// Number of bursts after a late one in which its delay must persist.
const PERSISTENCE_BURSTS: usize = 8;
/// Relative scatter of the stamps above which a remark is given.
const MAX_RELATIVE_SCATTER: f64 = 0.02;

/// First pass: the median step.
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
    /// Steps of the rows within a time range, s.
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

    /// Reservoir sampling: every n-th step would always fall on the same position of a burst.
    fn keep(&mut self, step_s: f64) {
        if self.kept.len() < MAX_STORED_STEPS {
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

    /// Starts the second pass over the same times.
    pub fn marks(mut self) -> Marks {
        let median_s = median_in_place(&mut self.kept).unwrap_or(0.0);
        let longest_s = GAP_INTERVALS * median_s;
        let above = self.kept.iter().filter(|step| **step > longest_s).count();
        let bursts = above as f64 > MIN_BURST_FRACTION * self.kept.len() as f64;
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

/// A row after a long step.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Mark {
    row: usize,
    t_s: f64,
    step_s: f64,
}

/// Second pass: positions of the long steps.
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
    /// Sum of squared deviations of ordinary steps from the median.
    squares: f64,
    usual: usize,
}

/// A remark about the time stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum TimingNote {
    /// The stamps scatter.
    Scatter {
        /// Relative to the interval.
        relative: f64,
    },
    /// The stamps come in bursts.
    Bursts {
        /// Mean number of rows of a burst.
        rows: f64,
        /// Time per row, s.
        interval_s: f64,
    },
    /// There are gaps.
    Gaps {
        /// Number of gaps.
        count: usize,
        /// Number of missing samples.
        missing: f64,
    },
}

impl TimingNote {
    fn gaps(count: usize, missing: f64) -> Option<Self> {
        (count > 0).then_some(Self::Gaps { count, missing })
    }
}

/// Timing of the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Timing {
    /// Sampling interval τ₀, s.
    pub interval_s: f64,
    /// Segments without a gap, as rows within the window; together they cover it.
    pub segments: Vec<Range<usize>>,
    /// Number of samples missing in the gaps.
    pub missing: f64,
    /// The stamps come in bursts.
    pub bursts: bool,
    /// Remarks.
    pub notes: Vec<TimingNote>,
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

    /// The timing of the rows.
    pub fn timing(self) -> Timing {
        if self.bursts { self.burst_timing() } else { self.even_timing() }
    }

    fn even_timing(&self) -> Timing {
        let gaps_s: f64 = self.marks.iter().map(|m| m.step_s).sum();
        let interval_s = if self.usual > 0 { (self.last_s - self.first_s - gaps_s) / self.usual as f64 } else { self.median_s };
        let missing = self.marks.iter().map(|m| m.step_s / interval_s - 1.0).sum();
        let mut notes = Vec::new();
        let scatter = (self.squares / self.usual.max(1) as f64).sqrt() / interval_s;
        if scatter > MAX_RELATIVE_SCATTER {
            notes.push(TimingNote::Scatter { relative: scatter });
        }
        notes.extend(TimingNote::gaps(self.marks.len(), missing));
        Timing { interval_s, segments: cut(self.row, self.marks.iter().map(|m| m.row)), missing, bursts: false, notes }
    }

    fn burst_timing(&self) -> Timing {
        // One mark per burst: its first row and time. The rows before the first long step may be a partial burst.
        let starts = &self.marks;
        let mean_s = (self.last_s - self.first_s) / (self.row.max(2) - 1) as f64;
        let pairs = || starts.windows(2).map(|w| (w[1].row - w[0].row, w[1].t_s - w[0].t_s));
        let rough_s = median(pairs().map(|(rows, s)| s / rows as f64)).unwrap_or(mean_s);
        let period_s = (self.last_s - self.first_s) / starts.len().max(1) as f64;
        // Delay of the stamps against the row count at each burst.
        let behind = |k: usize| starts[k].t_s - starts[k].row as f64 * rough_s;
        let mut gaps = Vec::new();
        for k in 1..starts.len() {
            let jump = behind(k) - behind(k - 1);
            let stays = (k..starts.len().min(k + PERSISTENCE_BURSTS)).map(|j| behind(j) - behind(k - 1)).min_or_infinity();
            if jump > (GAP_INTERVALS * rough_s).max(0.75 * period_s) && stays > 0.5 * jump {
                gaps.push(Mark { step_s: jump + rough_s, ..starts[k] });
            }
        }
        // Time per row between bursts of the same segment.
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
        let mut notes = vec![TimingNote::Bursts { rows: self.row as f64 / (starts.len() + 1) as f64, interval_s }];
        notes.extend(TimingNote::gaps(gaps.len(), missing));
        Timing { interval_s, segments: cut(self.row, gaps.iter().map(|g| g.row)), missing, bursts: true, notes }
    }
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
