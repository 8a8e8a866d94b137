//! From the rig's reading to what a channel shows: the logger's own windows and filters, lag and delay of a sensor.

use std::collections::VecDeque;

use hal_sim::effects::{Arms, Reading, Scalar};

use super::record::{Compared, Record};
use crate::model::Channel;

/// Which channel is late, where the model has a time skew.
pub fn late_channel(record: &Record) -> Option<usize> {
    [Channel::Rate, Channel::Angle, Channel::Current].into_iter().find_map(|s| record.channels.iter().position(|c| c.shows == s))
}

/// The chain of one channel.
pub struct Chain<S> {
    shows: Channel,
    window_s: f64,
    filter: Vec<Lag<S>>,
    skew_s: Option<S>,
    increment: usize,
    /// Times and values before the window or the delay.
    past: VecDeque<(f64, S)>,
    raw: VecDeque<S>,
    reach_s: f64,
}

impl<S: Scalar> Chain<S> {
    /// The chain of `channel`, as notes and effects make it.
    pub fn new(record: &Record, index: usize, arms: &Arms<S>) -> Self {
        let channel: &Compared = &record.channels[index];
        let mut filter = Vec::new();
        if let Some(hz) = channel.filter_hz {
            filter.push(Lag::new(S::from(1.0 / (std::f64::consts::TAU * hz))));
        }
        if let (Channel::Rate, Some(lag_s)) = (channel.shows, arms.lag_s) {
            filter.push(Lag::new(lag_s));
        }
        let skew_s = arms.skew_s.filter(|_| late_channel(record) == Some(index));
        let window_s = channel.mean_before_s.unwrap_or(0.0);
        let reach_s = window_s.max(skew_s.map_or(0.0, |s| s.re())) + 4.0 * record.dt_s;
        let increment = if channel.shows == Channel::Angle { record.angle_lag() } else { 0 };
        Chain { shows: channel.shows, window_s, filter, skew_s, increment, past: VecDeque::new(), raw: VecDeque::new(), reach_s }
    }

    /// A new segment begins.
    pub fn reset(&mut self) {
        self.past.clear();
        self.raw.clear();
        for filter in &mut self.filter {
            filter.state = None;
        }
    }

    /// Takes the reading at `t_s` with the true rate and angle there, gives what the channel shows; `None` where it has no partner yet.
    #[inline]
    pub fn push(&mut self, t_s: f64, omega: S, theta: S, reading: &Reading<S>) -> Option<S> {
        let mut value = match self.shows {
            Channel::Rate => reading.omega,
            Channel::Angle => reading.theta,
            _ => reading.current,
        };
        if self.window_s > 0.0 {
            value = self.windowed(t_s, value, omega, theta);
        }
        for filter in &mut self.filter {
            value = filter.push(t_s, value);
        }
        if let Some(skew_s) = self.skew_s {
            value = self.late(t_s, value, skew_s);
        }
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

    /// Mean over the window before t: of a rate exactly, by the angle turned; of another channel by its rows.
    fn windowed(&mut self, t_s: f64, value: S, omega: S, theta: S) -> S {
        let key = if self.shows == Channel::Rate { theta } else { self.past.back().map_or(S::zero(), |b| b.1 + value * (t_s - b.0)) };
        self.remember(t_s, key);
        let from = self.at(t_s - self.window_s);
        let (Some((from_s, from)), true) = (from, self.past.len() > 1) else { return value };
        let length_s = t_s - from_s;
        if length_s <= 0.0 {
            return value;
        }
        let mean = (key - from) / length_s;
        if self.shows == Channel::Rate { mean + (value - omega) } else { mean }
    }

    fn late(&mut self, t_s: f64, value: S, skew_s: S) -> S {
        self.remember(t_s, value);
        // Linear between rows, with the derivative by the delay.
        let wanted = t_s - skew_s.re();
        let k = self.past.partition_point(|p| p.0 <= wanted);
        if k == 0 {
            return self.past.front().map_or(value, |p| p.1);
        }
        if k >= self.past.len() {
            let n = self.past.len();
            if n < 2 {
                return value;
            }
            let (a, b) = (self.past[n - 2], self.past[n - 1]);
            return b.1 - (b.1 - a.1) / (b.0 - a.0) * skew_s;
        }
        let (a, b) = (self.past[k - 1], self.past[k]);
        let slope = (b.1 - a.1) / (b.0 - a.0);
        a.1 + slope * (-skew_s + (t_s - a.0))
    }

    fn remember(&mut self, t_s: f64, value: S) {
        self.past.push_back((t_s, value));
        while self.past.len() > 2 && self.past[1].0 < t_s - self.reach_s {
            self.past.pop_front();
        }
    }

    /// The remembered value at `wanted`, linear between rows; the oldest where the window reaches before the segment.
    fn at(&self, wanted: f64) -> Option<(f64, S)> {
        let k = self.past.partition_point(|p| p.0 <= wanted + 1e-9);
        if k == 0 {
            return self.past.front().copied();
        }
        let a = self.past[k - 1];
        let Some(b) = self.past.get(k) else { return Some(a) };
        if wanted - a.0 < 1e-9 {
            return Some(a);
        }
        Some((wanted, a.1 + (b.1 - a.1) * ((wanted - a.0) / (b.0 - a.0))))
    }
}

/// A first-order lag, exact for an input that is linear between the rows.
struct Lag<S> {
    time_constant_s: S,
    state: Option<(f64, S, S)>,
}

impl<S: Scalar> Lag<S> {
    fn new(time_constant_s: S) -> Self {
        Lag { time_constant_s, state: None }
    }

    fn push(&mut self, t_s: f64, input: S) -> S {
        let Some((last_s, last_in, last_out)) = self.state else {
            self.state = Some((t_s, input, input));
            return input;
        };
        let h = t_s - last_s;
        let tau = self.time_constant_s;
        // Below a hundredth of the row the lag is a delay of tau: its first-order form has the same derivative and no division by zero.
        let output = if tau.re() < 0.01 * h {
            input - (input - last_in) / h * tau
        } else {
            let decay = (-(tau.recip() * h)).exp();
            let slope = (input - last_in) / h;
            // Response to last_in + slope·t from last_out.
            input - slope * tau + (last_out - last_in + slope * tau) * decay
        };
        self.state = Some((t_s, input, output));
        output
    }
}
