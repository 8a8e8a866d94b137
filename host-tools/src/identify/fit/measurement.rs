//! From the rig's reading to what a channel shows: the logger's own windows and filters, lag and delay of a sensor.
//!
//! Rows may be long beside the drive: within 20 ms a small motor loses two fifths of its rate. So what is late, lagging or a mean over a window is
//! taken from the channel *within* the row ([`past`]), not from straight lines between rows. Filter, window and delay commute; a
//! rate is filtered first, where its kinks are at rows.

mod lag;
mod past;

use std::collections::VecDeque;

use drive_model::{Reading, Scalar, Structure};
use drive_rig::RowInput;

use super::prepared_log::{ComparedChannel, PreparedLog};
use crate::model::Channel;
use lag::Lag;
use past::{CLOSE_S, SignalHistory};

/// Which channel is late, where the model has a time skew.
pub fn late_channel(record: &PreparedLog) -> Option<usize> {
    [Channel::Rate, Channel::Angle, Channel::Current].into_iter().find_map(|s| record.channels.iter().position(|c| c.channel == s))
}

/// The rig at a row.
#[derive(Debug)]
pub struct Row<'a, S> {
    /// The row.
    pub span: &'a RowInput,
    /// True rate at its begin, rad/s.
    pub omega: S,
    /// True angle at its begin, rad.
    pub theta: S,
    /// What the channels see of it.
    pub reading: &'a Reading<S>,
    /// How the current changes within the row, A/s; asked for where [`MeasurementChain::follows_current`] says so, else 0.
    pub current_slope_A_s: S,
}

/// The chain of one channel.
pub struct MeasurementChain<S> {
    channel: Channel,
    /// The channel is the mean over the row that begins at t.
    over_row: bool,
    window_s: f64,
    skew_s: Option<S>,
    filter: Vec<Lag<S>>,
    /// Rows are looked into: there is a window, a delay or a sensor's lag.
    within: bool,
    /// What a window or a delay is taken from, where there is one.
    past: Option<SignalHistory<S>>,
    last: Option<Last<S>>,
    increment: usize,
    raw: VecDeque<S>,
}

/// The row before: time, true rate and angle, what the sensor saw.
struct Last<S> {
    t_s: f64,
    omega: S,
    theta: S,
    seen: S,
}

impl<S: Scalar> MeasurementChain<S> {
    /// The chain of `channel`, as notes and effects make it.
    pub fn new(record: &PreparedLog, index: usize, structure: &Structure<S>) -> Self {
        let channel: &ComparedChannel = &record.channels[index];
        let mut filter = Vec::new();
        if let Some(hz) = channel.filter_hz {
            filter.push(Lag::new(S::from(1.0 / (std::f64::consts::TAU * hz))));
        }
        let lag_s = structure.lag_s.filter(|_| channel.channel == Channel::Rate);
        filter.extend(lag_s.map(Lag::new));
        let skew_s = structure.skew_s.filter(|_| late_channel(record) == Some(index));
        let window_s = channel.mean_before_s.unwrap_or(0.0);
        let reach_s = window_s + skew_s.map_or(0.0, |s| s.re()) + 4.0 * record.dt_s;
        let past = (window_s > 0.0 || skew_s.is_some()).then(|| SignalHistory::new(reach_s, channel.channel == Channel::Current));
        MeasurementChain {
            channel: channel.channel,
            over_row: channel.channel == Channel::Current && !channel.instant,
            window_s,
            skew_s,
            filter,
            within: past.is_some() || lag_s.is_some(),
            past,
            last: None,
            increment: if channel.channel == Channel::Angle { record.angle_lag() } else { 0 },
            raw: VecDeque::new(),
        }
    }

    /// The chain needs to know how the current changes within a row.
    pub fn follows_current(&self) -> bool {
        self.channel == Channel::Current && !self.over_row && self.past.is_some()
    }

    /// Takes the rig at a row, gives what the channel shows; `None` where it has no partner yet.
    #[inline]
    pub fn push(&mut self, row: &Row<S>) -> Option<S> {
        let seen = match self.channel {
            Channel::Rate => row.reading.omega,
            Channel::Angle => row.reading.theta,
            _ => row.reading.current,
        };
        let value = match (self.within, self.channel) {
            (false, _) => self.filtered(row.span.t_s, seen),
            (true, Channel::Rate | Channel::Angle) => self.steady(row, seen)?,
            (true, _) => {
                let value = self.jumping(row, seen)?;
                self.filtered(row.span.t_s, value)
            }
        };
        if self.increment > 0 {
            self.raw.push_back(value);
            if self.raw.len() <= self.increment {
                return None;
            }
            let before = self.raw.pop_front()?;
            return Some(value - before);
        }
        Some(value)
    }

    #[inline]
    fn filtered(&mut self, t_s: f64, mut value: S) -> S {
        for filter in &mut self.filter {
            value = filter.push(t_s, value, None);
        }
        value
    }

    /// A rate or an angle: the filters, each with the integral over the row, then window and delay.
    fn steady(&mut self, row: &Row<S>, seen: S) -> Option<S> {
        let t_s = row.span.t_s;
        let mut turned = self.last.as_ref().map(|last| self.turned(last, row, seen));
        self.last = Some(Last { t_s, omega: row.omega, theta: row.theta, seen });
        let mut value = seen;
        for filter in &mut self.filter {
            let before = filter.output();
            value = filter.push(t_s, value, turned);
            turned = turned.zip(before).map(|(turned, before)| filter.turned(turned, before, value));
        }
        let Some(past) = &mut self.past else { return Some(value) };
        past.push(t_s, turned.unwrap_or_else(S::zero), value, S::zero());
        self.shown(row.span)
    }

    /// Integral of what the sensor saw over the row before: of a rate the angle turned, of an angle by its Hermite cubic; what the
    /// sensor adds, as a straight line.
    fn turned(&self, last: &Last<S>, row: &Row<S>, seen: S) -> S {
        let h = row.span.t_s - last.t_s;
        if self.channel == Channel::Rate {
            return row.theta - last.theta + (seen - row.omega + (last.seen - last.omega)) * (0.5 * h);
        }
        (seen + last.seen) * (0.5 * h) + (last.omega - row.omega) * (h * h / 12.0)
    }

    /// A current: window and delay.
    fn jumping(&mut self, row: &Row<S>, seen: S) -> Option<S> {
        self.past.as_mut()?.push(row.span.t_s, S::zero(), seen, row.current_slope_A_s);
        self.shown(row.span)
    }

    /// What the past shows at the row: the value or a mean, now or late. `None` while the window reaches before the segment.
    fn shown(&self, span: &RowInput) -> Option<S> {
        let past = self.past.as_ref()?;
        let at_s = span.t_s - self.skew_s.map_or(0.0, |skew| skew.re());
        let (from_s, to_s) = if self.window_s > 0.0 {
            if past.begin_s()? > span.t_s - self.window_s + CLOSE_S {
                return None;
            }
            (at_s - self.window_s, at_s)
        } else if self.over_row {
            (at_s, at_s + span.dt_s)
        } else {
            let place = past.at(at_s)?;
            return Some(self.skew_s.map_or(place.value, |skew| place.value - place.slope * (skew - skew.re())));
        };
        let Some(skew) = self.skew_s else { return Some((past.sum(to_s)? - past.sum(from_s)?) / (to_s - from_s)) };
        let (from, to) = (past.at(from_s)?, past.at(to_s)?);
        // Of the delay only its derivatives are left here; with first derivatives this is exact.
        Some((to.sum - from.sum - (to.value - from.value) * (skew - skew.re())) / (to_s - from_s))
    }
}

#[cfg(test)]
mod tests;
