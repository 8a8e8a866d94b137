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
    /// What the window is taken from: the angle turned, or the integral of the channel.
    turned: Past<S>,
    /// Values not yet shown.
    delayed: Past<S>,
    raw: VecDeque<S>,
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
        let past = |reach_s: f64| Past { points: VecDeque::new(), reach_s: reach_s + 4.0 * record.dt_s };
        let (turned, delayed) = (past(window_s), past(skew_s.map_or(0.0, |s| s.re())));
        let increment = if channel.shows == Channel::Angle { record.angle_lag() } else { 0 };
        Chain { shows: channel.shows, window_s, filter, skew_s, increment, turned, delayed, raw: VecDeque::new() }
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
            value = self.windowed(t_s, value, omega, theta)?;
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

    /// Mean over the window before t: of a rate exactly, by the angle turned; of another channel by its rows. `None` while the window
    /// reaches before the segment.
    fn windowed(&mut self, t_s: f64, value: S, omega: S, theta: S) -> Option<S> {
        let turned = match (self.shows, self.turned.points.back()) {
            (Channel::Rate, _) => theta,
            (_, Some(before)) => before.1 + value * (t_s - before.0),
            (_, None) => S::zero(),
        };
        self.turned.push(t_s, turned);
        let from_s = t_s - self.window_s;
        if self.turned.points.front()?.0 > from_s + CLOSE_S {
            return None;
        }
        let mean = (turned - self.turned.at(from_s)?) / self.window_s;
        // What a sensor's effect adds to the rate is taken at the instant.
        Some(if self.shows == Channel::Rate { mean + (value - omega) } else { mean })
    }

    /// The value of `skew_s` ago, linear between rows, with the derivative by the delay; the first one while there is no older.
    fn late(&mut self, t_s: f64, value: S, skew_s: S) -> S {
        self.delayed.push(t_s, value);
        let points = &self.delayed.points;
        let wanted = t_s - skew_s.re();
        let after = points.partition_point(|p| p.0 <= wanted).min(points.len() - 1);
        let (Some(a), Some(b)) = (after.checked_sub(1).and_then(|k| points.get(k)), points.get(after)) else { return points[0].1 };
        a.1 + (b.1 - a.1) / (b.0 - a.0) * (-skew_s + (t_s - a.0))
    }
}

/// Two instants are the same.
const CLOSE_S: f64 = 1e-9;

/// What a channel was, as far back as is asked for.
struct Past<S> {
    points: VecDeque<(f64, S)>,
    reach_s: f64,
}

impl<S: Scalar> Past<S> {
    fn push(&mut self, t_s: f64, value: S) {
        self.points.push_back((t_s, value));
        while self.points.len() > 2 && self.points[1].0 < t_s - self.reach_s {
            self.points.pop_front();
        }
    }

    /// The value at `wanted`, linear between rows.
    fn at(&self, wanted: f64) -> Option<S> {
        let k = self.points.partition_point(|p| p.0 <= wanted + CLOSE_S);
        let Some(a) = k.checked_sub(1).and_then(|k| self.points.get(k)) else { return self.points.front().map(|p| p.1) };
        let Some(b) = self.points.get(k).filter(|_| wanted - a.0 > CLOSE_S) else { return Some(a.1) };
        Some(a.1 + (b.1 - a.1) * ((wanted - a.0) / (b.0 - a.0)))
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
