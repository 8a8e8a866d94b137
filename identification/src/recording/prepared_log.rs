//! The columns of a log in the form that a fit needs: input, compared channels, and quantities that the simulation takes from the log.
//!
//! Columns are borrowed from the log or shared, so that a clone (with other segments or another source of the rate) copies no rows.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use drive_rig::RowInput;

use super::known_motion::KnownMotion;
use super::predictor::Predictor;
use super::voltage;
use super::voltage::{InputTiming, VoltageCourse};
use crate::budget::Budget;
use crate::log::{Axis, Log, MIN_SEGMENT_ROWS};
use crate::model::{Channel, Input};

/// Interval over which the angle is compared by its increments, s. A simulated angle drifts without limit; its increments do not.
pub const ANGLE_INCREMENT_S: f64 = 0.020;
/// Length of a block, s; see [`HELD_OUT_PERIOD`].
pub(crate) const HELD_OUT_BLOCK_S: f64 = 2.0;
/// Blocks per period; one of them is held out.
const HELD_OUT_PERIOD: i64 = 4;
/// Index of the held-out block within a period.
const HELD_OUT_INDEX: i64 = 1;

/// A compared channel.
#[derive(Debug, Clone)]
pub struct ComparedChannel<'a> {
    /// The channel.
    pub channel: Channel,
    /// The measured column.
    pub measured: &'a [f64],
    /// Length of the window before t over which the channel is averaged, s (from the log's notes).
    pub mean_before_s: Option<f64>,
    /// The channel is the newest sample of a sensor that samples at this interval by its own clock, s (from the log's notes).
    pub sample_interval_s: Option<f64>,
    /// Cutoff of the first-order filter of the channel, Hz (from the log's notes).
    pub filter_hz: Option<f64>,
    /// The channel is the instantaneous value at t, not the mean over the row (from the log's notes; currents only).
    pub instant: bool,
    /// Least significant bit, if the channel is quantised.
    pub quantum: Option<f64>,
    /// The channel is the magnitude of its quantity (from the log's notes).
    pub magnitude: bool,
    /// True in rows whose value is an outlier, or at the end of the sensor's range, and is not compared; `None` where there are none.
    pub outliers: Option<Arc<[bool]>>,
    /// Number of these rows at or beside the end of the range.
    pub limited_rows: usize,
}

/// The columns of a log in the form that a fit needs. All columns have the same length.
#[derive(Debug, Clone)]
pub struct PreparedLog<'a> {
    /// Time of each row by the clock of its run, s: it increases within a segment.
    pub t_s: Cow<'a, [f64]>,
    /// Mean of the input over each row; the angle for a prescribed motion.
    pub input: Cow<'a, [f64]>,
    /// Course of the voltage within each row; `None`: constant.
    pub voltage_course: Option<VoltageCourse>,
    /// When the input had the values of its column, from which `input` is made.
    pub input_timing: InputTiming,
    /// The motion that a sensor is compared with, by row; only for a prescribed motion with a rate or an angle among the outputs.
    pub known_motion: Option<Arc<[KnownMotion]>>,
    /// Kind of the input.
    pub driven: Input,
    /// The axis whose names and units the reports have.
    pub axis: Axis,
    /// Measured angle, rad.
    pub theta: Option<&'a [f64]>,
    /// Least significant bit of the measured angle, rad; 0 if it is continuous.
    pub theta_quantum: f64,
    /// Measured current, A; used for a prescribed motion only.
    pub current: Option<&'a [f64]>,
    /// Measured winding temperature, smoothed, °C.
    pub temp_C: Option<Arc<[f64]>>,
    /// Measured supply voltage over its nominal value.
    pub supply_ratio: Option<Arc<[f64]>>,
    /// Fraction of each row in which the bridge connects the winding; `None`: always.
    pub connected: Option<Arc<[f64]>>,
    /// Whether the rate channel is derived from the encoder.
    pub rate_from_encoder: bool,
    /// Columns that the expressions of the model use, in the order of the model.
    pub columns: Vec<&'a [f64]>,
    /// First row of each run: of each of several logs, or of each recording in one.
    pub run_begins: Vec<usize>,
    /// Ranges of rows without a gap in time.
    pub segments: Vec<Range<usize>>,
    /// The compared channels.
    pub channels: Vec<ComparedChannel<'a>>,
    /// Median row interval, s.
    pub dt_s: f64,
    /// True in the rows that are held out of the fit; `None` where none are.
    pub held_out: Option<Arc<[bool]>>,
    /// What a computation with these rows may spend; then it ends with its best values so far.
    pub budget: Budget,
    /// How the simulated state follows the measurement; `None`: the simulation runs freely, and the angle is compared by its increments.
    pub predictor: Option<Arc<Predictor>>,
    /// The angle itself is compared, not its increments (from the log's notes).
    pub absolute_angle: bool,
}

/// Copies that differ in what a computation varies.
impl<'a> PreparedLog<'a> {
    /// With another budget.
    pub fn spending(self, budget: Budget) -> Self {
        PreparedLog { budget, ..self }
    }

    /// The angle is compared by its increments, whose errors do not accumulate.
    pub fn comparing_increments(self) -> Self {
        PreparedLog { absolute_angle: false, ..self }
    }

    /// The rate channel is derived from the encoder, or is not.
    pub fn with_rate_from_encoder(self, rate_from_encoder: bool) -> Self {
        PreparedLog { rate_from_encoder, ..self }
    }

    /// The simulated state follows the measurement; `None`: it runs freely.
    pub fn following(&self, predictor: Option<Arc<Predictor>>) -> Self {
        PreparedLog { predictor, ..self.clone() }
    }

    /// No row is held out.
    pub fn with_all_rows(&self) -> Self {
        PreparedLog { held_out: None, ..self.clone() }
    }

    /// Only these parts of the segments.
    pub fn of_segments(&self, segments: Vec<Range<usize>>) -> Self {
        PreparedLog { segments, ..self.clone() }
    }

    /// Only these rows, none of them held out.
    pub fn of_rows(&self, rows: Range<usize>) -> Self {
        PreparedLog { segments: vec![rows], ..self.with_all_rows() }
    }

    /// With another course of the voltage within the rows.
    pub fn with_voltage_course(&self, course: VoltageCourse) -> Self {
        PreparedLog { voltage_course: Some(course), ..self.clone() }
    }

    /// The bridge connects the winding in this fraction of each row.
    pub fn connected_during(&self, connected: Vec<f64>) -> Self {
        PreparedLog { connected: Some(connected.into()), ..self.clone() }
    }

    /// Without the outliers, rows by channel.
    pub fn without(&self, outliers: Vec<Vec<usize>>) -> Self {
        let mut data = self.clone();
        for (channel, found) in data.channels.iter_mut().zip(outliers).filter(|(_, found)| !found.is_empty()) {
            let mut mask = channel.outliers.as_ref().map_or_else(|| vec![false; self.len()], |known| known.to_vec());
            found.into_iter().for_each(|row| mask[row] = true);
            channel.outliers = Some(mask.into());
        }
        data
    }
}

impl PreparedLog<'_> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// True for a log without rows.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Whether the row is held out.
    #[inline]
    pub fn held_out(&self, row: usize) -> bool {
        self.held_out.as_ref().is_some_and(|held_out| held_out[row])
    }

    /// Input of the simulation for a row. The last row of a segment has the median interval.
    #[inline]
    pub fn row_input(&self, row: usize, segment_end: usize) -> RowInput {
        let next = row + 1;
        let inside = next < segment_end;
        // The encoder rounds down: on average, the angle is half a count above the measured one.
        let half_count = 0.5 * self.theta_quantum;
        RowInput {
            t_s: self.t_s[row],
            dt_s: if inside { self.t_s[next] - self.t_s[row] } else { self.dt_s },
            input: self.input[row],
            voltage_course_V: self.voltage_course.as_ref().map_or([0.0; 3], |course| course.rows_V[row]),
            connected: self.connected.as_ref().map_or(1.0, |c| c[row]),
            theta: self
                .theta
                .map(|theta| (theta[row] + half_count, if inside { theta[next] + half_count } else { theta[row] + half_count })),
            temp_C: self.temp_C.as_ref().map(|t| t[row]),
            supply_ratio: self.supply_ratio.as_ref().map_or(1.0, |s| s[row]),
            rate_from_encoder: self.rate_from_encoder,
            reference_angle: self.driven == Input::Motion,
            columns: std::array::from_fn(|k| self.columns.get(k).map_or(0.0, |column| column[row])),
            start_s: self.run_start_s(row),
        }
    }

    /// Time of the first row of the run that contains a row, by the clock of the run, s.
    #[inline]
    pub fn run_start_s(&self, row: usize) -> f64 {
        let run = self.run_begins.partition_point(|begin| *begin <= row);
        self.t_s[self.run_begins.get(run.wrapping_sub(1)).copied().unwrap_or(0)]
    }

    /// Duration of the longest run, s.
    pub fn longest_run_s(&self) -> f64 {
        let ends = self.run_begins.iter().skip(1).copied().chain([self.len()]);
        self.run_begins.iter().zip(ends).map(|(&begin, end)| self.t_s[end - 1] - self.t_s[begin]).fold(0.0, f64::max)
    }

    /// First and last time by the clocks of the runs, s.
    pub fn time_range_s(&self) -> (f64, f64) {
        let ends = self.segments.iter().filter_map(|rows| Some((*self.t_s.get(rows.start)?, *self.t_s.get(rows.end.checked_sub(1)?)?)));
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (a, b)| (low.min(a), high.max(b)));
        if low <= high { (low, high) } else { (0.0, 0.0) }
    }

    /// The angle itself is compared, not its increments.
    pub fn angle_is_absolute(&self) -> bool {
        self.absolute_angle || self.predictor.is_some()
    }

    /// Number of rows between the two angles of an increment.
    pub fn angle_lag(&self) -> usize {
        increment_rows(self.dt_s)
    }

    /// Compared value of a channel at a row: the measured value, or the increment of an angle. `None` for an angle in the first rows of a
    /// segment.
    #[inline]
    pub fn target(&self, channel: usize, row: usize, segment_begin: usize) -> Option<f64> {
        let c = &self.channels[channel];
        let outlier = |row: usize| c.outliers.as_ref().is_some_and(|outliers| outliers[row]);
        if outlier(row) {
            return None;
        }
        match c.channel {
            Channel::Angle if self.angle_is_absolute() => Some(c.measured[row] + 0.5 * self.theta_quantum),
            Channel::Angle => {
                let lag = self.angle_lag();
                (row >= segment_begin + lag && !outlier(row - lag)).then(|| c.measured[row] - c.measured[row - lag])
            }
            _ => Some(c.measured[row]),
        }
    }
}

/// Number of rows of an increment at this row interval.
pub fn increment_rows(dt_s: f64) -> usize {
    ((ANGLE_INCREMENT_S / dt_s).round() as usize).max(1)
}

/// The rows that are held out: the second of four blocks of 2 s, where the segment has begun long enough before for its initial states to
/// be determined by fitted rows. Of the rows `fitted` none is held out: those of events that occur once.
pub fn held_out_rows(t_s: &[f64], segments: &[Range<usize>], fitted: &[usize]) -> Arc<[bool]> {
    let in_block = |row: usize| ((t_s[row] - t_s[0]) / HELD_OUT_BLOCK_S).floor() as i64 % HELD_OUT_PERIOD == HELD_OUT_INDEX;
    let mut held_out = vec![false; t_s.len()];
    for segment in segments {
        let mut fitted = 0;
        for row in segment.clone() {
            if in_block(row) && fitted >= MIN_SEGMENT_ROWS {
                held_out[row] = true;
            } else {
                fitted += 1;
            }
        }
    }
    for &row in fitted {
        if let Some(held_out) = held_out.get_mut(row) {
            *held_out = false;
        }
    }
    held_out.into()
}

/// A prepared log without the columns borrowed from the log. For a result that owns the log: a struct cannot hold references to its own
/// field.
#[derive(Debug, Clone)]
pub struct Preparation(PreparedLog<'static>);

impl Preparation {
    /// Drops the borrowed columns of `data`.
    pub fn of(data: &PreparedLog) -> Preparation {
        let empty = |_: &[f64]| [].as_slice();
        let channel = |c: &ComparedChannel| ComparedChannel {
            channel: c.channel,
            measured: &[],
            mean_before_s: c.mean_before_s,
            sample_interval_s: c.sample_interval_s,
            filter_hz: c.filter_hz,
            instant: c.instant,
            quantum: c.quantum,
            outliers: c.outliers.clone(),
            limited_rows: c.limited_rows,
            magnitude: c.magnitude,
        };
        Preparation(PreparedLog {
            t_s: Cow::Borrowed(&[]),
            input: Cow::Borrowed(&[]),
            voltage_course: data.voltage_course.clone(),
            input_timing: data.input_timing,
            known_motion: data.known_motion.clone(),
            driven: data.driven,
            axis: data.axis,
            theta: data.theta.map(empty),
            theta_quantum: data.theta_quantum,
            current: data.current.map(empty),
            temp_C: data.temp_C.clone(),
            supply_ratio: data.supply_ratio.clone(),
            connected: data.connected.clone(),
            rate_from_encoder: data.rate_from_encoder,
            columns: Vec::new(),
            run_begins: data.run_begins.clone(),
            segments: data.segments.clone(),
            channels: data.channels.iter().map(channel).collect(),
            dt_s: data.dt_s,
            held_out: data.held_out.clone(),
            budget: Budget::default(),
            predictor: None,
            absolute_angle: data.absolute_angle,
        })
    }

    /// The prepared log, with its columns borrowed again from `log`, which must be the log that was prepared.
    pub fn with_columns<'a>(&self, log: &'a Log) -> PreparedLog<'a> {
        let column = |channel: Channel| log.column(channel.compared_column(self.0.driven));
        let channels = self.0.channels.iter();
        PreparedLog {
            t_s: log.own_times_s(),
            input: voltage::input(log.column(self.0.driven.column()).unwrap_or(&[]), self.0.input_timing, &self.0.segments),
            theta: self.0.theta.and_then(|_| log.column(Channel::Angle.column())),
            current: self.0.current.and_then(|_| column(Channel::Current)),
            channels: channels.map(|c| ComparedChannel { measured: column(c.channel).unwrap_or(&[]), ..c.clone() }).collect(),
            ..self.0.clone()
        }
    }
}
