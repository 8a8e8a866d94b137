//! Measurement chain of a channel: filters and averaging windows of the logger, lag and delay of a sensor.
//!
//! Rows may be long relative to the time constants: a small motor loses two fifths of its rate within 20 ms. Delays, lags and windows are
//! therefore applied to the signal within the row ([`past`]), not to straight lines between rows. Filter, window and delay commute; a rate
//! is filtered first, since its slope is discontinuous at rows.

mod lag;
mod past;

use std::collections::VecDeque;

use drive_model::{Reading, Scalar, Structure};
use drive_rig::RowInput;

use crate::model::{Channel, Input};
use crate::recording::prepared_log::{ComparedChannel, PreparedLog};
use lag::Lag;
use past::{SignalHistory, TIME_TOLERANCE_S};

/// Index of the channel that a time skew delays.
pub fn delayed_channel(data: &PreparedLog) -> Option<usize> {
    [Channel::Rate, Channel::Angle, Channel::Current].into_iter().find_map(|s| data.channels.iter().position(|c| c.channel == s))
}

/// State of the simulated rig at a row.
#[derive(Debug)]
pub struct Row<'a, S> {
    /// Input of the row.
    pub input: &'a RowInput,
    /// True rate at the start of the row, rad/s.
    pub omega: S,
    /// True angle at the start of the row, rad.
    pub theta: S,
    /// Quantities that the sensors measure.
    pub reading: &'a Reading<S>,
    /// Slope of the current within the row, A/s; 0 unless [`MeasurementChain::needs_current_slope`].
    pub current_slope_A_s: S,
}

/// Measurement chain of one channel.
pub struct MeasurementChain<S> {
    channel: Channel,
    /// The channel is the mean over the row that begins at t.
    over_row: bool,
    window_s: f64,
    skew_s: Option<S>,
    filter: Vec<Lag<S>>,
    /// The signal within rows is needed: for a window, a delay, a filter of the logger or the lag of a sensor.
    within_rows: bool,
    /// History of the signal for a window or a delay.
    history: Option<SignalHistory<S>>,
    last: Option<Previous<S>>,
    /// Number of rows between the two angles of an increment; 0 for other channels.
    increment: usize,
    /// The last values, for increments.
    values: VecDeque<S>,
    /// Jumps of the angle, in a rate that is derived from it.
    jumps: Option<Jumps<S>>,
    /// The channel has no sign.
    magnitude: bool,
}

/// Jumps of the angle in a rate that is the difference of the angle over an interval.
struct Jumps<S> {
    interval_s: f64,
    /// Times of the last rows, with the sum of all jumps up to there.
    past: VecDeque<(f64, S)>,
}

impl<S: Scalar> Jumps<S> {
    /// The part of the rate at `t_s` that the jumps within the interval before make.
    fn push(&mut self, t_s: f64, jumped: S) -> S {
        self.past.push_back((t_s, jumped));
        let begin_s = t_s - self.interval_s + TIME_TOLERANCE_S;
        while self.past.len() > 1 && self.past[1].0 <= begin_s {
            self.past.pop_front();
        }
        let before = self.past.front().map_or(jumped, |(_, before)| *before);
        (jumped - before) / self.interval_s
    }
}

/// The previous row: time, true rate and angle, measured quantity.
struct Previous<S> {
    t_s: f64,
    omega: S,
    theta: S,
    measured: S,
}

impl<S: Scalar> MeasurementChain<S> {
    /// The chain of channel `index`, from the notes of the log and the effects of the model.
    pub fn new(data: &PreparedLog, index: usize, structure: &Structure<S>) -> Self {
        let channel: &ComparedChannel = &data.channels[index];
        let mut filter = Vec::new();
        if let Some(hz) = channel.filter_hz {
            filter.push(Lag::new(S::from(1.0 / (std::f64::consts::TAU * hz))));
        }
        // An angle compared with a known motion is that of a sensor under test.
        let has_lag = channel.channel == Channel::Rate || (channel.channel == Channel::Angle && data.driven == Input::Motion);
        let lag_s = structure.lag_s.filter(|_| has_lag);
        filter.extend(lag_s.map(Lag::new));
        let skew_s = structure.skew_s.filter(|_| delayed_channel(data) == Some(index));
        let window_s = channel.mean_before_s.unwrap_or(0.0);
        let reach_s = window_s + skew_s.map_or(0.0, |s| s.re()) + 4.0 * data.dt_s;
        let derived = channel.channel == Channel::Rate && data.rate_from_encoder && structure.angle_jumps;
        let jumps = derived.then(|| Jumps { interval_s: window_s.max(data.dt_s), past: VecDeque::new() });
        let history = (window_s > 0.0 || skew_s.is_some()).then(|| SignalHistory::new(reach_s, channel.channel == Channel::Current));
        MeasurementChain {
            channel: channel.channel,
            over_row: channel.channel == Channel::Current && !channel.instant,
            window_s,
            skew_s,
            within_rows: history.is_some() || (!filter.is_empty() && matches!(channel.channel, Channel::Rate | Channel::Angle)),
            filter,
            history,
            last: None,
            increment: if channel.channel == Channel::Angle && !data.angle_is_absolute() { data.angle_lag() } else { 0 },
            values: VecDeque::new(),
            jumps,
            magnitude: channel.magnitude,
        }
    }

    /// The chain needs the slope of the current within a row.
    pub fn needs_current_slope(&self) -> bool {
        self.channel == Channel::Current && !self.over_row && self.history.is_some()
    }

    /// Adds a row and returns the value of the channel; `None` while a window or an increment reaches before the segment.
    #[inline]
    pub fn push(&mut self, row: &Row<S>) -> Option<S> {
        let measured = match self.channel {
            Channel::Rate => row.reading.omega,
            Channel::Angle => row.reading.theta,
            _ => row.reading.current,
        };
        let spike = self.jumps.as_mut().map(|jumps| jumps.push(row.input.t_s, row.reading.jumped));
        let mut value = match (self.within_rows, self.channel) {
            (false, _) => self.filtered(row.input.t_s, measured),
            (true, Channel::Rate | Channel::Angle) => self.continuous(row, measured)?,
            (true, _) => {
                let value = self.discontinuous(row, measured)?;
                self.filtered(row.input.t_s, value)
            }
        };
        if let Some(spike) = spike {
            value += spike;
        }
        if self.increment > 0 {
            self.values.push_back(value);
            if self.values.len() <= self.increment {
                return None;
            }
            let before = self.values.pop_front()?;
            return Some(value - before);
        }
        Some(if self.magnitude { value.abs() } else { value })
    }

    /// The state was corrected after the last row: rate, angle and measured quantity there.
    pub fn correct(&mut self, omega: S, theta: S, reading: &Reading<S>) {
        let measured = match self.channel {
            Channel::Rate => reading.omega,
            Channel::Angle => reading.theta,
            _ => return,
        };
        let Some(last) = &mut self.last else { return };
        *last = Previous { t_s: last.t_s, omega, theta, measured };
        match self.filter.first_mut() {
            Some(filter) => filter.correct_input(measured),
            None => self.history.iter_mut().for_each(|history| history.correct(measured)),
        }
    }

    #[inline]
    fn filtered(&mut self, t_s: f64, mut value: S) -> S {
        for filter in &mut self.filter {
            value = filter.push(t_s, value, None);
        }
        value
    }

    /// A rate or an angle: the filters, each with the integral over the row, then window and delay.
    fn continuous(&mut self, row: &Row<S>, measured: S) -> Option<S> {
        let t_s = row.input.t_s;
        let mut integral = self.last.as_ref().map(|last| self.row_integral(last, row, measured));
        self.last = Some(Previous { t_s, omega: row.omega, theta: row.theta, measured });
        let mut value = measured;
        for filter in &mut self.filter {
            let before = filter.output();
            // Before the first row the rate is constant.
            value = match (before, self.channel) {
                (None, Channel::Angle) => filter.begin(t_s, value, row.omega),
                _ => filter.push(t_s, value, integral),
            };
            integral = integral.zip(before).map(|(integral, before)| filter.output_integral(integral, before, value));
        }
        let Some(history) = &mut self.history else { return Some(value) };
        history.push(t_s, integral.unwrap_or_else(S::zero), value, S::zero());
        self.value_from_history(row.input)
    }

    /// Integral of the measured quantity over the previous row. Rate: the increment of the angle. Angle: the integral of its Hermite cubic.
    /// Errors of the sensor: linear within the row.
    fn row_integral(&self, last: &Previous<S>, row: &Row<S>, measured: S) -> S {
        let h = row.input.t_s - last.t_s;
        if self.channel == Channel::Rate {
            return row.theta - last.theta + (measured - row.omega + (last.measured - last.omega)) * (0.5 * h);
        }
        (measured + last.measured) * (0.5 * h) + (last.omega - row.omega) * (h * h / 12.0)
    }

    /// A current, which is discontinuous at rows: window and delay.
    fn discontinuous(&mut self, row: &Row<S>, measured: S) -> Option<S> {
        self.history.as_mut()?.push(row.input.t_s, S::zero(), measured, row.current_slope_A_s);
        self.value_from_history(row.input)
    }

    /// Value or mean from the history, delayed if there is a delay. `None` while the window reaches before the segment.
    fn value_from_history(&self, row: &RowInput) -> Option<S> {
        let history = self.history.as_ref()?;
        let at_s = row.t_s - self.skew_s.map_or(0.0, |skew| skew.re());
        let (from_s, to_s) = if self.window_s > 0.0 {
            if history.begin_s()? > row.t_s - self.window_s + TIME_TOLERANCE_S {
                return None;
            }
            (at_s - self.window_s, at_s)
        } else if self.over_row {
            (at_s, at_s + row.dt_s)
        } else {
            let value = history.at(at_s)?;
            return Some(self.skew_s.map_or(value.value, |skew| value.value - value.slope * (skew - skew.re())));
        };
        let Some(skew) = self.skew_s else { return Some((history.sum(to_s)? - history.sum(from_s)?) / (to_s - from_s)) };
        let (from, to) = (history.at(from_s)?, history.at(to_s)?);
        // The value of the delay is in `at_s`; this term adds its first derivatives.
        Some((to.sum - from.sum - (to.value - from.value) * (skew - skew.re())) / (to_s - from_s))
    }
}

#[cfg(test)]
mod tests;
