//! The request: reads a column of a log and analyses it.

use std::ops::Range;
use std::path::PathBuf;

use super::answer::{Answer, Coefficient, Interpretation, Lowest, NotShown, Note, Point};
use super::confidence::{Covariance, Squares, expected, interval, parts};
use super::deviation::{Series, Variance};
use super::error::Still;
use super::noise::{self, MIN_POINTS};
use super::time_stamps::{Steps, Timing};
use super::units::Unit;
use super::{AllanError, FLOOR, MAX_RELATIVE_TAU};
use crate::log::{OneColumn, times};

/// Minimum number of rows for one deviation.
const MIN_ROWS: usize = 3;
/// Averaging factors per octave of [`Taus::Fine`].
const FINE_FACTORS_PER_OCTAVE: f64 = 8.0;

/// Averaging times that the result contains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Taus {
    /// Factors 1, 2, 4, 8 …
    #[default]
    Octave,
    /// Factors 1, 2, 5, 10, 20 …
    Decade,
    /// Eight factors per octave.
    Fine,
}

/// A request.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Path of the log.
    pub log: PathBuf,
    /// Name of the column.
    pub column: String,
    /// Start of the analysed range, s.
    pub from_s: Option<f64>,
    /// End of the analysed range, s.
    pub to_s: Option<f64>,
    /// Averaging times.
    pub taus: Taus,
    /// Interpretation of the column; by default from its unit (an angle is an integral).
    pub interpretation: Option<Interpretation>,
}

impl Request {
    /// Reads the column and analyses it.
    ///
    /// # Errors
    /// Unreadable log, missing column, too few rows, constant column.
    pub fn answer(&self) -> Result<Answer, AllanError> {
        let name = self.log.display().to_string();
        if self.column == "t_s" {
            return Err(AllanError::Time { log: name });
        }
        let (column, timing) = self.read(&name)?;
        let quantum = column.quantization_step();
        let mut unit = Unit::of(&self.column);
        let interpretation = self.interpretation.unwrap_or(if unit.is_angle() { Interpretation::Integral } else { Interpretation::Value });
        let rows = column.values.len();
        let still = |why: Still| AllanError::Still { log: name.clone(), column: self.column.clone(), why };
        if column.values.iter().all(|v| *v == column.values[0]) {
            return Err(still(Still::Constant(column.values[0])));
        }
        let mut notes: Vec<Note> = column.warnings.into_iter().map(Note::Log).collect();
        notes.extend(timing.notes.into_iter().map(Note::Timing));
        let series = match interpretation {
            Interpretation::Value => Series::of_rates(column.values, &timing.segments),
            Interpretation::Integral => {
                unit = unit.per_second();
                Series::of_angles(column.values, &timing.segments, timing.interval_s)
            }
        };
        // A segment has one more angle than rates.
        let more = usize::from(interpretation == Interpretation::Value);
        let lengths = lengths(&timing.segments, more);
        if series.largest_factor() == 0 {
            let rows = timing.segments.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
            return Err(AllanError::Gaps { log: name, rows });
        }
        let shown = factors(self.taus, series.largest_factor());
        let octaves = factors(Taus::Octave, series.largest_factor());
        let mut all = [&shown[..], &octaves[..]].concat();
        all.sort_unstable();
        all.dedup();
        let overlapping = series.overlapping(&all);
        if overlapping.iter().all(|v| v.variance == 0.0) {
            return Err(still(Still::StraightLine));
        }
        let up_to = (MAX_RELATIVE_TAU * rows as f64) as usize;
        let read: Vec<Variance> = overlapping.iter().filter(|v| octaves.contains(&v.factor) && v.factor <= up_to).copied().collect();
        let found = noise::fit(&read, &lengths);
        let white: Squares = [0.0, overlapping[0].variance, 0.0, 0.0, 0.0];
        let squares = found.as_ref().map_or(white, |f| f.squares);
        let at_shown: Vec<Variance> = overlapping.into_iter().filter(|v| shown.contains(&v.factor)).collect();
        let plain = series.plain(&shown);
        let points: Vec<Point> = at_shown.iter().zip(&plain).map(|(o, p)| point(o, p, &squares, &lengths, timing.interval_s)).collect();
        let lowest = lowest(&points, up_to);
        let mut answer = Answer {
            log: name,
            column: column.name,
            unit,
            interpretation,
            rows,
            interval_s: timing.interval_s,
            segments: timing.segments.len(),
            missing: timing.missing,
            bursts: timing.bursts,
            quantum,
            read_s: None,
            misfit: None,
            lowest,
            points,
            coefficients: Default::default(),
            notes,
        };
        match found {
            Some(found) => answer.set_coefficients(&found, read[found.first].factor, up_to),
            None => {
                answer.set_no_coefficients(if read.len() < MIN_POINTS { NotShown::TooFewRows { rows } } else { NotShown::ZeroVariance })
            }
        }
        Ok(answer)
    }

    /// The column within the window, with the timing of its rows.
    fn read(&self, name: &str) -> Result<(OneColumn, Timing), AllanError> {
        let (from_s, to_s) = (self.from_s.unwrap_or(f64::NEG_INFINITY), self.to_s.unwrap_or(f64::INFINITY));
        if from_s.is_nan() || to_s.is_nan() || from_s >= to_s {
            return Err(AllanError::Window { from_s, to_s });
        }
        let mut steps = Steps::new([from_s, to_s]);
        times(&self.log, &mut |t_s| steps.push(t_s))?;
        let within = steps.rows();
        let mut marks = steps.marks();
        let mut column = OneColumn::read(&self.log, &self.column, &mut |t_s| marks.push(t_s))?;
        column.values.truncate(within.end);
        column.values.drain(..within.start);
        if within.len() < MIN_ROWS {
            let window = if self.from_s.or(self.to_s).is_some() { format!(" from {from_s} s to {to_s} s") } else { String::new() };
            return Err(AllanError::Short { log: name.to_owned(), rows: within.len(), window, minimum: MIN_ROWS });
        }
        Ok((column, marks.timing()))
    }
}

/// Averaging factors from 1 to the largest.
pub fn factors(taus: Taus, largest: usize) -> Vec<usize> {
    let mut all: Vec<usize> = match taus {
        Taus::Octave => (0..usize::BITS).map(|k| 1 << k).take_while(|m| *m <= largest).collect(),
        Taus::Decade => (0..19).flat_map(|k| [1, 2, 5].map(|m| m * 10_usize.pow(k))).take_while(|m| *m <= largest).collect(),
        Taus::Fine => {
            (0..).map(|k| (f64::from(k) / FINE_FACTORS_PER_OCTAVE).exp2().round() as usize).take_while(|m| *m <= largest).collect()
        }
    };
    all.dedup();
    all
}

/// Pairs of a segment length (in angles) and the number of segments with this length.
fn lengths(segments: &[Range<usize>], more: usize) -> Vec<(usize, usize)> {
    let mut lengths: Vec<usize> = segments.iter().map(|s| s.len() + more).collect();
    lengths.sort_unstable();
    lengths.chunk_by(|a, b| a == b).map(|same| (same[0], same.len())).collect()
}

fn point(overlapping: &Variance, plain: &Variance, squares: &Squares, lengths: &[(usize, usize)], interval_s: f64) -> Point {
    let factor = overlapping.factor;
    let degrees = Covariance::new(factor, factor, lengths).degrees_of_freedom(squares);
    let oadev = overlapping.variance.sqrt();
    let share = |p: usize| squares[p] * parts(factor)[p];
    Point {
        factor,
        tau_s: factor as f64 * interval_s,
        oadev,
        terms: overlapping.terms,
        adev: plain.variance.sqrt(),
        plain_terms: plain.terms,
        degrees,
        within_68: interval(oadev, degrees, 0.682_689_492),
        within_95: interval(oadev, degrees, 0.95),
        fitted: expected(squares, factor).sqrt(),
        strongest: (0..5).max_by(|a, b| share(*a).total_cmp(&share(*b))).unwrap_or(1),
    }
}

/// The lowest point within the range of averaging times that is read.
fn lowest(points: &[Point], up_to: usize) -> Option<Lowest> {
    let read = points.iter().take_while(|p| p.factor <= up_to);
    let (place, point) = read.clone().enumerate().min_by(|a, b| a.1.oadev.total_cmp(&b.1.oadev))?;
    Some(Lowest {
        tau_s: point.tau_s,
        oadev: point.oadev,
        over_floor: point.oadev / FLOOR,
        sigma: (point.within_68[1] - point.within_68[0]) / 2.0 / FLOOR,
        inside: place > 0 && place + 1 < read.count(),
    })
}

impl Answer {
    /// Sets the coefficients, converted from rows to seconds.
    fn set_coefficients(&mut self, found: &noise::Found, first: usize, up_to: usize) {
        let tau0 = self.interval_s;
        // Factors of the coefficients, not of their squares.
        let seconds = [tau0, tau0.sqrt(), 1.0, 1.0 / tau0.sqrt(), 1.0 / tau0];
        self.read_s = Some([first as f64 * tau0, up_to as f64 * tau0]);
        self.misfit = Some(found.misfit);
        for (p, coefficient) in self.coefficients.iter_mut().enumerate() {
            let size = |square: f64| square.max(0.0).sqrt() * seconds[p];
            *coefficient = match found.sigmas[p] {
                Some(sigma) => Coefficient {
                    value: Some(size(found.squares[p])),
                    sigma: Some(sigma / (2.0 * found.squares[p].sqrt()) * seconds[p]),
                    below: None,
                    not_shown: None,
                },
                None => Coefficient { below: Some(size(found.below[p])).filter(|b| b.is_finite()), ..Coefficient::default() },
            };
        }
        self.set_reasons();
        if found.unexplained {
            self.notes.push(Note::Unexplained { misfit: found.misfit });
        } else if found.first > 0 {
            self.notes.push(Note::ShortTimesOmitted { below_s: first as f64 * tau0 });
        }
    }
}
