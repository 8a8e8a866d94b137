//! An observer on a recorded log: estimated states and learnt moment, beside the truth where the log has it (a simulated log).
//!
//! Input: a log with `angle_sensor_V` (or `alpha_rad`) at a constant interval, the plant, poles and kind of observer; where the current of
//! the torquer acts on the element, `torquer_A` and the moment per current. Output: [`Tracked`]. The observer is the exact discrete form
//! that the firmware runs, in double precision, and starts at the first measured angle. Columns with the names of the states and
//! `moment_N_m` are the truth. Means and rms errors are over the rows after ten time constants of the slowest pole. The uncertainty of the
//! mean moment follows from the scatter of block means; the parameters of the element are taken as exact.

use identification::parameters::NamesParameters;
use std::path::Path;

use hal_sim::peripherals::Noise;
use stand_firmware::board::Hardware;

use super::discrete::held;
use super::exact::Matrix;
use super::vibration_log::{VibrationLogError, column, measured_angle, step_s};
use super::{Design, Disturbance, Plant};
use identification::log::{Column, Format, Log, LogError, Note, Notes};
use identification::statistics::uncertainty::{Estimate, Uncertainty};

/// Column of the true moment, N m.
pub const MOMENT: &str = "moment_N_m";
/// Columns to read beside the standard ones.
pub const COLUMNS: [&str; 7] = ["alpha_rad", "alpha_rate_rad_s", "beta_rad", "beta_rate_rad_s", "y_m", "y_rate_m_s", MOMENT];
/// Time constants of the slowest pole after which the observer has settled to e⁻¹⁰ for a single pole.
const SETTLING_TIME_CONSTANTS: f64 = 10.0;
/// Largest number of block means, and fewest for an uncertainty.
const MAX_BLOCKS: usize = 16;
const MIN_BLOCKS: usize = 4;
/// Shortest block, time constants of the slowest pole: the correlation of neighbouring means is below 1/10.
pub const BLOCK_TIME_CONSTANTS: f64 = 5.0;
/// Gain of the simulated angle sensor, V/rad: ± 33 mrad in the range of the converter.
pub const ANGLE_GAIN_V_RAD: f64 = 50.0;
/// Stream of the noise of the simulated sensor.
const ANGLE_STREAM: u32 = 76;

/// A quantity over the rows.
#[derive(Debug, Clone, PartialEq)]
pub struct TrackedSignal {
    /// Name with its unit.
    pub name: &'static str,
    /// Estimates, one for each row.
    pub estimated: Vec<f64>,
    /// True values.
    pub truth: Option<Vec<f64>>,
    /// Mean of the estimates after settling.
    pub mean: f64,
    /// Mean of the true values, and rms of estimate minus truth, after settling.
    pub against_truth: Option<(f64, f64)>,
}

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct Tracked {
    /// Times of the rows, s.
    pub t_s: Vec<f64>,
    /// Interval of the rows, s.
    pub step_s: f64,
    /// Time from which the observer has settled, s.
    pub settled_s: f64,
    /// The states.
    pub states: Vec<TrackedSignal>,
    /// The learnt moment of an astatic observer.
    pub moment: Option<TrackedSignal>,
    /// Its mean after settling, N m.
    pub mean_moment_N_m: Option<Estimate>,
    /// Rms of measured minus predicted angle after settling, rad.
    pub innovation_rms_rad: f64,
    /// The log has a current of the torquer that is not used.
    pub ignores_torquer: bool,
}

/// Why a log cannot be tracked.
#[derive(Debug, thiserror::Error)]
pub enum TrackError {
    /// The angle or the rows.
    #[error(transparent)]
    Log(#[from] VibrationLogError),
    /// Too short.
    #[error("{log}: {duration_s:.3} s are too short: the observer settles in {settling_s:.3} s, and as much must remain")]
    TooShort {
        /// The log.
        log: String,
        /// Its duration, s.
        duration_s: f64,
        /// Settling time, s.
        settling_s: f64,
    },
    /// A value is not a number.
    #[error("{log}: row {row}: the angle or the current of the torquer is not a number")]
    NotANumber {
        /// The log.
        log: String,
        /// The row, from 1.
        row: usize,
    },
    /// The current is asked for and missing.
    #[error("{log}: the moment of the torquer needs the column torquer_A")]
    NoCurrent {
        /// The log.
        log: String,
    },
    /// The design has no discrete form.
    #[error("the observer has no discrete form")]
    NotDiscrete,
}

impl NamesParameters for TrackError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            TrackError::Log(error) => error.parameters(),
            TrackError::NoCurrent { .. } => vec!["torquer_N_m_A"],
            _ => Vec::new(),
        }
    }
}

/// Interval of the rows of a log, s, for the design of its observer.
///
/// # Errors
/// The rows are not evenly spaced.
pub fn row_interval_s(log: &Log) -> Result<f64, VibrationLogError> {
    step_s(log)
}

impl Design {
    /// Runs the observer over a log. `angle_gain_V_rad` overrides the note of that name; `torquer_N_m_A`: moment per current of
    /// `torquer_A`.
    ///
    /// # Errors
    /// As [`TrackError`].
    pub fn track(&self, log: &Log, angle_gain_V_rad: Option<f64>, torquer_N_m_A: Option<f64>) -> Result<Tracked, TrackError> {
        let name = || log.path().display().to_string();
        let discrete = self.discrete.as_ref().ok_or(TrackError::NotDiscrete)?;
        let (angle, is_measured) = measured_angle(log, angle_gain_V_rad)?;
        let current = column(log, "torquer_A");
        if torquer_N_m_A.is_some() && current.is_none() {
            return Err(TrackError::NoCurrent { log: name() });
        }
        let applied = |k: usize| torquer_N_m_A.zip(current).map_or(0.0, |(per_A, current)| per_A * current[k]);
        if let Some(k) = (0..angle.len()).find(|k| !(angle[*k].is_finite() && applied(*k).is_finite())) {
            return Err(TrackError::NotANumber { log: name(), row: k + 1 });
        }
        let time_constant_s = self.poles.iter().map(|pole| -1.0 / pole.re).fold(0.0, f64::max);
        let t_s = log.t_s().to_vec();
        let (duration_s, settling_s) = (t_s[t_s.len() - 1] - t_s[0], SETTLING_TIME_CONSTANTS * time_constant_s);
        if duration_s < 2.0 * settling_s {
            return Err(TrackError::TooShort { log: name(), duration_s, settling_s });
        }
        let names = self.request.plant.states();
        let size = discrete.gains.len();
        let mut estimates: Vec<Vec<f64>> = vec![Vec::with_capacity(angle.len()); size];
        let mut innovations = Vec::with_capacity(angle.len());
        let mut state = vec![0.0; size];
        state[0] = angle[0];
        for (k, measured) in angle.iter().enumerate() {
            estimates.iter_mut().zip(&state).for_each(|(column, value)| column.push(*value));
            let innovation = measured - state[0];
            innovations.push(innovation);
            let moment = applied(k);
            state = (0..size)
                .map(|i| {
                    let free: f64 = discrete.phi[i].iter().zip(&state).map(|(phi, x)| phi * x).sum();
                    free + discrete.gamma.get(i).copied().unwrap_or(0.0) * moment + discrete.gains[i] * innovation
                })
                .collect();
        }
        let first = t_s.iter().position(|t| t - t_s[0] >= settling_s).unwrap_or(0);
        let of = |values: &[f64]| values[first..].iter().sum::<f64>() / (values.len() - first) as f64;
        let signal = |name: &'static str, estimated: Vec<f64>| {
            // The measured angle is no truth of itself.
            let truth = column(log, name).filter(|_| name != names[0] || is_measured).map(<[f64]>::to_vec);
            let against_truth = truth.as_ref().map(|truth| {
                let squares: Vec<f64> = estimated.iter().zip(truth).map(|(estimate, truth)| (estimate - truth).powi(2)).collect();
                (of(truth), of(&squares).sqrt())
            });
            TrackedSignal { name, mean: of(&estimated), estimated, truth, against_truth }
        };
        let mut columns = estimates.into_iter();
        let states: Vec<TrackedSignal> = names.iter().zip(columns.by_ref()).map(|(name, estimated)| signal(name, estimated)).collect();
        let moment = columns.next().filter(|_| discrete.has_disturbance).map(|estimated| signal(MOMENT, estimated));
        let blocks = |values: &[f64]| block_mean(&values[first..], BLOCK_TIME_CONSTANTS * time_constant_s / discrete.step_s);
        let squares: Vec<f64> = innovations.iter().map(|innovation| innovation * innovation).collect();
        Ok(Tracked {
            settled_s: t_s[first],
            step_s: discrete.step_s,
            mean_moment_N_m: moment.as_ref().map(|moment| blocks(&moment.estimated)),
            innovation_rms_rad: of(&squares).sqrt(),
            ignores_torquer: torquer_N_m_A.is_none() && current.is_some_and(|current| current.iter().any(|i| *i != 0.0)),
            states,
            moment,
            t_s,
        })
    }
}

impl Tracked {
    /// Estimates and truth as a log; estimates are named `hat_…`.
    ///
    /// # Errors
    /// The ending of the path.
    pub fn log(&self, path: &Path) -> Result<Log, LogError> {
        let mut columns = vec![Column { name: "t_s".to_owned(), values: self.t_s.clone() }];
        for signal in self.states.iter().chain(&self.moment) {
            columns.push(Column { name: format!("hat_{}", signal.name), values: signal.estimated.clone() });
            columns.extend(signal.truth.as_ref().map(|truth| Column { name: signal.name.to_owned(), values: truth.clone() }));
        }
        Log::new(path, columns, Notes::default())
    }
}

/// Mean by blocks of at least `shortest` values, with Student's t; no uncertainty with too few blocks.
pub fn block_mean(values: &[f64], shortest: f64) -> Estimate {
    let count = ((values.len() as f64 / shortest.max(1.0)) as usize).min(MAX_BLOCKS);
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    if count < MIN_BLOCKS {
        return Estimate { value: mean, uncertainty: None };
    }
    let means: Vec<f64> =
        values.chunks_exact(values.len() / count).take(count).map(|block| block.iter().sum::<f64>() / block.len() as f64).collect();
    let of_blocks = means.iter().sum::<f64>() / count as f64;
    let variance = means.iter().map(|m| (m - of_blocks).powi(2)).sum::<f64>() / (count - 1) as f64;
    Estimate { value: mean, uncertainty: Some(Uncertainty::student((variance / count as f64).sqrt(), count as f64 - 1.0)) }
}

/// Why a simulated log is not written.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The angle leaves the range of the sensor.
    #[error(
        "the angle leaves the range of the angle sensor, ± {range_mrad:.0} mrad, at {t_s:.3} s; reduce the moment, the angle or the duration"
    )]
    OutOfRange {
        /// Time, s.
        t_s: f64,
        /// Range, mrad.
        range_mrad: f64,
    },
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
}

/// Writes the log of [`free_log`].
///
/// # Errors
/// The angle leaves the range; the log cannot be written.
pub fn simulate_log(plant: &Plant, disturbed: Disturbance, seconds: f64, step_s: f64, seed: u64, path: &Path) -> Result<Log, RecordError> {
    let log = free_log(plant, disturbed, seconds, step_s, seed, path)?;
    log.write(path)?;
    Ok(log)
}

/// A log of the free element under the moment, from the initial angle, as the converter of the stand reads it (noise of one code, rounded),
/// with the true states and the true moment. `path` becomes its name; no file is written.
///
/// # Errors
/// The angle leaves the range; the ending of `path` is wrong.
pub fn free_log(plant: &Plant, disturbed: Disturbance, seconds: f64, step_s: f64, seed: u64, path: &Path) -> Result<Log, RecordError> {
    Format::of(path)?;
    let hardware = Hardware::default();
    let range_V = hardware.angle_zero_code * hardware.angle_V_per_code;
    let code_V = hardware.angle_V_per_code;
    let (phi, gamma) = held(&Matrix::of(&plant.a()), &plant.b(), step_s);
    let phi = phi.rounded();
    let rows = (seconds / step_s).round() as usize + 1;
    let moments = disturbed.moment.series(rows, step_s);
    let mut noise = Noise::new(seed, ANGLE_STREAM, 1.0);
    let names = plant.states();
    let mut state = vec![0.0; names.len()];
    state[0] = disturbed.angle_rad;
    let mut columns: Vec<Vec<f64>> = vec![Vec::with_capacity(rows); names.len() + 3];
    for (k, moment) in moments.into_iter().enumerate() {
        let t_s = k as f64 * step_s;
        let volts = ((ANGLE_GAIN_V_RAD * state[0]) / code_V + noise.draw()).round() * code_V;
        if volts.is_nan() || volts.abs() >= range_V {
            return Err(RecordError::OutOfRange { t_s, range_mrad: 1e3 * range_V / ANGLE_GAIN_V_RAD });
        }
        let row = [t_s, volts].into_iter().chain(state.iter().copied()).chain([moment]);
        columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        state = (0..names.len()).map(|i| phi[i].iter().zip(&state).map(|(phi, x)| phi * x).sum::<f64>() + gamma[i] * moment).collect();
    }
    let all = ["t_s", "angle_sensor_V"].into_iter().chain(names.iter().copied()).chain([MOMENT]);
    let columns = all.zip(columns).map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Ok(Log::new(path, columns, Notes::from_iter([Note::Number("angle_gain_V_rad", ANGLE_GAIN_V_RAD)]))?)
}
