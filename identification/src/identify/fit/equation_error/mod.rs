//! Equation-error fit: least squares of the inverse model along the measured motion, row by row.
//!
//! Input: a log with an angle and the input of the drive, a model. Output: the parameters that explain the torque (or current, or voltage)
//! best, with standard errors, and the unexplained fraction in per cent. The method is that of robot identification: M. Gautier (1997),
//! "Dynamic identification of robots with power model"; A. Janot, M. Gautier, M. Brunot, EMPS benchmark (2019), "IDIM-LS". The angle passes
//! a Butterworth low-pass of order four, forwards and backwards; central differences give rate and acceleration. The inverse model is
//! linear in its parameters. Both sides pass a second low-pass and are decimated by the same factor before the least-squares fit.
//!
//! Differences from the output-error fit of [`super`]: each row has its own error, errors do not accumulate; noise of the angle enters the
//! regressors and biases the parameters towards zero (most an inertia with a coarse encoder). No start values are needed and there are no
//! local minima. If the two fits differ by more than their errors, the model is incomplete.
//!
//! Limits: parameters that are not linear in the inverse model, or not part of it, are refused by name.

mod inverse;
mod motion;
mod zero_phase;

use inverse::{Inverse, Series};
use motion::Motion;
use nalgebra::{DMatrix, DVector};
pub use zero_phase::LowPass;

use super::{Parameters, PreparedLog, build};
use crate::log::Log;
use crate::model::{Channel, Model};
use crate::recording::prepare::{PrepareError, prepare};

/// Settings of the filters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Cutoff of the low-pass before differentiation, Hz. The decimated rows have this rate.
    pub cutoff_hz: f64,
}

/// Default cutoff, Hz: that of the EMPS benchmark, five times the bandwidth of its control loop (20 Hz).
const DEFAULT_CUTOFF_HZ: f64 = 100.0;
/// Highest cutoff relative to the row rate; central differences attenuate higher frequencies.
const MAX_CUTOFF_FRACTION: f64 = 0.2;
/// Decimation filter: pairs of poles, ripple in dB, cutoff relative to half the decimated rate (as MATLAB's `decimate`, which the authors
/// use).
const DECIMATION_FILTER: (u32, f64, f64) = (4, 0.05, 0.8);
/// Rows omitted at the ends of a segment because of transients, in periods of the cutoff (50 rows in the benchmark).
const OMITTED_PERIODS: f64 = 5.0;

impl Settings {
    /// 100 Hz, or a fifth of the row rate if that is less.
    pub fn usual(log: &Log) -> Settings {
        Settings { cutoff_hz: DEFAULT_CUTOFF_HZ.min(MAX_CUTOFF_FRACTION / log.median_dt_s()) }
    }

    /// A given cutoff.
    ///
    /// # Errors
    /// [`InverseModelError`] if the cutoff is not between 0 and a fifth of the row rate.
    pub fn with_cutoff(log: &Log, cutoff_hz: f64) -> Result<Settings, InverseModelError> {
        let highest = MAX_CUTOFF_FRACTION / log.median_dt_s();
        if cutoff_hz > 0.0 && cutoff_hz <= highest * (1.0 + 1e-9) {
            return Ok(Settings { cutoff_hz });
        }
        Err(InverseModelError::of(log, InverseModelCause::Cutoff { cutoff_hz, highest_hz: highest }))
    }

    /// Decimation factor.
    fn decimation(self, dt_s: f64) -> usize {
        ((1.0 / (self.cutoff_hz * dt_s)).round() as usize).max(1)
    }
}

/// Why there is no equation-error fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InverseModelError {
    /// The log lacks a column of the model.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// The inverse model cannot be used.
    #[error("{log}: {cause}")]
    InverseModel {
        /// The log.
        log: String,
        /// The cause.
        cause: InverseModelCause,
    },
}

/// Why the inverse model cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InverseModelCause {
    /// The log has no angle.
    #[error("no column `theta_rad`: the equation-error fit differentiates the measured angle")]
    NoAngle,
    /// The cutoff is out of range.
    #[error("the cutoff of {cutoff_hz} Hz must be above 0 and at most a fifth of the row rate, {highest_hz:.4} Hz")]
    Cutoff {
        /// The given cutoff.
        cutoff_hz: f64,
        /// The highest cutoff.
        highest_hz: f64,
    },
    /// An effect with a change of structure, an error of a reading, or a state.
    #[error(
        "the effect {0} is not part of the inverse model, which computes the torque of a measured motion row by row: remove it from the model, or use the output-error fit"
    )]
    NotInvertible(String),
    /// The setpoint of a servo is the input.
    #[error(
        "the equation-error fit explains a measured voltage, current or torque; the setpoint of a servo is none: use the output-error fit"
    )]
    Servo,
    /// The motor is disconnected in a part of the time.
    #[error(
        "the equation-error fit explains the torque of the motor, and the motor is disconnected in a part of the time: use the output-error fit"
    )]
    Disconnected,
    /// The inverse model is not linear in these parameters.
    #[error(
        "the equation-error fit needs a model that is linear in its parameters, which this model is not in {0}: give them as {{ value = …, fixed = true }}, or use the output-error fit"
    )]
    NotLinear(String),
    /// The parameter has no influence.
    #[error("{0} has no influence in this equation: fix it, or remove its effect from the model")]
    NoInfluence(String),
    /// The regressors of these parameters are linearly dependent.
    #[error("{0} are not distinguishable along this motion: fix all but one of them")]
    Dependent(String),
    /// Too few rows.
    #[error("{rows} rows remain after decimation, too few for {unknowns} free parameters: record a longer log, or choose a higher cutoff")]
    TooFewRows {
        /// Remaining rows.
        rows: usize,
        /// Free parameters.
        unknowns: usize,
    },
    /// The explained column is zero.
    #[error("`{0}` is zero in all rows")]
    Zero(&'static str),
}

impl InverseModelError {
    fn of(log: &Log, cause: InverseModelCause) -> Self {
        InverseModelError::InverseModel { log: log.path().display().to_string(), cause }
    }
}

/// Result of an equation-error fit or comparison.
#[derive(Debug, Clone)]
pub struct EquationErrorFit {
    /// Parameters, as given or fitted.
    pub parameters: Parameters,
    /// Standard errors of the parameters, 0 if fixed or not fitted. The decimated rows are treated as independent, as by the authors of the
    /// method; this holds for the noise, not for the misfit of an incomplete model.
    pub sigmas: Vec<f64>,
    /// The explained channel.
    pub explained: Channel,
    /// 100 ‖measured − modelled‖/‖measured‖ over the decimated rows.
    pub error_percent: f64,
    /// Root mean square of measured − modelled over the decimated rows, in the unit of the channel.
    pub rms: f64,
    /// Condition number of the regressors, each scaled to unit length.
    pub condition: f64,
    /// Number of decimated rows.
    pub rows: usize,
    /// Decimation factor.
    pub decimation: usize,
    /// The settings.
    pub settings: Settings,
}

/// Fits the parameters of `model` by least squares along the motion of `log`. No start values are used.
///
/// # Errors
/// [`InverseModelError`] if log or model are not suitable.
pub fn fit(log: &Log, model: &Model, settings: Settings) -> Result<EquationErrorFit, InverseModelError> {
    let angle = angle(log)?;
    let (data, _) = prepare(log, model, false)?;
    evaluate(log, angle, &data, model, settings, true)
}

/// As [`fit`], for a log that is prepared already; the fit uses all rows, held-out rows included.
///
/// # Errors
/// [`InverseModelError`] if log or model are not suitable.
pub fn fit_prepared(log: &Log, data: &PreparedLog, model: &Model, settings: Settings) -> Result<EquationErrorFit, InverseModelError> {
    evaluate(log, angle(log)?, data, model, settings, true)
}

/// Compares the input of `log` with that required by `model`, with its given parameters.
///
/// # Errors
/// [`InverseModelError`] if log or model are not suitable.
pub fn compare(log: &Log, model: &Model, settings: Settings) -> Result<EquationErrorFit, InverseModelError> {
    let angle = angle(log)?;
    let (data, _) = prepare(log, model, false)?;
    evaluate(log, angle, &data, model, settings, false)
}

/// The angle of `log`, along which the inverse model is evaluated.
///
/// # Errors
/// The log has no angle.
pub fn angle(log: &Log) -> Result<&[f64], InverseModelError> {
    log.column(Channel::Angle.column()).ok_or_else(|| InverseModelError::of(log, InverseModelCause::NoAngle))
}

/// Fit if `fitted`, otherwise comparison.
fn evaluate(
    log: &Log,
    angle: &[f64],
    data: &PreparedLog,
    model: &Model,
    settings: Settings,
    fitted: bool,
) -> Result<EquationErrorFit, InverseModelError> {
    let fail = |cause: InverseModelCause| InverseModelError::of(log, cause);
    let (system, parameters) = build::system(model, data.temp_C.is_some());
    if system.servo.is_some() {
        return Err(fail(InverseModelCause::Servo));
    }
    if data.connected.as_ref().is_some_and(|connected| connected.contains(&0.0)) {
        return Err(fail(InverseModelCause::Disconnected));
    }
    inverse::check_effects(model, &system, &parameters, data.temp_C.is_some()).map_err(fail)?;
    let explained = inverse::explained(data);
    let given = log.column(explained.column()).unwrap_or(&data.input);
    let mean_over_row = !log.provenance(explained.column()).instant;
    let motions: Vec<Motion> = (0..data.segments.len()).map(|s| motion::along(data, s, angle, given, mean_over_row, settings)).collect();
    let resolved_rate_rad_s = (data.theta_quantum * settings.cutoff_hz).max(f64::MIN_POSITIVE);
    let inverse = Inverse { system: &system, data, motions: &motions, explained, resolved_rate_rad_s };
    let decimator = Decimator::new(&motions, settings, data.dt_s);
    let measured = decimator.decimate(&motions.iter().flat_map(|m| m.given.iter().copied()).collect::<Series>());
    let unknowns = if fitted { parameters.free().len() } else { 0 };
    if measured.len() < 2 * unknowns.max(2) {
        return Err(fail(InverseModelCause::TooFewRows { rows: measured.len(), unknowns }));
    }
    let norm = |y: &[f64]| y.iter().map(|y| y * y).sum::<f64>().sqrt();
    if norm(&measured) == 0.0 {
        return Err(fail(InverseModelCause::Zero(explained.column())));
    }
    let (found, sigmas, condition) = if unknowns > 0 {
        solve_within_ranges(&inverse, &decimator, &parameters, &measured).map_err(fail)?
    } else {
        (parameters.clone(), vec![0.0; parameters.list.len()], 1.0)
    };
    let required = decimator.decimate(&inverse.required(&found, 1));
    let left: Series = measured.iter().zip(&required).map(|(m, n)| m - n).collect();
    Ok(EquationErrorFit {
        parameters: found,
        sigmas,
        explained,
        error_percent: 100.0 * norm(&left) / norm(&measured),
        rms: norm(&left) / (left.len() as f64).sqrt(),
        condition,
        rows: measured.len(),
        decimation: decimator.factor,
        settings,
    })
}

/// Relative eigenvalue below which the regressors are linearly dependent.
const MIN_RELATIVE_EIGENVALUE: f64 = 1e-8;
/// Component of a dependent direction above which a parameter belongs to the direction.
const MIN_DIRECTION_COMPONENT: f64 = 0.2;

/// As [`solve`], with every parameter in its physical range: while estimates are outside, the one that is farthest outside in standard
/// errors is held at its bound.
fn solve_within_ranges(
    inverse: &Inverse,
    decimator: &Decimator,
    parameters: &Parameters,
    measured: &[f64],
) -> Result<(Parameters, Vec<f64>, f64), InverseModelCause> {
    let mut held = parameters.clone().within_physical_ranges();
    loop {
        let (mut found, sigmas, condition) = match held.free()[..] {
            [] => (held.clone(), vec![0.0; held.list.len()], 1.0),
            _ => solve(inverse, decimator, &held, measured)?,
        };
        let excess = |k: usize| {
            let p = &found.list[k];
            let (low, high) = p.limits();
            (p.value - p.value.clamp(low, high)).abs() / sigmas[k].max(f64::MIN_POSITIVE)
        };
        let outside = found.free().into_iter().filter(|&k| excess(k) > 0.0).max_by(|&a, &b| excess(a).total_cmp(&excess(b)));
        let Some(k) = outside else {
            for (p, given) in found.list.iter_mut().zip(&parameters.list) {
                p.fixed = given.fixed;
            }
            return Ok((found, sigmas, condition));
        };
        let (low, high) = found.list[k].limits();
        held.list[k].value = found.list[k].value.clamp(low, high);
        held.list[k].fixed = true;
    }
}

/// Parameters, standard errors and condition number by least squares.
fn solve(
    inverse: &Inverse,
    decimator: &Decimator,
    parameters: &Parameters,
    measured: &[f64],
) -> Result<(Parameters, Vec<f64>, f64), InverseModelCause> {
    let (rest, columns) = inverse.columns(parameters)?;
    let free = parameters.free();
    let rest = decimator.decimate(&rest);
    let y = DVector::from_iterator(measured.len(), measured.iter().zip(&rest).map(|(m, r)| m - r));
    let mut x = DMatrix::from_columns(&columns.iter().map(|c| DVector::from_vec(decimator.decimate(c))).collect::<Vec<_>>());
    let name = |index: usize| parameters.list[free[index]].name.clone();
    let lengths: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    if let Some(index) = lengths.iter().position(|l| *l == 0.0) {
        return Err(InverseModelCause::NoInfluence(name(index)));
    }
    for (mut column, length) in x.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    // The columns have unit length: the normal equations are well conditioned.
    let eigen = (x.transpose() * &x).symmetric_eigen();
    let largest = eigen.eigenvalues.max();
    if let Some(none) = (0..free.len()).find(|&k| eigen.eigenvalues[k] <= MIN_RELATIVE_EIGENVALUE * largest) {
        let members: Vec<String> =
            (0..free.len()).filter(|&index| eigen.eigenvectors[(index, none)].abs() > MIN_DIRECTION_COMPONENT).map(name).collect();
        return Err(InverseModelCause::Dependent(members.join(" and ")));
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

/// Decimation of a series by segment.
struct Decimator {
    filter: Option<LowPass>,
    factor: usize,
    omitted: usize,
    lengths: Vec<usize>,
}

impl Decimator {
    fn new(motions: &[Motion], settings: Settings, dt_s: f64) -> Self {
        let factor = settings.decimation(dt_s);
        let (pairs, ripple_dB, share) = DECIMATION_FILTER;
        Decimator {
            filter: (factor > 1).then(|| LowPass::chebyshev(pairs, ripple_dB, share / factor as f64)),
            factor,
            omitted: (OMITTED_PERIODS / (settings.cutoff_hz * dt_s)).round() as usize,
            lengths: motions.iter().map(|m| m.t_s.len()).collect(),
        }
    }

    /// Low-passes the inner part of each segment and keeps one row in `factor`.
    fn decimate(&self, series: &[f64]) -> Series {
        let mut decimated = Series::new();
        let mut from = 0;
        for &length in &self.lengths {
            let segment = &series[from..from + length];
            from += length;
            if length <= 2 * self.omitted {
                continue;
            }
            let inner = &segment[self.omitted..length - self.omitted];
            match &self.filter {
                Some(filter) => decimated.extend(filter.filter_both_ways(inner).iter().step_by(self.factor)),
                None => decimated.extend(inner),
            }
        }
        decimated
    }
}

#[cfg(test)]
mod tests;
