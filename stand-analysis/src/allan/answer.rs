//! Result of an Allan analysis.

use super::time_stamps::TimingNote;
use super::units::{Process, Unit};
use identification::log::LogWarning;
use identification::statistics::uncertainty::{Estimate, Uncertainty};

/// Interpretation of the column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpretation {
    /// The quantity itself: a rate or any other.
    Value,
    /// The integral of the quantity, as an angle is of the rate.
    Integral,
}

/// Reason why a coefficient has no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NotShown {
    /// The record has too few rows to separate the processes.
    TooFewRows {
        /// Rows of the record.
        rows: usize,
    },
    /// The curve reaches zero and cannot be fitted.
    ZeroVariance,
    /// A transient at the beginning would be taken for slow noise.
    Transient,
    /// A slow motion of the level would be taken for slow noise.
    SlowMotion,
    /// The longest averages do not follow the processes.
    LongTimesOmitted,
    /// The least significant bit of the column hides the noise.
    CoarseResolution,
    /// The level steps too often.
    ManySteps,
    /// The coefficient is not significant in this record.
    NotSignificant {
        /// Whether the curve has a minimum within the range that is read (flicker only); `None` for other processes.
        has_minimum: Option<bool>,
    },
}

/// A remark about the record or the fit.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// A warning of the log reader.
    Log(LogWarning),
    /// A remark about the time stamps.
    Timing(TimingNote),
    /// No coefficients.
    NoCoefficients(NotShown),
    /// The level steps; the record is divided there.
    Steps(Vec<LevelStep>),
    /// Wild rows, which were replaced by the level beside them.
    WildRows {
        /// Their number.
        count: usize,
        /// The largest deviation, in the unit of the answer.
        largest: f64,
        /// Allan deviation of single rows with them and without, in the unit of the answer.
        oadev: [f64; 2],
    },
    /// A periodic motion, which was subtracted.
    Periodic {
        /// Period, s.
        period_s: f64,
        /// Amplitude, in the unit of the answer.
        amplitude: f64,
    },
    /// A motion of the level that is no noise, in a record too short to show its course; it was subtracted as a sinusoid.
    SlowMotion {
        /// Amplitude of the sinusoid, in the unit of the answer.
        amplitude: f64,
        /// Its period, s.
        period_s: f64,
    },
    /// The resolution of the column was subtracted from the white noise.
    Resolution {
        /// Its part of the variance of a row.
        part: f64,
    },
    /// A transient at the beginning, which was subtracted; slow noise is not given.
    Transient {
        /// Time constant, s.
        time_constant_s: f64,
        /// Initial deviation, in the unit of the answer.
        size: f64,
        /// Time from which on a twentieth of it is left at most, s.
        from_s: f64,
    },
    /// Flicker noise, random walk and ramp together are significant, none of them alone.
    SlowNoiseTogether,
    /// The five processes do not explain the curve.
    Unexplained {
        /// χ² per degree of freedom.
        misfit: f64,
    },
    /// The longest averaging times were left out of the fit.
    LongTimesOmitted {
        /// Longest averaging time of the fit, s.
        above_s: f64,
    },
    /// The shortest averaging times were left out of the fit.
    ShortTimesOmitted {
        /// Shortest averaging time of the fit, s.
        below_s: f64,
    },
}

/// A step of the level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelStep {
    /// Its time, s.
    pub t_s: f64,
    /// Level behind minus level before, in the unit of the answer.
    pub size: f64,
}

/// One averaging time.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Averaging factor m, rows.
    pub factor: usize,
    /// Averaging time τ, s.
    pub tau_s: f64,
    /// Overlapping Allan deviation, in the unit of the answer.
    pub oadev: f64,
    /// Number of terms of the overlapping deviation.
    pub terms: usize,
    /// Non-overlapping Allan deviation.
    pub adev: f64,
    /// Number of terms of the non-overlapping deviation.
    pub plain_terms: usize,
    /// Equivalent degrees of freedom of the overlapping deviation.
    pub degrees: f64,
    /// 68 % confidence interval of the deviation.
    pub within_68: [f64; 2],
    /// 95 % confidence interval of the deviation.
    pub within_95: [f64; 2],
    /// Deviation of the fitted processes.
    pub fitted: f64,
    /// Index in [`PROCESSES`] of the process with the largest part.
    pub strongest: usize,
}

/// One coefficient, in the unit of the answer and seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Coefficient {
    /// Value with its uncertainty; `None`: not shown by this record. U is the distance to the farther end of `within_95`.
    pub estimate: Option<Estimate>,
    /// Interval of 95 %, by the profile likelihood.
    pub within_95: Option<[f64; 2]>,
    /// Upper limit (95 %) of a coefficient that is not shown.
    pub below: Option<f64>,
    /// Reason if it is not shown.
    pub not_shown: Option<NotShown>,
}

/// The lowest point of the curve up to T/10.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lowest {
    /// Averaging time, s.
    pub tau_s: f64,
    /// Deviation.
    pub oadev: f64,
    /// Deviation / 0.664: bias instability as data sheets define it.
    pub over_floor: f64,
    /// Uncertainty of `over_floor`.
    pub uncertainty: Uncertainty,
    /// The curve rises on both sides; otherwise its floor may be lower.
    pub inside: bool,
}

/// Result of the analysis.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    /// Name of the log.
    pub log: String,
    /// Name of the column.
    pub column: String,
    /// Unit of the deviations.
    pub unit: Unit,
    /// Interpretation of the column.
    pub interpretation: Interpretation,
    /// Number of rows analysed.
    pub rows: usize,
    /// Sampling interval τ₀, s.
    pub interval_s: f64,
    /// Elapsed time per row, s; longer than τ₀ if rows are lost.
    pub elapsed_s: f64,
    /// Number of segments without a gap.
    pub segments: usize,
    /// Number of samples missing in the gaps.
    pub missing: f64,
    /// The time stamps come in bursts.
    pub bursts: bool,
    /// Least significant bit of the column, in its unit.
    pub quantum: Option<f64>,
    /// Range of averaging times that the fit uses, s.
    pub read_s: Option<[f64; 2]>,
    /// χ² per degree of freedom of the fit.
    pub misfit: Option<f64>,
    /// Lowest point of the curve.
    pub lowest: Option<Lowest>,
    /// Points of the curve.
    pub points: Vec<Point>,
    /// Coefficients in the order of [`PROCESSES`].
    pub coefficients: [Coefficient; 5],
    /// Remarks.
    pub notes: Vec<Note>,
}

/// Index of N in [`PROCESSES`].
pub const WHITE: usize = 1;
/// Index of B in [`PROCESSES`].
pub const FLICKER: usize = 2;
/// Indices of B, K and R in [`PROCESSES`]: noise that a transient imitates.
pub const SLOW: [usize; 3] = [2, 3, 4];
/// Index of R in [`PROCESSES`].
pub const RAMP: usize = 4;

impl Answer {
    /// Total duration of the rows, s.
    pub fn duration_s(&self) -> f64 {
        self.rows as f64 * self.interval_s
    }

    /// Factor from the column's unit to degrees and hours; `None` if the column is not a rate.
    pub fn hours(&self, process: &Process) -> Option<f64> {
        self.unit.rad().map(|rad| rad.to_degrees() * process.hours)
    }

    /// Marks all coefficients as not shown.
    pub(super) fn set_no_coefficients(&mut self, reason: NotShown) {
        self.coefficients = std::array::from_fn(|_| Coefficient { not_shown: Some(reason), ..Coefficient::default() });
        self.notes.push(Note::NoCoefficients(reason));
    }

    /// Sets the reason of each coefficient without a value.
    pub(super) fn set_reasons(&mut self) {
        let has_minimum = self.lowest.map(|lowest| lowest.inside);
        for (p, coefficient) in self.coefficients.iter_mut().enumerate().filter(|(_, c)| c.estimate.is_none() && c.not_shown.is_none()) {
            coefficient.not_shown = Some(NotShown::NotSignificant { has_minimum: has_minimum.filter(|_| p == FLICKER) });
        }
    }
}
