//! The request: reads a column of a log and analyses it.

use std::ops::Range;
use std::path::PathBuf;

use super::answer::{Answer, Coefficient, Interpretation, LevelStep, Lowest, NotShown, Note, Point, RAMP, SLOW, WHITE};
use super::confidence::{Covariance, Squares, expected, interval, parts};
use super::curve::{Curve, Shape};
use super::deviation::{Series, Variance};
use super::disturbances::{Disturbances, MAX_STEPS, Rows, disturbances, without_steps};
use super::error::Still;
use super::noise::{self, MIN_POINTS};
use super::spectral_lines::{SpectralLine, remove_lines};
use super::time_stamps::{Steps, Timing};
use super::units::Unit;
use super::wild_rows::WildRows;
use super::{AllanError, FLOOR, MAX_RELATIVE_TAU};
use identification::deadline::Deadline;
use identification::log::{Log, LogError, OneColumn, times};
use identification::statistics::uncertainty::{Estimate, Uncertainty};

/// Minimum number of rows for one deviation.
const MIN_ROWS: usize = 3;
/// Time constants after which a transient has decayed to a twentieth.
const TRANSIENT_TIME_CONSTANTS: f64 = 3.0;
/// Periods from which on a sinusoid is called periodic, and does not hide slow noise.
const MIN_PERIODS: f64 = 3.0;
/// Least significant bits of a row's standard deviation from which on the error of rounding is white and independent of the noise: the
/// variance of the rounded rows is then that of the noise and q²/12 to 0.1 % (Sheppard's correction; Widrow and Kollár, Quantization Noise,
/// 2008, chapter 5).
const MAX_QUANTUM_PER_SIGMA: f64 = 1.5;
/// Most values of a column that takes few, and the deviation of one from its level, in steps.
const MAX_COARSE_LEVELS: usize = 20;
/// Rows within which it takes so few: over more its level may drift. A level is taken many times: a few rows of any column have few values.
const COARSE_ROWS: usize = 10_000;
const MIN_ROWS_PER_LEVEL: usize = 20;
const MAX_LEVEL_DEVIATION: f64 = 0.05;
/// Part of the variance of a row by rounding from which on it is mentioned.
const MIN_MENTIONED_PART: f64 = 1e-3;
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

/// A column that was read.
pub struct Recorded {
    column: OneColumn,
    timing: Timing,
}

impl Request {
    /// Reads the column and analyses it.
    ///
    /// # Errors
    /// Unreadable log, missing column, too few rows, constant column.
    pub fn answer(&self) -> Result<Answer, AllanError> {
        self.analyse(self.read()?, Deadline::NEVER)
    }

    /// Analyses a column that was read, ended by a deadline between its parts: of 10⁷ rows each takes less than a second.
    ///
    /// # Errors
    /// Too few rows, constant column; [`AllanError::Interrupted`] after the deadline.
    pub fn analyse(&self, recorded: Recorded, deadline: Deadline) -> Result<Answer, AllanError> {
        let check = || if deadline.has_passed() { Err(AllanError::Interrupted) } else { Ok(()) };
        check()?;
        let name = self.log.display().to_string();
        let Recorded { column, timing } = recorded;
        let quantum = column.quantization_step().or_else(|| column.values.chunks(COARSE_ROWS).find_map(coarse_step));
        let mut unit = Unit::of(&self.column);
        let interpretation = self.interpretation.unwrap_or(if unit.is_angle() { Interpretation::Integral } else { Interpretation::Value });
        let rows = column.values.len();
        let still = |why: Still| AllanError::Still { log: name.clone(), column: self.column.clone(), why };
        if column.values.iter().all(|v| *v == column.values[0]) {
            return Err(still(Still::Constant(column.values[0])));
        }
        let mut notes: Vec<Note> = column.warnings.into_iter().map(Note::Log).collect();
        notes.extend(timing.notes.iter().copied().map(Note::Timing));
        let mut values = column.values;
        let wild = WildRows::of(&values, interpretation, &timing.segments, quantum);
        let single_rows = |values: &[f64]| (wild.count() > 0).then(|| single_rows(values, interpretation, &timing.segments));
        let with_wild = single_rows(&values);
        wild.remove(&mut values, interpretation, &timing.segments);
        let without_wild = single_rows(&values);
        check()?;
        let lines = remove_lines(&mut values, interpretation, &timing.segments);
        check()?;
        let disturbances = disturbances(Rows::new(&values, interpretation), &timing.segments);
        disturbances.remove_curves(&mut values, interpretation);
        check()?;
        let segments = without_steps(&timing.segments, &disturbances.steps);
        let disturbances = Reported::new(&disturbances, &lines, &timing, interpretation);
        notes.extend(with_wild.zip(without_wild).map(|(with, without)| Note::WildRows {
            count: wild.count(),
            largest: wild.largest() * disturbances.unit,
            oadev: [with, without].map(|size| size * disturbances.unit),
        }));
        notes.extend(disturbances.notes());
        let series = match interpretation {
            Interpretation::Value => Series::of_rates(values, &segments),
            Interpretation::Integral => {
                unit = unit.per_second();
                Series::of_angles(values, &segments, timing.interval_s)
            }
        };
        // A segment has one more angle than rates.
        let more = usize::from(interpretation == Interpretation::Value);
        let lengths = lengths(&segments, more);
        if series.largest_factor() == 0 {
            let rows = segments.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
            return Err(AllanError::Gaps { log: name, rows });
        }
        let shown = factors(self.taus, series.largest_factor());
        let octaves = factors(Taus::Octave, series.largest_factor());
        let mut all = [&shown[..], &octaves[..]].concat();
        all.sort_unstable();
        all.dedup();
        check()?;
        let overlapping = series.overlapping(&all);
        check()?;
        if overlapping.iter().all(|v| v.variance == 0.0) {
            return Err(still(Still::StraightLine));
        }
        let up_to = (MAX_RELATIVE_TAU * rows as f64) as usize;
        let read: Vec<Variance> = overlapping.iter().filter(|v| octaves.contains(&v.factor) && v.factor <= up_to).copied().collect();
        let found = noise::fit(&read, &lengths);
        check()?;
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
            elapsed_s: timing.elapsed_s,
            segments: segments.len(),
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
            Some(_) if interpretation == Interpretation::Value && quantum.is_some_and(|q| is_hidden(q, white[WHITE])) => {
                answer.set_no_coefficients(NotShown::CoarseResolution);
            }
            Some(found) => {
                let factors =
                    [read[found.used.start].factor, if found.used.end < read.len() { read[found.used.end - 1].factor } else { up_to }];
                let rounding = quantum.filter(|_| interpretation == Interpretation::Value).map_or(0.0, |q| q * q / 12.0);
                answer.set_coefficients(
                    &found,
                    Circumstances { factors, rounding, omits_long: found.used.end < read.len(), disturbances: &disturbances },
                );
            }
            None => {
                answer.set_no_coefficients(if read.len() < MIN_POINTS { NotShown::TooFewRows { rows } } else { NotShown::ZeroVariance })
            }
        }
        Ok(answer)
    }

    /// Reads the column within the window, with the timing of its rows.
    ///
    /// # Errors
    /// Unreadable log, missing column, a window without rows.
    pub fn read(&self) -> Result<Recorded, AllanError> {
        let read_times = |on_time: &mut dyn FnMut(f64)| times(&self.log, on_time);
        self.recorded(read_times, |on_time| OneColumn::read(&self.log, &self.column, on_time))
    }

    /// The column of a log in memory.
    ///
    /// # Errors
    /// As [`Request::read`].
    pub fn take(&self, log: &Log) -> Result<Recorded, AllanError> {
        let give_times = |on_time: &mut dyn FnMut(f64)| log.t_s().iter().for_each(|t_s| on_time(*t_s));
        let read_times = |on_time: &mut dyn FnMut(f64)| {
            give_times(on_time);
            Ok(())
        };
        self.recorded(read_times, |on_time| {
            give_times(on_time);
            OneColumn::of(log, &self.column)
        })
    }

    fn recorded(
        &self,
        times: impl FnOnce(&mut dyn FnMut(f64)) -> Result<(), LogError>,
        column: impl FnOnce(&mut dyn FnMut(f64)) -> Result<OneColumn, LogError>,
    ) -> Result<Recorded, AllanError> {
        let name = self.log.display().to_string();
        if self.column == "t_s" {
            return Err(AllanError::Time { log: name });
        }
        let (from_s, to_s) = (self.from_s.unwrap_or(f64::NEG_INFINITY), self.to_s.unwrap_or(f64::INFINITY));
        if from_s.is_nan() || to_s.is_nan() || from_s >= to_s {
            return Err(AllanError::Window { from_s, to_s });
        }
        let mut steps = Steps::new([from_s, to_s]);
        times(&mut |t_s| steps.push(t_s))?;
        let within = steps.rows();
        let mut marks = steps.marks();
        let mut column = column(&mut |t_s| marks.push(t_s))?;
        column.values.truncate(within.end);
        column.values.drain(..within.start);
        if within.len() < MIN_ROWS {
            let window = if self.from_s.or(self.to_s).is_some() { format!(" from {from_s} s to {to_s} s") } else { String::new() };
            return Err(AllanError::Short { log: name, rows: within.len(), window, minimum: MIN_ROWS });
        }
        Ok(Recorded { column, timing: marks.timing() })
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
        uncertainty: {
            let u = (point.within_68[1] - point.within_68[0]) / 2.0 / FLOOR;
            let expanded = (point.within_95[1] - point.oadev).max(point.oadev - point.within_95[0]) / FLOOR;
            Uncertainty { u, dof: point.degrees, k: expanded / u }
        },
        inside: place > 0 && place + 1 < read.count(),
    })
}

/// The step of a column that takes few values, all of them multiples of it apart: a coarse converter, as its sensor is at rest.
fn coarse_step(values: &[f64]) -> Option<f64> {
    let mut levels: Vec<f64> = Vec::new();
    for value in values {
        if !levels.contains(value) {
            levels.push(*value);
            if levels.len() > MAX_COARSE_LEVELS {
                return None;
            }
        }
    }
    if values.len() < MIN_ROWS_PER_LEVEL * levels.len() {
        return None;
    }
    levels.sort_unstable_by(f64::total_cmp);
    let spacings: Vec<f64> = levels.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = spacings.iter().copied().min_by(f64::total_cmp)?;
    spacings.iter().all(|spacing| (spacing / step - (spacing / step).round()).abs() < MAX_LEVEL_DEVIATION).then_some(step)
}

/// Allan deviation of single rows, in the unit of the rate per interval of the rows for angles.
fn single_rows(values: &[f64], interpretation: Interpretation, segments: &[Range<usize>]) -> f64 {
    let series = match interpretation {
        Interpretation::Value => Series::of_rates(values.to_vec(), segments),
        Interpretation::Integral => Series::of_angles(values.to_vec(), segments, 1.0),
    };
    series.overlapping(&[1])[0].variance.sqrt()
}

/// The least significant bit hides the noise of the rows, of which this is the variance.
fn is_hidden(quantum: f64, variance: f64) -> bool {
    let noise = variance - quantum * quantum / 12.0;
    quantum * quantum > MAX_QUANTUM_PER_SIGMA * MAX_QUANTUM_PER_SIGMA * noise
}

/// Disturbances in seconds and in the unit of the answer.
struct Reported {
    steps: Vec<LevelStep>,
    curves: Vec<Note>,
    /// Factor to the unit of the answer.
    unit: f64,
    /// A transient was subtracted.
    transient: bool,
    /// A slow motion was subtracted of which the record has few periods.
    slow_motion: bool,
    /// The level has a slope, as far as known.
    has_slope: bool,
}

impl Reported {
    fn new(found: &Disturbances, lines: &[SpectralLine], timing: &Timing, interpretation: Interpretation) -> Self {
        // An angle's steps are changes of its increment per row.
        let unit = match interpretation {
            Interpretation::Value => 1.0,
            Interpretation::Integral => 1.0 / timing.interval_s,
        };
        let time_s = |row: f64| timing.first_s + row * timing.elapsed_s;
        let rows = timing.segments.last().map_or(0, |segment| segment.end);
        let is_slow = |curve: &Curve| matches!(curve.shape, Shape::Sinusoid { rows: period } if MIN_PERIODS * period > rows as f64);
        let note = |curve: &Curve| match curve.shape {
            Shape::Exponential { rows } => Note::Transient {
                time_constant_s: rows * timing.elapsed_s,
                size: curve.size() * unit,
                from_s: time_s(TRANSIENT_TIME_CONSTANTS * rows),
            },
            Shape::Sinusoid { rows } => {
                let (period_s, amplitude) = (rows * timing.elapsed_s, curve.size() * unit);
                if is_slow(curve) { Note::SlowMotion { amplitude, period_s } } else { Note::Periodic { period_s, amplitude } }
            }
        };
        let line = |line: &SpectralLine| Note::Periodic { period_s: line.rows * timing.elapsed_s, amplitude: line.amplitude * unit };
        Self {
            steps: found.steps.iter().map(|step| LevelStep { t_s: time_s(step.row as f64), size: step.size * unit }).collect(),
            curves: lines.iter().map(line).chain(found.curves.iter().map(note)).collect(),
            unit,
            transient: found.curves.iter().any(|curve| matches!(curve.shape, Shape::Exponential { .. })),
            slow_motion: found.curves.iter().any(is_slow),
            has_slope: found.has_slope.unwrap_or(true),
        }
    }

    fn notes(&self) -> Vec<Note> {
        let steps = (!self.steps.is_empty()).then(|| Note::Steps(self.steps.clone()));
        steps.into_iter().chain(self.curves.iter().cloned()).collect()
    }

    /// Why B, K and R are not given.
    fn hides_slow_noise(&self) -> Option<NotShown> {
        let many_steps = (self.steps.len() >= MAX_STEPS).then_some(NotShown::ManySteps);
        let slow_motion = || self.slow_motion.then_some(NotShown::SlowMotion);
        many_steps.or_else(|| self.transient.then_some(NotShown::Transient)).or_else(slow_motion)
    }
}

/// What the coefficients depend on besides the fit.
struct Circumstances<'d> {
    /// Shortest and longest averaging factor of the fit.
    factors: [usize; 2],
    /// Variance of a row by rounding.
    rounding: f64,
    /// The longest averages are not used.
    omits_long: bool,
    disturbances: &'d Reported,
}

impl Answer {
    /// Sets the coefficients, converted from rows to seconds.
    fn set_coefficients(&mut self, found: &noise::Found, circumstances: Circumstances) {
        let Circumstances { factors: [shortest, longest], rounding, omits_long, disturbances } = circumstances;
        let (tau0, elapsed) = (self.interval_s, self.elapsed_s);
        // Factors of the coefficients, not of their squares. White noise belongs to a row, slow noise to the elapsed time.
        let seconds = [tau0, tau0.sqrt(), 1.0, 1.0 / elapsed.sqrt(), 1.0 / elapsed];
        self.read_s = Some([shortest as f64 * tau0, longest as f64 * tau0]);
        self.misfit = Some(found.misfit);
        let hidden = disturbances.hides_slow_noise().or_else(|| omits_long.then_some(NotShown::LongTimesOmitted));
        // A ramp is a constant slope, which the rows show themselves.
        let is_shown = |p: usize| p != RAMP || disturbances.has_slope;
        for (p, coefficient) in self.coefficients.iter_mut().enumerate() {
            let of_rounding = if p == WHITE { rounding } else { 0.0 };
            let size = |square: f64| (square - of_rounding).max(0.0).sqrt() * seconds[p];
            let limit = || Some(size(found.below[p])).filter(|below| below.is_finite());
            *coefficient = match (
                found.intervals[p].filter(|_| is_shown(p) && found.squares[p] > of_rounding),
                hidden.filter(|_| SLOW.contains(&p)),
            ) {
                (_, Some(reason)) => Coefficient { not_shown: Some(reason), ..Coefficient::default() },
                (Some(intervals), None) => {
                    let value = size(found.squares[p]);
                    let ends = |range: [f64; 2]| range.map(size);
                    let ([low, high], within_95) = (ends(intervals.within_68), ends(intervals.within_95));
                    let u = 0.5 * (high - low);
                    let expanded = (within_95[1] - value).max(value - within_95[0]);
                    // A variance with ν degrees of freedom: u(√s)/√s = 1/√(2 ν).
                    let uncertainty = Uncertainty { u, dof: 0.5 * (value / u).powi(2), k: expanded / u };
                    let is_known = u > 0.0 && expanded.is_finite();
                    let estimate = Estimate { value, uncertainty: is_known.then_some(uncertainty) };
                    Coefficient { estimate: Some(estimate), within_95: is_known.then_some(within_95), below: None, not_shown: None }
                }
                (None, None) => Coefficient { below: limit(), ..Coefficient::default() },
            };
        }
        let part = rounding / found.squares[WHITE];
        if part > MIN_MENTIONED_PART && self.coefficients[WHITE].estimate.is_some() {
            self.notes.push(Note::Resolution { part });
        }
        self.set_reasons();
        let slow = || SLOW.iter().map(|p| &self.coefficients[*p]);
        if found.slow_noise && hidden.is_none() && slow().all(|coefficient| coefficient.estimate.is_none()) {
            self.notes.push(Note::SlowNoiseTogether);
        }
        if found.unexplained {
            self.notes.push(Note::Unexplained { misfit: found.misfit });
        }
        if shortest > 1 {
            self.notes.push(Note::ShortTimesOmitted { below_s: shortest as f64 * tau0 });
        }
        if omits_long {
            self.notes.push(Note::LongTimesOmitted { above_s: longest as f64 * tau0 });
        }
    }
}
