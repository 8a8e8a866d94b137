//! The residual beside its coordinates, row by row or in blocks of rows; and what a missing torque, voltage or reading leaves in it.
//!
//! Residuals are in units of the channel's noise, all channels one behind the other in one vector. A torque τ that the model lacks leaves
//! J δω' = τ − λ J δω in the rate, with λ J = K²/R + b where the voltage is given and b where the current is; −K/R of that in the current;
//! its integral over 20 ms in the angle's increments. A voltage v acts as the torque K v/R, and v/R on the current at once.

use crate::identify::fit::{FitResult, PreparedLog};
use crate::log::Log;
use crate::model::{Channel, Input};

/// What the responses need of the drive.
#[derive(Debug, Clone, Copy)]
pub struct Drive {
    inertia_kg_m2: f64,
    constant_N_m_A: f64,
    /// 0 where the voltage is not the input.
    per_ohm: f64,
    viscous_N_m_s: f64,
}

/// One compared channel.
#[derive(Debug, Clone)]
pub struct Seen {
    /// What it shows.
    pub channel: Channel,
    /// One unit of `y`, in the channel's own.
    pub unit: f64,
    /// Sum of squares of the residual as it was at first, in units of `y`.
    pub power: f64,
}

/// Rows, or blocks of rows: columns of equal length n, and the residuals `y` of c channels as c·n values.
#[derive(Debug, Clone)]
pub struct Rows {
    /// Time of the row, s.
    pub t_s: Vec<f64>,
    /// Length of a row, s.
    pub dt_s: f64,
    /// Begins of segments.
    pub begins: Vec<bool>,
    /// Angle, not wrapped, rad; empty where there is none.
    pub theta: Vec<f64>,
    /// Modelled rate, rad/s; empty where there is none.
    pub omega: Vec<f64>,
    /// Modelled current, A (measured where it is not modelled); empty where there is none.
    pub current: Vec<f64>,
    /// Winding temperature, °C; empty where there is none.
    pub temp_C: Vec<f64>,
    /// The input, in its unit.
    pub input: Vec<f64>,
    /// Residuals in units of the noise, channel by channel; 0 where nothing is compared.
    pub y: Vec<f64>,
    /// 1 where `y` was compared.
    pub mask: Vec<f64>,
    /// The channels.
    pub channels: Vec<Seen>,
    /// Rows over which the angle is compared.
    pub lag: usize,
    /// The drive; `None` where the motion is prescribed.
    pub drive: Option<Drive>,
    /// What drives the model.
    pub driven: Input,
}

/// What is missing, as a series each: a torque, a voltage, a change to what a channel reads, an error of the encoder.
#[derive(Clone, Copy, Default)]
pub struct Missing<'a> {
    /// Torque on the rotor, N m.
    pub torque: Option<&'a [f64]>,
    /// Added to the voltage, V.
    pub voltage: Option<&'a [f64]>,
    /// Added to the reading of a channel (index), in its unit.
    pub reading: Option<(usize, &'a [f64])>,
    /// Added to the angle that the encoder shows, rad, and by its derivative to a rate that is made from it.
    pub encoder: Option<&'a [f64]>,
}

impl Rows {
    /// The rows of a log; `None` where nothing is compared.
    pub fn of(log: &Log, record: &PreparedLog, held: &FitResult) -> Option<Rows> {
        let n = record.len();
        let modelled = |channel: Channel| -> Option<Vec<f64>> {
            let measured = record.channels.iter().find(|c| c.channel == channel)?.measured;
            let residual = &held.channels.iter().find(|c| c.channel == channel)?.residual;
            Some(measured.iter().zip(residual).map(|(y, r)| if r.is_finite() { y - r } else { *y }).collect())
        };
        let column = |name: &str| log.column(name).map(<[f64]>::to_vec);
        let theta = record.theta.map(|theta| theta.iter().map(|v| v + 0.5 * record.theta_quantum).collect::<Vec<f64>>());
        let lag = record.angle_lag();
        let turned = |theta: &Vec<f64>| -> Vec<f64> {
            let slope = |k: usize| {
                let (a, b) = (k.saturating_sub(lag), (k + lag).min(n - 1));
                let span = record.t_s[b] - record.t_s[a];
                if span > 0.0 { (theta[b] - theta[a]) / span } else { 0.0 }
            };
            (0..n).map(slope).collect()
        };
        let omega = modelled(Channel::Rate).or_else(|| theta.as_ref().map(turned)).or_else(|| column("omega_rad_s")).unwrap_or_default();
        let mut begins = vec![false; n];
        for segment in &record.segments {
            if let Some(b) = begins.get_mut(segment.start) {
                *b = true;
            }
        }
        let (mut y, mut mask, mut channels) = (Vec::new(), Vec::new(), Vec::new());
        for f in &held.channels {
            // Increments that overlap are not witnesses each: one in `lag` is.
            let unit = f.noise * if f.channel == Channel::Angle { (lag as f64).sqrt() } else { 1.0 };
            if f.residual.len() != n || !unit.is_finite() || unit <= 0.0 {
                return None;
            }
            let at = y.len();
            y.extend(f.residual.iter().map(|r| if r.is_finite() { r / unit } else { 0.0 }));
            mask.extend(f.residual.iter().map(|r| if r.is_finite() { 1.0 } else { 0.0 }));
            let power = y[at..].iter().map(|v: &f64| v * v).sum();
            channels.push(Seen { channel: f.channel, unit, power });
        }
        Some(Rows {
            t_s: record.t_s.to_vec(),
            dt_s: record.dt_s,
            begins,
            theta: theta.unwrap_or_default(),
            omega,
            current: modelled(Channel::Current).or_else(|| column("i_A")).unwrap_or_default(),
            temp_C: column("temp_C").unwrap_or_default(),
            input: record.input.to_vec(),
            y,
            mask,
            channels,
            lag,
            drive: drive(record, held),
            driven: record.driven,
        })
        .filter(|r| !r.channels.is_empty() && n > 0)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// First rows of the blocks of at most `of` rows within segments.
    pub fn block_starts(&self, of: usize) -> Vec<usize> {
        let (mut starts, mut since) = (Vec::new(), of);
        for (k, begins) in self.begins.iter().enumerate() {
            if *begins || since >= of {
                starts.push(k);
                since = 0;
            }
            since += 1;
        }
        starts
    }

    /// The same in blocks that begin at `starts`: means, and residuals still in units of their noise.
    pub fn blocks(&self, starts: &[usize], of: usize) -> Rows {
        let n = self.len();
        let ends = |b: usize| starts.get(b + 1).copied().unwrap_or(n);
        let mean = |column: &[f64]| -> Vec<f64> {
            if column.is_empty() {
                return Vec::new();
            }
            starts.iter().enumerate().map(|(b, &s)| column[s..ends(b)].iter().sum::<f64>() / (ends(b) - s) as f64).collect()
        };
        let (mut y, mut mask) = (Vec::new(), Vec::new());
        for c in 0..self.channels.len() {
            for (b, &s) in starts.iter().enumerate() {
                let rows = c * n + s..c * n + ends(b);
                let seen: f64 = self.mask[rows.clone()].iter().sum();
                // √rows × mean: white noise stays at one.
                y.push(if seen > 0.0 { self.y[rows].iter().sum::<f64>() / seen.sqrt() } else { 0.0 });
                mask.push(seen.sqrt());
            }
        }
        Rows {
            t_s: mean(&self.t_s),
            dt_s: self.dt_s * of as f64,
            begins: starts.iter().map(|&s| self.begins[s]).collect(),
            theta: mean(&self.theta),
            omega: mean(&self.omega),
            current: mean(&self.current),
            temp_C: mean(&self.temp_C),
            input: mean(&self.input),
            y,
            mask,
            channels: self.channels.clone(),
            lag: (self.lag / of).max(1),
            drive: self.drive,
            driven: self.driven,
        }
    }

    /// Index of a channel.
    pub fn channel(&self, channel: Channel) -> Option<usize> {
        self.channels.iter().position(|c| c.channel == channel)
    }

    /// What this leaves in all channels, in units of `y`.
    pub fn respond(&self, missing: Missing) -> Vec<f64> {
        let n = self.len();
        let mut out = vec![0.0; n * self.channels.len()];
        let (rate, volts) = self.swing(&missing);
        let turned = self.sums(&rate);
        for (c, channel) in self.channels.iter().enumerate() {
            let part = &mut out[c * n..(c + 1) * n];
            match (channel.channel, self.drive) {
                (Channel::Rate, Some(_)) => part.copy_from_slice(&rate),
                (Channel::Angle, Some(_)) => self.increments(&turned, part),
                (Channel::Current, Some(d)) if d.per_ohm > 0.0 => {
                    for k in 0..n {
                        part[k] = d.per_ohm * (volts.map_or(0.0, |v| v[k]) - d.constant_N_m_A * rate[k]);
                    }
                }
                _ => {}
            }
            if let Some((which, values)) = missing.reading.filter(|r| r.0 == c) {
                match self.channels[which].channel {
                    Channel::Angle => self.increments(values, part),
                    _ => part.copy_from_slice(values),
                }
            }
            if let Some(values) = missing.encoder {
                match channel.channel {
                    Channel::Angle => self.increments(values, part),
                    Channel::Rate => (0..n).for_each(|k| part[k] = self.slope(values, k)),
                    _ => {}
                }
            }
            for (p, m) in part.iter_mut().zip(&self.mask[c * n..(c + 1) * n]) {
                *p *= m / channel.unit;
            }
        }
        out
    }

    /// The rate's response to torque and voltage, and the voltage.
    fn swing<'a>(&self, missing: &Missing<'a>) -> (Vec<f64>, Option<&'a [f64]>) {
        let n = self.len();
        let mut rate = vec![0.0; n];
        let volts = missing.voltage;
        let (Some(d), true) = (self.drive, missing.torque.is_some() || volts.is_some()) else { return (rate, volts) };
        let lambda = (d.constant_N_m_A.powi(2) * d.per_ohm + d.viscous_N_m_s).max(0.0) / d.inertia_kg_m2;
        let decay = (-lambda * self.dt_s).exp();
        let gain = if lambda * self.dt_s > 1e-9 { (1.0 - decay) / lambda } else { self.dt_s } / d.inertia_kg_m2;
        let mut now = 0.0;
        for k in 0..n {
            if self.begins[k] {
                now = 0.0;
            }
            let push = missing.torque.map_or(0.0, |t| t[k]) + volts.map_or(0.0, |v| d.constant_N_m_A * d.per_ohm * v[k]);
            let next = if self.omega.get(k) == Some(&0.0) { 0.0 } else { now * decay + push * gain };
            rate[k] = 0.5 * (now + next);
            now = next;
        }
        (rate, volts)
    }

    /// Integral of a rate from the begin of each segment.
    fn sums(&self, rate: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        rate.iter()
            .map(|r| {
                sum += r * self.dt_s;
                sum
            })
            .collect()
    }

    fn increments(&self, angle: &[f64], part: &mut [f64]) {
        for k in self.lag..angle.len() {
            part[k] = angle[k] - angle[k - self.lag];
        }
    }

    /// Derivative of a series at a row, by its neighbours within the segment.
    pub fn slope(&self, values: &[f64], k: usize) -> f64 {
        let a = if k == 0 || self.begins[k] { k } else { k - 1 };
        let b = if k + 1 >= values.len() || self.begins[k + 1] { k } else { k + 1 };
        if b > a { (values[b] - values[a]) / (self.t_s[b] - self.t_s[a]).max(self.dt_s) } else { 0.0 }
    }
}

/// The drive as the model has it.
fn drive(record: &PreparedLog, held: &FitResult) -> Option<Drive> {
    let value = |name: &str| held.parameters.list.iter().find(|p| p.name == name).map(|p| p.value);
    let inertia_kg_m2 = value("inertia_kg_m2").filter(|j| *j > 0.0 && record.driven != Input::Motion)?;
    let ohm = value("resistance_ohm").filter(|r| *r > 0.0 && record.driven == Input::Voltage);
    Some(Drive {
        inertia_kg_m2,
        constant_N_m_A: value("motor_constant_N_m_A").unwrap_or(1.0),
        per_ohm: ohm.map_or(0.0, |r| 1.0 / r),
        viscous_N_m_s: value("viscous_N_m_s").unwrap_or(0.0),
    })
}
