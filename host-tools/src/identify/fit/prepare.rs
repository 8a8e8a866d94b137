//! A log made ready for a model: which columns are input and outputs, how they were made, what the rig is told besides.

use std::sync::Arc;

use super::prepared_log::{ComparedChannel, PreparedLog};
use drive_model::{Card, Requirement};

use crate::log::{Log, RateSource, VoltageSource};
use crate::model::{Channel, Input, Model};

/// Why a model cannot be held against a log.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// The input is no column.
    #[error("{log}: no column `{column}`, which is the input of {model}; the log has {has}")]
    NoInput {
        /// The log.
        log: String,
        /// The column.
        column: &'static str,
        /// The model.
        model: String,
        /// Columns of the log.
        has: String,
    },
    /// An output is no column.
    #[error("{log}: no column `{column}`, which {model} names as an output; the log has {has}")]
    NoOutput {
        /// The log.
        log: String,
        /// The column.
        column: &'static str,
        /// The model.
        model: String,
        /// Columns of the log.
        has: String,
    },
    /// Nothing can be compared.
    #[error("{log}: none of {wanted} is a column, so that nothing can be compared with {model}; the log has {has}")]
    NothingToCompare {
        /// The log.
        log: String,
        /// What could be.
        wanted: String,
        /// The model.
        model: String,
        /// Columns of the log.
        has: String,
    },
    /// Too short.
    #[error("{log}: {rows} rows are too few to hold a model against; {hint}")]
    TooShort {
        /// The log.
        log: String,
        /// Its rows.
        rows: usize,
        /// What to do, or what ended it.
        hint: String,
    },
}

/// A log has fewer rows than this: nothing can be said.
const FEWEST_ROWS: usize = 20;
/// A log shorter than this is not held out from: the fit needs what there is.
const SHORTEST_HELD_OUT_S: f64 = 6.0;
/// A supply that moves less than this part is called constant.
const SUPPLY_MOVES: f64 = 1e-3;

/// Checks that [`prepare`] can prepare `log` for `model`.
///
/// # Errors
/// [`PrepareError`], where input or outputs are missing.
pub fn check(log: &Log, model: &Model) -> Result<(), PrepareError> {
    columns(log, model).map(|_| ())
}

/// The input column, and the compared channels with their columns.
type Columns<'a> = (&'a [f64], Vec<(Channel, &'a [f64])>);

fn columns<'a>(log: &'a Log, model: &Model) -> Result<Columns<'a>, PrepareError> {
    let name = || log.path().display().to_string();
    let has = || log.columns().iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    if log.len() < FEWEST_ROWS {
        let hint = match crate::log::plausible::fault_that_ended(log) {
            Some(fault) => format!("a fault ended it early ({fault})"),
            None => "record at least some hundred".to_owned(),
        };
        return Err(PrepareError::TooShort { log: name(), rows: log.len(), hint });
    }
    let input_column = model.input().column();
    let Some(input) = log.column(input_column) else {
        return Err(PrepareError::NoInput { log: name(), column: input_column, model: model.name().to_owned(), has: has() });
    };
    let channels: Vec<Channel> = match model.outputs() {
        Some(outputs) => outputs.to_vec(),
        None => default_outputs(log, model),
    };
    if channels.is_empty() {
        let wanted = model.input().outputs().iter().map(|c| c.column()).collect::<Vec<_>>().join(", ");
        return Err(PrepareError::NothingToCompare { log: name(), wanted, model: model.name().to_owned(), has: has() });
    }
    let measured = |channel: Channel| {
        let column = channel.column();
        let missing = || PrepareError::NoOutput { log: name(), column, model: model.name().to_owned(), has: has() };
        log.column(column).map(|measured| (channel, measured)).ok_or_else(missing)
    };
    Ok((input, channels.into_iter().map(measured).collect::<Result<_, _>>()?))
}

/// The record of `log` as `model` compares it, and what a person should know of how.
///
/// # Errors
/// [`PrepareError`], where input or outputs are missing.
pub fn prepare<'a>(log: &'a Log, model: &Model, hold_out: bool) -> Result<(PreparedLog<'a>, Vec<String>), PrepareError> {
    let (input, columns) = columns(log, model)?;
    let mut remarks = Vec::new();
    let compared = columns
        .into_iter()
        .map(|(channel, measured)| {
            let made = log.provenance(channel.column());
            ComparedChannel {
                channel,
                measured,
                mean_before_s: made.mean_before_s,
                filter_hz: made.filter_hz,
                instant: made.instant && channel == Channel::Current,
                quantum: log.quantization_step(channel.column()),
            }
        })
        .collect();
    if log.voltage() == VoltageSource::Terminals {
        let invisible = |card: &&Card| card.requires.contains(&Requirement::CommandedVoltage);
        for id in model.effects().iter().map(|e| e.card).filter(invisible).map(|card| card.id) {
            remarks.push(format!("u_V was measured at the motor's terminals, behind the bridge: {id} cannot be seen in this log"));
        }
    }
    let supply_ratio = model.effects().iter().any(|e| e.card.uses_supply).then(|| supply_ratio(log)).flatten();
    let theta = log.column("theta_rad");
    let dt_s = log.median_dt_s();
    let record = PreparedLog {
        t_s: log.t_s(),
        input,
        driven: model.input(),
        theta,
        theta_quantum: theta.and_then(|_| log.quantization_step("theta_rad")).unwrap_or(0.0),
        current: log.column("i_A"),
        temp_C: log.column("temp_C").map(|t| slow(t, &log.segments(), dt_s).into()),
        supply_ratio,
        rate_from_encoder: log.provenance("omega_rad_s").source == RateSource::Encoder,
        segments: log.segments(),
        channels: compared,
        dt_s,
        hold_out: hold_out && log.duration_s() >= SHORTEST_HELD_OUT_S,
    };
    Ok((record, remarks))
}

/// What a row differs from the mean of this long about it is the sensor's noise, s: a small motor at its limits warms by some kelvin a second.
const TEMPERATURE_S: f64 = 0.1;

/// A temperature without its sensor's noise: the mean over [`TEMPERATURE_S`] about each row, over less towards the ends of a segment so that it stays about the
/// row. A model that takes the readings as they are comes out less dependent on the temperature than the drive is, by the noise's share of their variance.
fn slow(readings: &[f64], segments: &[std::ops::Range<usize>], dt_s: f64) -> Vec<f64> {
    let half = (0.5 * TEMPERATURE_S / dt_s) as usize;
    let mut smooth = readings.to_vec();
    for rows in segments {
        let mut sums = Vec::with_capacity(rows.len() + 1);
        sums.push(0.0);
        for v in &readings[rows.clone()] {
            sums.push(sums[sums.len() - 1] + v);
        }
        for k in 0..rows.len() {
            let reach = half.min(k).min(rows.len() - 1 - k);
            smooth[rows.start + k] = (sums[k + reach + 1] - sums[k - reach]) / (2 * reach + 1) as f64;
        }
    }
    smooth
}

/// What the log has of what the model can show; under a prescribed motion a current or torque, and the voltage only if the model has
/// a winding.
fn default_outputs(log: &Log, model: &Model) -> Vec<Channel> {
    let there = |c: &Channel| log.column(c.column()).is_some();
    let all = model.input().outputs().iter().copied().filter(there);
    match model.input() {
        Input::Motion => all
            .filter(|c| *c != Channel::Voltage || model.index("resistance_ohm").is_some())
            .filter(|c| *c != Channel::Current || model.index("motor_constant_N_m_A").is_some())
            .collect(),
        _ => all.collect(),
    }
}

/// Supply over its nominal value, where it is measured and moves.
fn supply_ratio(log: &Log) -> Option<Arc<[f64]>> {
    let supply = log.column("supply_V")?;
    let nominal = match log.notes().number("supply_nominal_V") {
        Some(nominal) => nominal,
        None => supply.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    };
    let mean = supply.iter().sum::<f64>() / supply.len() as f64;
    let spread = (supply.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / supply.len() as f64).sqrt();
    (nominal > 0.0 && spread > SUPPLY_MOVES * mean).then(|| supply.iter().map(|s| s / nominal).collect::<Vec<_>>().into())
}

#[cfg(test)]
mod tests {
    use super::slow;

    #[test]
    fn a_temperature_loses_its_noise_and_keeps_its_slope_up_to_the_ends_of_each_segment() {
        let ramp = |k: usize| 25.0 + 1e-3 * k as f64;
        let noise = |k: usize| if k.is_multiple_of(2) { 0.05 } else { -0.05 };
        // A gap after row 2000, over which the winding has cooled.
        let readings: Vec<f64> = (0..5000).map(|k| ramp(k) + noise(k) - if k < 2000 { 0.0 } else { 3.0 }).collect();
        let smooth = slow(&readings, &[0..2000, 2000..5000], 1e-3);
        for (k, value) in smooth.iter().enumerate() {
            let to_the_end = k.min(1999_usize.wrapping_sub(k)).min(k.wrapping_sub(2000)).min(4999 - k);
            let off = (value - ramp(k) + if k < 2000 { 0.0 } else { 3.0 }).abs();
            assert!(off <= 0.05 / (2 * to_the_end.min(50) + 1) as f64 + 1e-9, "row {k}: off by {off} K");
        }
        // Rows that are further apart than a winding takes to warm are left alone.
        assert_eq!(slow(&[1.0, 5.0, 2.0], std::slice::from_ref(&(0..3)), 2.0), [1.0, 5.0, 2.0]);
    }
}
