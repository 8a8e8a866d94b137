//! Sampling interval, gaps and bursts from the time stamps of the rows.
//!
//! Input: the times row by row, twice ([`Steps`], then [`Marks`]), so that no column of times is stored. Output: a [`Timing`]: the
//! interval, segments without a gap, remarks.
//!
//! A step above 1.5 × the median is a gap, unless such steps are frequent. Frequent steps of 2, 3, 4 … intervals are *lost rows*: the rows
//! between them are averaged as they are, and the interval is that of the ordinary steps, because the noise of a row belongs to it; slow
//! noise has moved over the elapsed time, which is longer. Otherwise a sensor with a buffer delivers its samples in *bursts*, stamped when
//! they were fetched: its samples are evenly spaced although the stamps are not. The interval is then the time per row between bursts, and
//! a gap is a permanent delay of the stamps against the row count.
//!
//! Where the interval changes for good, the noise of a row changes with it: only the longest stretch of one interval is used.

use std::ops::Range;

use identification::log::GAP_INTERVALS;
use identification::statistics::Extremes;
use identification::statistics::robust::{median, median_in_place};

/// Number of steps stored for their median.
const MAX_STORED_STEPS: usize = 1 << 16;
/// Fraction of long steps above which they are bursts and not gaps.
const MIN_BURST_FRACTION: f64 = 0.02;
/// Number of bursts after a late one in which its delay must persist.
const PERSISTENCE_BURSTS: usize = 8;
/// Relative scatter of the stamps above which a remark is given.
const MAX_RELATIVE_SCATTER: f64 = 0.02;
/// Fraction of long steps above which they are lost rows, if their multiples say so.
const MIN_LOST_FRACTION: f64 = 0.002;
/// Longest step that counts as lost rows, in intervals.
const MAX_LOST_INTERVALS: f64 = 11.0;
/// Deviation of a step from a whole number of intervals, in intervals, and the fraction of the long steps that must be so.
const MAX_MULTIPLE_DEVIATION: f64 = 0.2;
const MIN_MULTIPLES: f64 = 0.9;
/// Steps of a block whose median is compared with its neighbours.
const RATE_BLOCK: usize = 64;
/// Relative change of the median step from which the sampling rate has changed.
const MIN_RATE_CHANGE: f64 = 0.1;
/// Fraction of the rows that the second interval must have.
const MIN_STRETCH: f64 = 0.03;

/// First pass: the median step.
#[derive(Debug, Clone)]
pub struct Steps {
    window_s: [f64; 2],
    /// Rows before the window.
    before: usize,
    rows: usize,
    last_s: f64,
    /// Steps, s, with the block that they belong to.
    kept: Vec<(u32, f64)>,
    draws: u64,
    /// Steps of the present block, and median step and first time of each finished one.
    block: Vec<f64>,
    block_start_s: f64,
    medians: Vec<(f64, f64)>,
}

/// Stretch of rows with one sampling interval.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stretch {
    /// Blocks.
    from: usize,
    to: usize,
    /// Median step, s.
    step_s: f64,
}

impl Steps {
    /// Steps of the rows within a time range, s.
    pub fn new(window_s: [f64; 2]) -> Self {
        Self {
            window_s,
            before: 0,
            rows: 0,
            last_s: f64::NAN,
            kept: Vec::new(),
            draws: 0x9e37_79b9_7f4a_7c15,
            block: Vec::with_capacity(RATE_BLOCK),
            block_start_s: f64::NAN,
            medians: Vec::new(),
        }
    }

    /// The next time.
    pub fn push(&mut self, t_s: f64) {
        if t_s < self.window_s[0] {
            self.before += 1;
        } else if t_s <= self.window_s[1] {
            self.rows += 1;
            if self.rows > 1 {
                self.keep(t_s - self.last_s);
                self.block.push(t_s - self.last_s);
            }
            if self.block.is_empty() {
                self.block_start_s = t_s;
            } else if self.block.len() == RATE_BLOCK {
                let step_s = median_in_place(&mut self.block).unwrap_or(0.0);
                self.medians.push((step_s, self.block_start_s));
                self.block.clear();
                self.block_start_s = t_s;
            }
            self.last_s = t_s;
        }
    }

    /// Reservoir sampling: every n-th step would always fall on the same position of a burst.
    fn keep(&mut self, step_s: f64) {
        let entry = (self.medians.len() as u32, step_s);
        if self.kept.len() < MAX_STORED_STEPS {
            self.kept.push(entry);
            return;
        }
        // xorshift64.
        self.draws ^= self.draws << 13;
        self.draws ^= self.draws >> 7;
        self.draws ^= self.draws << 17;
        if let Some(place) = self.kept.get_mut((self.draws % (self.rows as u64 - 1)) as usize) {
            *place = entry;
        }
    }

    /// The rows within the window, of the stretch that is used.
    pub fn rows(&self) -> Range<usize> {
        match self.used() {
            Some((used, _)) => {
                let to = if used.to == self.medians.len() { self.rows } else { used.to * RATE_BLOCK };
                self.before + used.from * RATE_BLOCK..self.before + to
            }
            None => self.before..self.before + self.rows,
        }
    }

    /// The longest stretch of one interval with its times, s; `None` without a change of the interval.
    fn used(&self) -> Option<(Stretch, [f64; 2])> {
        let mut stretches: Vec<Stretch> = Vec::new();
        let differs = |a: f64, b: f64| (a / b - 1.0).abs() > MIN_RATE_CHANGE && (b / a - 1.0).abs() > MIN_RATE_CHANGE;
        let mut k = 0;
        while k < self.medians.len() {
            let step_s = self.medians[k].0;
            // A change persists: one block with another median is none.
            let ends = |j: usize| differs(self.medians[j].0, step_s) && self.medians.get(j + 1).is_none_or(|next| differs(next.0, step_s));
            let to = (k..self.medians.len()).find(|j| ends(*j)).unwrap_or(self.medians.len());
            if to > k {
                stretches.push(Stretch { from: k, to, step_s });
            }
            k = to.max(k + 1);
        }
        let seconds = |stretch: &Stretch| (stretch.to - stretch.from) as f64 * stretch.step_s;
        let longest = stretches.iter().max_by(|a, b| seconds(a).total_cmp(&seconds(b))).copied()?;
        let others: usize = stretches.iter().filter(|s| differs(s.step_s, longest.step_s)).map(|s| s.to - s.from).sum();
        if (others as f64) < MIN_STRETCH * self.medians.len() as f64 {
            return None;
        }
        // The blocks at a change contain both intervals.
        let from = if longest.from > 0 { longest.from + 1 } else { 0 };
        let to = if longest.to < self.medians.len() { longest.to - 1 } else { longest.to };
        if to <= from {
            return None;
        }
        let end_s = self.medians.get(to).map_or(self.last_s, |(_, start_s)| *start_s);
        Some((Stretch { from, to, ..longest }, [self.medians[from].1, end_s]))
    }

    /// Starts the second pass over the same times.
    pub fn marks(self) -> Marks {
        let used = self.used();
        let rows = self.rows();
        let is_used = |block: u32| used.is_none_or(|(stretch, _)| (stretch.from..stretch.to).contains(&(block as usize)));
        let mut kept: Vec<f64> = self.kept.iter().filter(|(block, _)| is_used(*block)).map(|(_, step)| *step).collect();
        let median_s = median_in_place(&mut kept).unwrap_or(0.0);
        let longest_s = GAP_INTERVALS * median_s;
        let long: Vec<f64> = kept.iter().filter(|step| **step > longest_s).map(|step| step / median_s).collect();
        let is_multiple = |step: &f64| *step < MAX_LOST_INTERVALS + 0.5 && (step - step.round()).abs() < MAX_MULTIPLE_DEVIATION;
        let multiples: Vec<f64> = long.iter().filter(|step| is_multiple(step)).copied().collect();
        let twice = multiples.iter().filter(|step| step.round() == 2.0).count();
        let loses_rows = long.len() as f64 > MIN_LOST_FRACTION * kept.len() as f64
            && multiples.len() as f64 > MIN_MULTIPLES * long.len() as f64
            && 2 * twice > multiples.len();
        let bursts = !loses_rows && long.len() as f64 > MIN_BURST_FRACTION * kept.len() as f64;
        Marks {
            window_s: self.window_s,
            used_rows: rows.start - self.before..rows.end - self.before,
            change: used.map(|(stretch, times_s)| TimingNote::RateChange { interval_s: stretch.step_s, used_s: times_s }),
            seen: 0,
            longest_s: if loses_rows { (MAX_LOST_INTERVALS + 0.5) * median_s } else { longest_s },
            usual_s: longest_s,
            lost: (0, 0.0),
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
    /// Rows within the window that are used, and the remark about the others.
    used_rows: Range<usize>,
    change: Option<TimingNote>,
    /// Rows of the window so far.
    seen: usize,
    median_s: f64,
    /// Longest step that is no gap, s, and longest ordinary one.
    longest_s: f64,
    usual_s: f64,
    /// Number of steps over lost rows, and their sum, s.
    lost: (usize, f64),
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
    /// Single rows are lost.
    LostRows {
        /// Number of lost rows.
        count: f64,
        /// Elapsed time per row, relative to the interval.
        elapsed: f64,
    },
    /// The sampling interval changes: only a part of the rows is used.
    RateChange {
        /// Interval of the part that is used, s.
        interval_s: f64,
        /// Its begin and end, s.
        used_s: [f64; 2],
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
    /// Elapsed time per row, s: longer than the interval if rows are lost.
    pub elapsed_s: f64,
    /// Time of the first row, s.
    pub first_s: f64,
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
        let is_used = self.used_rows.contains(&self.seen);
        self.seen += 1;
        if !is_used {
            return;
        }
        if self.row == 0 {
            self.first_s = t_s;
        } else {
            let step_s = t_s - self.last_s;
            if step_s > self.longest_s {
                self.marks.push(Mark { row: self.row, t_s, step_s });
            } else if step_s > self.usual_s {
                self.lost.0 += 1;
                self.lost.1 += step_s;
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
        let mut timing = if self.bursts { self.burst_timing() } else { self.even_timing() };
        timing.notes.extend(self.change);
        timing
    }

    fn even_timing(&self) -> Timing {
        let gaps_s: f64 = self.marks.iter().map(|m| m.step_s).sum();
        let (lost_steps, lost_s) = self.lost;
        let rows_s = self.last_s - self.first_s - gaps_s;
        let interval_s = if self.usual > 0 { (rows_s - lost_s) / self.usual as f64 } else { self.median_s };
        let elapsed_s = if self.usual > 0 { rows_s / (self.usual + lost_steps) as f64 } else { interval_s };
        let missing_in_gaps: f64 = self.marks.iter().map(|m| m.step_s / interval_s - 1.0).sum();
        let lost_rows = lost_s / interval_s - lost_steps as f64;
        let mut notes = Vec::new();
        let scatter = (self.squares / self.usual.max(1) as f64).sqrt() / interval_s;
        if scatter > MAX_RELATIVE_SCATTER {
            notes.push(TimingNote::Scatter { relative: scatter });
        }
        if lost_steps > 0 {
            notes.push(TimingNote::LostRows { count: lost_rows, elapsed: elapsed_s / interval_s });
        }
        notes.extend(TimingNote::gaps(self.marks.len(), missing_in_gaps));
        Timing {
            interval_s,
            elapsed_s,
            first_s: self.first_s,
            segments: cut(self.row, self.marks.iter().map(|m| m.row)),
            missing: missing_in_gaps + lost_rows,
            bursts: false,
            notes,
        }
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
        Timing {
            interval_s,
            elapsed_s: interval_s,
            first_s: self.first_s,
            segments: cut(self.row, gaps.iter().map(|g| g.row)),
            missing,
            bursts: true,
            notes,
        }
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
