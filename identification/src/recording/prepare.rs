//! Preparation of a log for a model: selection of input and outputs, notes on the columns, temperature and supply.

use crate::parameters::NamesParameters;
use std::sync::Arc;

use super::angle_jumps::angle_jumps;
use super::known_motion::{self, KnownMotion, MeasuredAngle};
use super::prepared_log::{self, ComparedChannel, PreparedLog, held_out_rows};
use super::voltage::{self, InputTiming, Known, VoltageCourse};
use drive_model::{Card, Requirement};

use crate::budget::Budget;
use crate::log::{Axis, Log, MIN_SEGMENT_ROWS, RateSource, VoltageSource, rows_at_limits};
use crate::model::{BaseParameter, Channel, Input, Model};

/// Why a log cannot be used with a model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PrepareError {
    /// The input of the model is not a column of the log.
    #[error("{log}: no column `{column}`, the input of {model}; the log has {has}")]
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
    /// A column that an expression of the model uses is not in the log.
    #[error("{log}: no column `{column}`, which expressions of {model} use; the log has {has}")]
    NoExpressionColumn {
        /// The log.
        log: String,
        /// The column.
        column: String,
        /// The model.
        model: String,
        /// Columns of the log.
        has: String,
    },
    /// An output of the model is not a column of the log.
    #[error("{log}: no column `{column}`, an output of {model}; the log has {has}")]
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
    /// The log has no output of the model.
    #[error("{log}: no column that {model} can be compared with ({wanted}); the log has {has}")]
    NothingToCompare {
        /// The log.
        log: String,
        /// Possible outputs.
        wanted: String,
        /// The model.
        model: String,
        /// Columns of the log.
        has: String,
    },
    /// The bridge coasts in the off time of the PWM, and the log does not state its supply.
    #[error(
        "{log}: a bridge that coasts connects the motor for u_V/supply of the time, and the log has no supply: a column supply_V, or the note supply_nominal_V: 12"
    )]
    CoastingWithoutSupply {
        /// The log.
        log: String,
    },
    /// The motor is disconnected while its motion is prescribed.
    #[error(
        "{log}: the motor is disconnected in a part of the log (open_circuit): {model} cannot tell what it would need for the measured motion there"
    )]
    DisconnectedMotion {
        /// The log.
        log: String,
        /// The model.
        model: String,
    },
    /// The bridge of a servo coasts; its voltage is not measured.
    #[error("{log}: the note that the bridge coasts is not supported with the setpoint of a servo as the input ({model})")]
    CoastingServo {
        /// The log.
        log: String,
        /// The model.
        model: String,
    },
    /// The model is that of a linear axis, and the log is not.
    #[error(
        "{log}: its columns are those of a rotary drive, {model} is of a linear axis: name its columns x_m, v_m_s, force_N, or state the note axis: linear"
    )]
    RotaryLog {
        /// The log.
        log: String,
        /// The model.
        model: String,
    },
    /// Gaps cut the log into segments that are too short.
    #[error(
        "{log}: gaps cut the log into {segments} segments of at most {longest} rows, too few to determine their initial states: record without gaps, or state the sample rate if the time stamps are wrong"
    )]
    OnlyShortSegments {
        /// The log.
        log: String,
        /// Number of segments.
        segments: usize,
        /// Rows of the longest.
        longest: usize,
    },
    /// The log is too short.
    #[error("{log}: {rows} rows are too few for a comparison; {}", remedy(.fault))]
    TooShort {
        /// The log.
        log: String,
        /// Its rows.
        rows: usize,
        /// The fault that ended the log.
        fault: Option<String>,
    },
}

impl NamesParameters for PrepareError {
    fn parameters(&self) -> Vec<&str> {
        match self {
            PrepareError::OnlyShortSegments { .. } => vec!["sample_rate_Hz"],
            PrepareError::RotaryLog { .. } | PrepareError::CoastingWithoutSupply { .. } => vec!["notes"],
            _ => Vec::new(),
        }
    }
}

/// The remedy for a log that is too short.
fn remedy(fault: &Option<String>) -> String {
    match fault {
        Some(fault) => format!("a fault ended it early ({fault})"),
        None => "record a few hundred rows or more".to_owned(),
    }
}

/// A note on a preparation.
#[derive(Debug, Clone, PartialEq)]
pub enum PreparationNote {
    /// Single readings that neither a motion nor usual noise explains are not compared.
    Outliers {
        /// The channel.
        channel: Channel,
        /// Number of rows.
        rows: usize,
        /// Rows of the log.
        of: usize,
    },
    /// Readings at the end of the sensor's range, which do not say how large the quantity is, are not compared.
    Limited {
        /// The channel.
        channel: Channel,
        /// Number of rows.
        rows: usize,
        /// Rows of the log.
        of: usize,
    },
    /// No note states how a column was made; it is assumed to hold values at t, which fits better than means over the row.
    AssumedAtT {
        /// The column.
        column: &'static str,
    },
    /// No note states when the input had its values; each is assumed to be that over the row before its own, which fits better.
    AssumedOfRowBefore {
        /// The column.
        column: &'static str,
    },
    /// The log has means over the row of a voltage; it is assumed to move within the rows, which fits better than a constant voltage.
    AssumedToMove {
        /// The column.
        column: &'static str,
    },
    /// No note states how a rate was made; it is assumed to be the mean over the last row, which fits better than values at t.
    AssumedOverLastRow {
        /// The column.
        column: &'static str,
        /// Duration of a row, s.
        interval_s: f64,
    },
    /// A rate sensor is not compared in rows in which the angle does not resolve the motion: at the ends of the segments, and where its
    /// acceleration jumps.
    MotionNotResolved {
        /// Number of rows.
        rows: usize,
        /// Rows of the log.
        of: usize,
    },
    /// The log has gaps; each part is a segment with initial states of its own.
    Segments {
        /// Number of segments that are compared.
        segments: usize,
        /// Number of segments that are too short to determine their initial states, and their rows.
        short: (usize, usize),
    },
    /// `u_V` was measured at the motor terminals, behind the bridge: an effect of the bridge is not visible.
    NotVisibleAtTerminals {
        /// Identifier of the effect.
        effect: &'static str,
    },
}

/// Least rows of a log.
const MIN_ROWS: usize = 20;
/// Least duration of a log with held-out blocks, s.
const MIN_HELD_OUT_DURATION_S: f64 = 6.0;
/// Relative standard deviation below which a supply voltage is constant.
const MAX_CONSTANT_SUPPLY_SPREAD: f64 = 1e-3;

/// Checks that [`prepare`] can prepare `log` for `model`.
///
/// # Errors
/// [`PrepareError`] if the log is too short, or lacks the input or an output.
pub fn check(log: &Log, model: &Model) -> Result<(), PrepareError> {
    columns(log, model).map(|_| ())
}

fn missing_column(log: &Log, model: &Model, name: &str) -> PrepareError {
    let has = log.columns().iter().map(|c| model.axis().file_column(&c.name)).collect::<Vec<_>>().join(", ");
    PrepareError::NoExpressionColumn { log: log.path().display().to_string(), column: name.to_owned(), model: model.name().to_owned(), has }
}

fn input_column(model: &Model) -> &'static str {
    model.input().column()
}

/// The input column, and the compared channels with their columns.
type Columns<'a> = (&'a [f64], Vec<(Channel, &'a [f64])>);

fn columns<'a>(log: &'a Log, model: &Model) -> Result<Columns<'a>, PrepareError> {
    let axis = model.axis();
    let name = || log.path().display().to_string();
    let has = || {
        let read = log.columns().iter().map(|c| axis.file_column(&c.name)).collect::<Vec<_>>().join(", ");
        match log.ignored() {
            [] => read,
            others => format!("{read} (and, not read, {}; stand log inspect shows how to use them)", others.join(", ")),
        }
    };
    if log.len() < MIN_ROWS {
        return Err(PrepareError::TooShort { log: name(), rows: log.len(), fault: crate::log::plausible::fault_that_ended(log) });
    }
    let input_column = model.input().column();
    let Some(input) = log.column(input_column) else {
        return Err(PrepareError::NoInput { log: name(), column: axis.column(input_column), model: model.name().to_owned(), has: has() });
    };
    let channels: Vec<Channel> = match model.outputs() {
        Some(outputs) => outputs.to_vec(),
        None => default_outputs(log, model),
    };
    if channels.is_empty() {
        let wanted = model.input().outputs().iter().map(|c| axis.column(c.compared_column(model.input()))).collect::<Vec<_>>().join(", ");
        return Err(PrepareError::NothingToCompare { log: name(), wanted, model: model.name().to_owned(), has: has() });
    }
    let measured = |channel: Channel| {
        let column = channel.compared_column(model.input());
        let missing = || PrepareError::NoOutput { log: name(), column: axis.column(column), model: model.name().to_owned(), has: has() };
        log.column(column).map(|measured| (channel, measured)).ok_or_else(missing)
    };
    Ok((input, channels.into_iter().map(measured).collect::<Result<_, _>>()?))
}

/// The data of `log` for `model`, with notes for the user. `hold_out`: one block of rows in four is held out.
///
/// # Errors
/// [`PrepareError`] if the log is too short, or lacks the input or an output.
pub fn prepare<'a>(log: &'a Log, model: &Model, hold_out: bool) -> Result<(PreparedLog<'a>, Vec<PreparationNote>), PrepareError> {
    let (input, columns) = columns(log, model)?;
    if log.axis() == Axis::Rotary && model.axis() == Axis::Linear {
        return Err(PrepareError::RotaryLog { log: log.path().display().to_string(), model: model.name().to_owned() });
    }
    let own_columns = model
        .columns()
        .iter()
        .map(|name| log.column(name).ok_or_else(|| missing_column(log, model, name)))
        .collect::<Result<Vec<_>, _>>()?;
    let mut notes = Vec::new();
    let mut compared: Vec<ComparedChannel> = columns
        .into_iter()
        .map(|(channel, measured)| {
            let column = channel.compared_column(model.input());
            let made = log.provenance(column);
            // An unknown age is as a mean over the interval before t. A recorded one is exact.
            let age_is_known = channel == Channel::Rate && model.input() == Input::Motion && log.rate_age_s().is_some();
            let (mean_before_s, sample_interval_s) = match made.sample_interval_s {
                Some(_) if age_is_known => (None, None),
                None if log.notes().is_of_row_before(column) => (Some(log.median_dt_s()), None),
                interval_s => (made.mean_before_s, interval_s),
            };
            ComparedChannel {
                channel,
                measured,
                mean_before_s,
                sample_interval_s,
                filter_hz: made.filter_hz,
                instant: made.instant && channel == Channel::Current,
                quantum: log.quantization_step(column),
                outliers: None,
                limited_rows: 0,
                magnitude: made.magnitude && matches!(channel, Channel::Rate | Channel::Current),
            }
        })
        .collect();
    for channel in compared.iter_mut().filter(|c| matches!(c.channel, Channel::Rate | Channel::Current | Channel::Torque)) {
        leave_out_limited(channel);
        let (of, rows) = (channel.measured.len(), channel.limited_rows);
        notes.extend((rows > 0).then_some(PreparationNote::Limited { channel: channel.channel, rows, of }));
    }
    if log.voltage() == VoltageSource::Terminals {
        let invisible = |card: &&Card| card.requires.contains(&Requirement::CommandedVoltage);
        for id in model.effects().iter().map(|e| e.card).filter(invisible).map(|card| card.id) {
            notes.push(PreparationNote::NotVisibleAtTerminals { effect: id });
        }
    }
    let all = log.segments();
    let (segments, short): (Vec<_>, Vec<_>) = all.into_iter().partition(|rows| rows.len() >= MIN_SEGMENT_ROWS);
    if segments.is_empty() {
        let longest = short.iter().map(ExactSizeIterator::len).max().unwrap_or(0);
        return Err(PrepareError::OnlyShortSegments { log: log.path().display().to_string(), segments: short.len(), longest });
    }
    if segments.len() + short.len() > 1 {
        let short_rows = short.iter().map(ExactSizeIterator::len).sum();
        notes.push(PreparationNote::Segments { segments: segments.len(), short: (short.len(), short_rows) });
    }
    // A value that is held over its row is the mean over the row as well.
    let is_held = model.input() == Input::Voltage && log.notes().voltage_is_held();
    let input_timing = match input_column(model) {
        _ if model.input() == Input::Motion => InputTiming::OverRow,
        column if log.notes().is_of_row_before(column) => InputTiming::OverRowBefore,
        column if log.notes().is_at_t(column) && !is_held => InputTiming::AtT,
        _ => InputTiming::OverRow,
    };
    let voltage_course = match input_timing {
        InputTiming::AtT => VoltageCourse::expected(log, input, model.input(), Known::Values, &segments),
        InputTiming::OverRow => VoltageCourse::expected(log, input, model.input(), Known::Moments, &segments),
        // The moments of a log are those within the column's own rows.
        InputTiming::OverRowBefore => None,
    };
    let supply_ratio = model.effects().iter().any(|e| e.card.uses_supply).then(|| supply_ratio(log)).flatten();
    let connected = connected(log, model, &compared)?;
    let theta = log.column("theta_rad");
    let dt_s = log.median_dt_s();
    let theta_quantum = theta.and_then(|_| log.quantization_step("theta_rad")).unwrap_or(0.0);
    // The increments that contain a jump.
    let increment = prepared_log::increment_rows(dt_s);
    let jumps = theta.map_or_else(Vec::new, |theta| angle_jumps(theta, theta_quantum, &segments));
    let fitted_rows: Vec<usize> = jumps.into_iter().flat_map(|row| row..row + increment).collect();
    let t_s = log.own_times_s();
    let compares_sensor = model.input() == Input::Motion && compared.iter().any(|c| is_of_sensor(c.channel));
    let known_motion: Option<Arc<[KnownMotion]>> = compares_sensor.then(|| {
        let angle = MeasuredAngle { t_s: &t_s, theta_rad: input, quantum_rad: theta_quantum, age_s: log.rate_age_s() };
        known_motion::along(&angle, &segments).into()
    });
    if let Some(motion) = known_motion.as_ref().filter(|_| compared.iter().any(|c| c.channel == Channel::Rate)) {
        let unresolved = segments.iter().flat_map(|rows| &motion[rows.clone()]).filter(|m| !m.is_resolved).count();
        notes.push(PreparationNote::MotionNotResolved { rows: unresolved, of: motion.len() });
    }
    let data = PreparedLog {
        t_s,
        known_motion,
        input: voltage::input(input, input_timing, &segments),
        voltage_course,
        input_timing,
        driven: model.input(),
        axis: model.axis(),
        theta,
        theta_quantum,
        current: log.column("i_A"),
        temp_C: log.column("temp_C").map(|t| smoothed(t, &segments, dt_s).into()),
        supply_ratio,
        connected,
        rate_from_encoder: log.provenance("omega_rad_s").source == RateSource::Encoder,
        columns: own_columns,
        run_begins: log.runs().iter().map(|run| run.rows.start).collect(),
        held_out: (hold_out && log.duration_s() >= MIN_HELD_OUT_DURATION_S).then(|| held_out_rows(log.t_s(), &segments, &fitted_rows)),
        segments,
        channels: compared,
        dt_s,
        budget: Budget::default(),
        predictor: None,
        absolute_angle: log.provenance("theta_rad").absolute,
    };
    Ok((data, notes))
}

/// Leaves out the rows at the ends of the sensor's range and the rows beside them, of which a part was beyond the range.
fn leave_out_limited(channel: &mut ComparedChannel) {
    let limited = rows_at_limits(channel.measured);
    if limited.is_empty() {
        return;
    }
    let mut mask = vec![false; channel.measured.len()];
    for row in limited {
        mask[row.saturating_sub(1)..(row + 2).min(channel.measured.len())].fill(true);
    }
    channel.limited_rows = mask.iter().filter(|m| **m).count();
    channel.outliers = Some(mask.into());
}

/// Window over which the temperature is averaged, s. A small motor at its limits warms by a few kelvin per second.
const TEMPERATURE_WINDOW_S: f64 = 0.1;

/// A temperature without the noise of its sensor: the mean over [`TEMPERATURE_WINDOW_S`] centred on each row, over less at the ends of a
/// segment. Noise of the temperature would bias the estimated temperature coefficients towards zero.
fn smoothed(readings: &[f64], segments: &[std::ops::Range<usize>], dt_s: f64) -> Vec<f64> {
    let half = (0.5 * TEMPERATURE_WINDOW_S / dt_s) as usize;
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

/// With a prescribed motion: the output of a sensor that is compared with it, not what the motion demands of the drive.
pub fn is_of_sensor(channel: Channel) -> bool {
    matches!(channel, Channel::Rate | Channel::Angle)
}

/// The outputs of the model that the log contains. For a prescribed motion the voltage needs a winding in the model, the current a motor
/// constant.
fn default_outputs(log: &Log, model: &Model) -> Vec<Channel> {
    let there = |c: &Channel| log.column(c.compared_column(model.input())).is_some();
    let all = model.input().outputs().iter().copied().filter(there);
    match model.input() {
        Input::Motion => {
            let demanded: Vec<Channel> = all
                .filter(|c| !is_of_sensor(*c))
                .filter(|c| *c != Channel::Voltage || model.base_index(BaseParameter::Resistance).is_some())
                .filter(|c| *c != Channel::Current || model.base_index(BaseParameter::MotorConstant).is_some())
                .collect();
            // A rate beside what moves the drive is the derivative of the input; alone it is a sensor against a known motion.
            match [Channel::Angle, Channel::Rate].into_iter().find(there) {
                Some(sensor) if demanded.is_empty() => vec![sensor],
                _ => demanded,
            }
        }
        _ => all.collect(),
    }
}

/// Fraction of each row in which the bridge connects the winding; `None`: always.
fn connected(log: &Log, model: &Model, compared: &[ComparedChannel]) -> Result<Option<Arc<[f64]>>, PrepareError> {
    let name = || log.path().display().to_string();
    let uses_winding = match model.input() {
        Input::Voltage | Input::Setpoint => true,
        Input::Current | Input::Torque => false,
        Input::Motion => compared.iter().any(|c| !is_of_sensor(c.channel)),
    };
    if !uses_winding {
        return Ok(None);
    }
    let disconnected = log.column("open_circuit").filter(|open| open.iter().any(|o| *o >= 0.5));
    if model.input() == Input::Motion && disconnected.is_some() {
        return Err(PrepareError::DisconnectedMotion { log: name(), model: model.name().to_owned() });
    }
    let mut connected = match log.column("u_V").filter(|_| log.notes().bridge_coasts()) {
        Some(_) if model.input() == Input::Setpoint => {
            return Err(PrepareError::CoastingServo { log: name(), model: model.name().to_owned() });
        }
        Some(_) => connected_while_coasting(log).ok_or_else(|| PrepareError::CoastingWithoutSupply { log: name() })?,
        None if disconnected.is_none() => return Ok(None),
        None => vec![1.0; log.len()],
    };
    for (connected, _) in connected.iter_mut().zip(disconnected.unwrap_or(&[])).filter(|(_, open)| **open >= 0.5) {
        *connected = 0.0;
    }
    Ok(Some(connected.into()))
}

/// Fraction of each row in which a bridge that coasts in the off time of its PWM connects the winding; `None` without a voltage or its
/// supply.
pub fn connected_while_coasting(log: &Log) -> Option<Vec<f64>> {
    let nominal = log.notes().number("supply_nominal_V").filter(|v| *v > 0.0);
    let supply_V = |row: usize| log.column("supply_V").map(|v| v[row]).filter(|v| *v > 0.0).or(nominal);
    let fraction = |(row, u): (usize, &f64)| supply_V(row).map(|supply_V| (u.abs() / supply_V).min(1.0));
    log.column("u_V")?.iter().enumerate().map(fraction).collect()
}

/// Supply voltage over its nominal value; `None` if it is not measured or constant.
fn supply_ratio(log: &Log) -> Option<Arc<[f64]>> {
    let supply = log.column("supply_V")?;
    let nominal = match log.notes().number("supply_nominal_V") {
        Some(nominal) => nominal,
        None => supply.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    };
    let mean = supply.iter().sum::<f64>() / supply.len() as f64;
    let spread = (supply.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / supply.len() as f64).sqrt();
    (nominal > 0.0 && spread > MAX_CONSTANT_SUPPLY_SPREAD * mean).then(|| supply.iter().map(|s| s / nominal).collect::<Vec<_>>().into())
}

#[cfg(test)]
mod tests {
    use super::smoothed;

    #[test]
    fn smoothed_temperature_keeps_its_slope_up_to_segment_ends() {
        let ramp = |k: usize| 25.0 + 1e-3 * k as f64;
        let noise = |k: usize| if k.is_multiple_of(2) { 0.05 } else { -0.05 };
        // The winding cools during a gap after row 2000.
        let readings: Vec<f64> = (0..5000).map(|k| ramp(k) + noise(k) - if k < 2000 { 0.0 } else { 3.0 }).collect();
        let smooth = smoothed(&readings, &[0..2000, 2000..5000], 1e-3);
        for (k, value) in smooth.iter().enumerate() {
            let to_the_end = k.min(1999_usize.wrapping_sub(k)).min(k.wrapping_sub(2000)).min(4999 - k);
            let off = (value - ramp(k) + if k < 2000 { 0.0 } else { 3.0 }).abs();
            assert!(off <= 0.05 / (2 * to_the_end.min(50) + 1) as f64 + 1e-9, "row {k}: off by {off} K");
        }
        // Rows further apart than the window are not averaged.
        assert_eq!(smoothed(&[1.0, 5.0, 2.0], std::slice::from_ref(&(0..3)), 2.0), [1.0, 5.0, 2.0]);
    }
}
