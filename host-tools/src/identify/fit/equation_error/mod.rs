//! The other way to fit: *equation error*, row by row, along the measured motion (the inverse model by least squares).
//!
//! In: a log with an angle and what drives it, a model. Out: the parameters that explain the drive's torque (or current, or voltage) best,
//! with standard errors, and how much of it stays unexplained, in per cent. The method is that of the robotics people: M. Gautier (1997),
//! "Dynamic identification of robots with power model"; A. Janot, M. Gautier, M. Brunot, EMPS benchmark (2019), "IDIM-LS". The angle passes
//! a Butterworth low-pass of order four, forwards and backwards; central differences make rate and acceleration; what the model needs
//! for them is linear in its parameters. Both sides pass the same low-pass and are thinned out by the same factor, then least squares.
//!
//! It weighs the error otherwise than the free run of [`super::fit`]: every row stands for itself, nothing accumulates; noise of the
//! angle enters the columns and pulls the parameters towards zero (an inertia at a coarse encoder, most). It needs no start
//! values and cannot be lured into a valley. Where the two differ by more than their errors, the model lacks something.
//!
//! Promises: all parameters at once, no descent; what is not linear, or has no part in the inverse model, is refused by name.

mod inverse;
mod motion;
mod zero_phase;

use inverse::{Inverse, Series};
use motion::Motion;
use nalgebra::{DMatrix, DVector};
pub use zero_phase::LowPass;

use super::prepare::{PrepareError, prepare};
use super::{Parameters, build};
use crate::log::Log;
use crate::model::{Channel, Model};

/// How the two sides are filtered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Cutoff before differentiation, Hz. Both sides keep one number per period of it.
    pub cutoff_hz: f64,
}

/// Cutoff where nobody says otherwise, Hz: that of the EMPS benchmark, five times the 20 Hz of its loop.
const USUAL_CUTOFF_HZ: f64 = 100.0;
/// Highest cutoff, of the rows' rate: differences of neighbours know little above it.
const HIGHEST_SHARE: f64 = 0.2;
/// Second filter: its pairs of poles, ripple and cutoff of the thinned rate's half (as in MATLAB's `decimate`, which the authors use).
const THINNING: (u32, f64, f64) = (4, 0.05, 0.8);
/// Left away at the ends of a segment, in periods of the cutoff: what filter and differences make of an end (50 rows in the benchmark).
const ENDS_PERIODS: f64 = 5.0;

impl Settings {
    /// 100 Hz, or a fifth of the rows' rate where that is less.
    pub fn usual(log: &Log) -> Settings {
        Settings { cutoff_hz: USUAL_CUTOFF_HZ.min(HIGHEST_SHARE / log.median_dt_s()) }
    }

    /// A cutoff of the person's choice.
    ///
    /// # Errors
    /// [`InverseModelError`], where it is not between 0 and a fifth of the rows' rate.
    pub fn with_cutoff(log: &Log, cutoff_hz: f64) -> Result<Settings, InverseModelError> {
        let highest = HIGHEST_SHARE / log.median_dt_s();
        if cutoff_hz > 0.0 && cutoff_hz <= highest * (1.0 + 1e-9) {
            return Ok(Settings { cutoff_hz });
        }
        Err(InverseModelError::of(log, InverseModelCause::Cutoff { cutoff_hz, highest_hz: highest }))
    }

    /// Of how many rows one is kept.
    fn thinned(self, dt_s: f64) -> usize {
        ((1.0 / (self.cutoff_hz * dt_s)).round() as usize).max(1)
    }
}

/// Why the equation error of a log cannot be told.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InverseModelError {
    /// The log lacks what the model takes or shows.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The equation itself.
    #[error("{log}: {trouble}")]
    EquationErrorFit {
        /// The log.
        log: String,
        /// What is wrong.
        trouble: InverseModelCause,
    },
}

/// What is wrong with the equation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InverseModelCause {
    /// No angle.
    #[error("no column `theta_rad`: the equation error differentiates the measured angle")]
    NoAngle,
    /// No such cutoff.
    #[error("a cutoff of {cutoff_hz} Hz: it must be above 0 and at most a fifth of the rows' rate, {highest_hz:.4} Hz here")]
    Cutoff {
        /// Asked for.
        cutoff_hz: f64,
        /// Highest.
        highest_hz: f64,
    },
    /// A structure, a reading, or a state of its own.
    #[error(
        "the effect {0} has no place in the equation error, which needs the torque of a measured motion row by row: take it out of the model, or fit by a free run"
    )]
    NotInverse(String),
    /// Not linear.
    #[error(
        "the equation error needs a model that is linear in its parameters; it is not in {0}: give them as {{ value = …, fixed = true }}, or fit by a free run"
    )]
    NotLinear(String),
    /// A parameter without a column.
    #[error("no part in this equation has {0}: fix it, or take its effect out of the model")]
    NoPart(String),
    /// Columns that say the same.
    #[error("along this motion {0} do the same: fix all but one of them")]
    Alike(String),
    /// Too few numbers.
    #[error("{rows} rows stay after filter and ends, too few for {unknowns} free parameters: record longer, or choose a higher cutoff")]
    TooFewRows {
        /// That stay.
        rows: usize,
        /// Free parameters.
        unknowns: usize,
    },
    /// Nothing drives.
    #[error("`{0}` is zero throughout: there is nothing to explain")]
    Nothing(&'static str),
}

impl InverseModelError {
    fn of(log: &Log, trouble: InverseModelCause) -> Self {
        InverseModelError::EquationErrorFit { log: log.path().display().to_string(), trouble }
    }
}

/// A model held against a log by equation error.
#[derive(Debug, Clone)]
pub struct EquationErrorFit {
    /// Parameters, as given or fitted.
    pub parameters: Parameters,
    /// Their standard errors, 0 where fixed or not fitted. The kept rows are taken as independent, as the method's authors do; after the
    /// low-pass they nearly are, what the model lacks is not.
    pub sigmas: Vec<f64>,
    /// What is explained.
    pub explained: Channel,
    /// 100 ‖measured − needed‖/‖measured‖ over the kept rows.
    pub error_percent: f64,
    /// Root mean square of measured − needed over the kept rows, in the unit of what is explained.
    pub rms: f64,
    /// Largest over smallest singular value of the columns, each scaled to length 1.
    pub condition: f64,
    /// Kept rows.
    pub rows: usize,
    /// Of how many rows one was kept.
    pub thinned: usize,
    /// The filter.
    pub settings: Settings,
}

/// The parameters of `model` by least squares along the motion of `log`; start values have no part in it.
///
/// # Errors
/// [`InverseModelError`], in one line.
pub fn fit(log: &Log, model: &Model, settings: Settings) -> Result<EquationErrorFit, InverseModelError> {
    hold(log, model, settings, true)
}

/// How well the parameters of `model` as they are explain what drives `log`.
///
/// # Errors
/// [`InverseModelError`], in one line.
pub fn compare(log: &Log, model: &Model, settings: Settings) -> Result<EquationErrorFit, InverseModelError> {
    hold(log, model, settings, false)
}

fn hold(log: &Log, model: &Model, settings: Settings, fitted: bool) -> Result<EquationErrorFit, InverseModelError> {
    let trouble = |t: InverseModelCause| InverseModelError::of(log, t);
    let angle = log.column("theta_rad").ok_or_else(|| trouble(InverseModelCause::NoAngle))?;
    let (record, _) = prepare(log, model, false)?;
    let (system, parameters) = build::system(model, record.temp_C.is_some());
    inverse::check_effects(model, &system, &parameters, record.temp_C.is_some()).map_err(trouble)?;
    let explained = inverse::explained(&record);
    let given = log.column(explained.column()).unwrap_or(record.input);
    let mean_over_row = !log.provenance(explained.column()).instant;
    let motions: Vec<Motion> =
        (0..record.segments.len()).map(|s| motion::along(&record, s, angle, given, mean_over_row, settings)).collect();
    let still_rad_s = (record.theta_quantum * settings.cutoff_hz).max(f64::MIN_POSITIVE);
    let inverse = Inverse { system: &system, record: &record, motions: &motions, explained, still_rad_s };
    let thinner = Thinner::new(&motions, settings, record.dt_s);
    let measured = thinner.thin(&motions.iter().flat_map(|m| m.given.iter().copied()).collect::<Series>());
    let unknowns = if fitted { parameters.free().len() } else { 0 };
    if measured.len() < 2 * unknowns.max(2) {
        return Err(trouble(InverseModelCause::TooFewRows { rows: measured.len(), unknowns }));
    }
    let norm = |y: &[f64]| y.iter().map(|y| y * y).sum::<f64>().sqrt();
    if norm(&measured) == 0.0 {
        return Err(trouble(InverseModelCause::Nothing(explained.column())));
    }
    let (found, sigmas, condition) = if unknowns > 0 {
        solve(&inverse, &thinner, &parameters, &measured).map_err(trouble)?
    } else {
        (parameters.clone(), vec![0.0; parameters.list.len()], 1.0)
    };
    let needed = thinner.thin(&inverse.need(&found, 1));
    let left: Series = measured.iter().zip(&needed).map(|(m, n)| m - n).collect();
    Ok(EquationErrorFit {
        parameters: found,
        sigmas,
        explained,
        error_percent: 100.0 * norm(&left) / norm(&measured),
        rms: norm(&left) / (left.len() as f64).sqrt(),
        condition,
        rows: measured.len(),
        thinned: thinner.keep,
        settings,
    })
}

/// Singular values below this part of the largest are none.
const SINGULAR: f64 = 1e-8;
/// Share of a direction that the log does not tell from which on a parameter belongs to it.
const BELONGS: f64 = 0.2;

/// Parameters, standard errors and condition number by least squares.
fn solve(
    inverse: &Inverse,
    thinner: &Thinner,
    parameters: &Parameters,
    measured: &[f64],
) -> Result<(Parameters, Vec<f64>, f64), InverseModelCause> {
    let (rest, columns) = inverse.columns(parameters)?;
    let free = parameters.free();
    let rest = thinner.thin(&rest);
    let y = DVector::from_iterator(measured.len(), measured.iter().zip(&rest).map(|(m, r)| m - r));
    let mut x = DMatrix::from_columns(&columns.iter().map(|c| DVector::from_vec(thinner.thin(c))).collect::<Vec<_>>());
    let name = |lane: usize| parameters.list[free[lane]].name.clone();
    let lengths: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    if let Some(lane) = lengths.iter().position(|l| *l == 0.0) {
        return Err(InverseModelCause::NoPart(name(lane)));
    }
    for (mut column, length) in x.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    // Columns of length 1: the squares lose half the digits of a condition number of some tens.
    let eigen = (x.transpose() * &x).symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    if let Some(none) = (0..free.len()).find(|&k| eigen.eigenvalues[k] <= SINGULAR * largest) {
        let members: Vec<String> = (0..free.len()).filter(|&lane| eigen.eigenvectors[(lane, none)].abs() > BELONGS).map(name).collect();
        return Err(InverseModelCause::Alike(members.join(" and ")));
    }
    let inverted = &eigen.eigenvectors * DMatrix::from_diagonal(&eigen.eigenvalues.map(f64::recip)) * eigen.eigenvectors.transpose();
    let scaled = &inverted * (x.transpose() * &y);
    let left = (&y - &x * &scaled).norm_squared() / (measured.len() - free.len()) as f64;
    let coordinates: Vec<f64> = scaled.iter().zip(&lengths).map(|(s, l)| s / l).collect();
    let found = inverse::moved(parameters, &coordinates);
    let natural = DMatrix::from_fn(free.len(), free.len(), |a, b| left * inverted[(a, b)] / (lengths[a] * lengths[b]));
    let sigmas = inverse::sigmas(&found, &natural);
    Ok((found, sigmas, (largest / eigen.eigenvalues.min()).sqrt()))
}

/// The second low-pass, and what is kept after it.
struct Thinner {
    filter: Option<LowPass>,
    keep: usize,
    ends: usize,
    lengths: Vec<usize>,
}

impl Thinner {
    fn new(motions: &[Motion], settings: Settings, dt_s: f64) -> Self {
        let keep = settings.thinned(dt_s);
        let (pairs, ripple_dB, share) = THINNING;
        Thinner {
            filter: (keep > 1).then(|| LowPass::chebyshev(pairs, ripple_dB, share / keep as f64)),
            keep,
            ends: (ENDS_PERIODS / (settings.cutoff_hz * dt_s)).round() as usize,
            lengths: motions.iter().map(|m| m.t_s.len()).collect(),
        }
    }

    /// Of each segment the inner part, low-passed, one of every few.
    fn thin(&self, series: &[f64]) -> Series {
        let mut kept = Series::new();
        let mut from = 0;
        for &length in &self.lengths {
            let segment = &series[from..from + length];
            from += length;
            if length <= 2 * self.ends {
                continue;
            }
            let inner = &segment[self.ends..length - self.ends];
            match &self.filter {
                Some(filter) => kept.extend(filter.both_ways(inner).iter().step_by(self.keep)),
                None => kept.extend(inner),
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests;
