//! A log made ready for a model: which columns are input and outputs, how they were made, what the rig is told besides.

use std::borrow::Cow;

use super::record::{Compared, Record};
use crate::log::{Log, Source, Voltage};
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

/// The record of `log` as `model` compares it, and what a person should know of how.
///
/// # Errors
/// [`PrepareError`], where input or outputs are missing.
pub fn prepare<'a>(log: &'a Log, model: &Model, hold_out: bool) -> Result<(Record<'a>, Vec<String>), PrepareError> {
    let name = || log.path().display().to_string();
    let has = || log.columns().iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
    let mut remarks = Vec::new();
    if log.len() < FEWEST_ROWS {
        let hint = match crate::plausible::fault_that_ended(log) {
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
    let mut compared = Vec::new();
    for channel in channels {
        let column = channel.column();
        let Some(measured) = log.column(column) else {
            return Err(PrepareError::NoOutput { log: name(), column, model: model.name().to_owned(), has: has() });
        };
        let made = log.column_made(column);
        compared.push(Compared {
            shows: channel,
            measured,
            mean_before_s: made.mean_before_s,
            filter_hz: made.filter_hz,
            instant: made.instant && channel == Channel::Current,
            quantum: log.quantum(column),
        });
    }
    let uses = |id: &str| model.effects().iter().any(|e| e.card.id == id);
    if log.voltage() == Voltage::Terminal {
        for id in ["dead-time", "supply-droop"].into_iter().filter(|id| uses(id)) {
            remarks.push(format!("u_V was measured at the motor's terminals, behind the bridge: {id} cannot be seen in this log"));
        }
    }
    let supply_ratio = uses("supply-droop").then(|| supply_ratio(log)).flatten();
    let theta = log.column("theta_rad");
    let dt_s = log.median_dt_s();
    let record = Record {
        t_s: log.t_s(),
        input,
        driven: model.input(),
        theta,
        theta_quantum: theta.and_then(|_| log.quantum("theta_rad")).unwrap_or(0.0),
        current: log.column("i_A"),
        temp_C: log.column("temp_C").map(Cow::Borrowed),
        supply_ratio,
        rate_from_encoder: log.column_made("omega_rad_s").source == Source::Encoder,
        segments: log.segments(),
        channels: compared,
        dt_s,
        hold_out: hold_out && log.duration_s() >= SHORTEST_HELD_OUT_S,
    };
    Ok((record, remarks))
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
fn supply_ratio(log: &Log) -> Option<Cow<'_, [f64]>> {
    let supply = log.column("supply_V")?;
    let nominal = match log.note("supply_nominal_V").and_then(|n| n.trim().parse::<f64>().ok()) {
        Some(nominal) => nominal,
        None => supply.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    };
    let mean = supply.iter().sum::<f64>() / supply.len() as f64;
    let spread = (supply.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / supply.len() as f64).sqrt();
    (nominal > 0.0 && spread > SUPPLY_MOVES * mean).then(|| supply.iter().map(|s| s / nominal).collect::<Vec<_>>().into())
}
