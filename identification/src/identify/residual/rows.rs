//! Residuals with their coordinates, per row or per block of rows, and the response of the residuals to a missing torque, voltage or
//! reading.
//!
//! Residuals are in units of the channel's noise; the channels follow each other in one vector. The response of the rate to a missing
//! torque τ is J δω' = τ − λ J δω with λ J = K²/R + b for a voltage input and b for a current input. The response of the current is −K/R
//! δω; that of the angle's increments is the integral of δω over 20 ms. A voltage v acts as the torque K v/R, and directly as v/R on the
//! current.

use std::ops::Range;

use drive_model::effects::viscous;

use crate::identify::fit::FitResult;
use crate::log::Log;
use crate::model::{BaseParameter, Channel, Input};
use crate::recording::PreparedLog;

/// Constants of the drive that determine the responses.
#[derive(Debug, Clone, Copy)]
pub struct DriveConstants {
    inertia_kg_m2: f64,
    motor_constant_N_m_A: f64,
    /// 1/R, S; 0 unless the voltage is the input.
    conductance_S: f64,
    viscous_N_m_s: f64,
}

/// One compared channel.
#[derive(Debug, Clone)]
pub struct ResidualChannel {
    /// The channel.
    pub channel: Channel,
    /// One unit of `y`, in the unit of the channel.
    pub unit: f64,
    /// Initial sum of squares of the residual, in units of `y`.
    pub power: f64,
}

/// Rows or blocks of rows: columns of equal length n, and the residuals `y` of c channels as c·n values.
#[derive(Debug, Clone)]
pub struct ResidualRows {
    /// Time of the row, s.
    pub t_s: Vec<f64>,
    /// Length of a row, s.
    pub dt_s: f64,
    /// Index of the log (of several), or of the run in it, to which the row belongs.
    pub run: Vec<f64>,
    /// Number of logs or runs.
    pub runs: usize,
    /// True for the first row of a segment.
    pub begins: Vec<bool>,
    /// Angle, not wrapped, rad; empty if not measured.
    pub theta: Vec<f64>,
    /// Modelled rate, rad/s; empty if there is none.
    pub omega: Vec<f64>,
    /// Modelled current, A, or the measured one if it is not modelled; empty if there is none.
    pub current: Vec<f64>,
    /// Winding temperature, °C; empty if not measured.
    pub temp_C: Vec<f64>,
    /// The input, in its unit.
    pub input: Vec<f64>,
    /// Residuals in units of the noise, channel by channel; 0 in rows without comparison.
    pub y: Vec<f64>,
    /// 1 in rows with comparison; per block the square root of their number.
    pub mask: Vec<f64>,
    /// The channels.
    pub channels: Vec<ResidualChannel>,
    /// Rows between the two angles of an increment.
    pub lag: usize,
    /// The drive; `None` for a prescribed motion.
    pub drive: Option<DriveConstants>,
    /// The input of the model.
    pub driven: Input,
}

/// A term that the model lacks, as a series over the rows.
#[derive(Clone, Copy, Default)]
pub struct Disturbance<'a> {
    /// Torque on the rotor, N m.
    pub torque: Option<&'a [f64]>,
    /// Voltage added to the input, V.
    pub voltage: Option<&'a [f64]>,
    /// Error of a channel (index), in its unit.
    pub reading: Option<(usize, &'a [f64])>,
    /// Error of the encoder, rad: added to the angle; its derivative is added to a rate derived from the encoder.
    pub encoder: Option<&'a [f64]>,
}

impl DriveConstants {
    /// Motor constant, N m/A.
    pub fn motor_constant(&self) -> f64 {
        self.motor_constant_N_m_A
    }
}

/// The residual of an angle as that of its increments over `lag` rows; NaN in the first rows of each segment.
fn increments(residual: &[f64], lag: usize, segments: &[Range<usize>]) -> Vec<f64> {
    let mut list = vec![f64::NAN; residual.len()];
    for rows in segments {
        for row in rows.start + lag..rows.end {
            list[row] = residual[row] - residual[row - lag];
        }
    }
    list
}

impl ResidualRows {
    /// The rows of a log; `None` if nothing is compared.
    pub fn new(log: &Log, data: &PreparedLog, fit: &FitResult) -> Option<ResidualRows> {
        let n = data.len();
        let modelled = |channel: Channel| -> Option<Vec<f64>> {
            let measured = data.channels.iter().find(|c| c.channel == channel)?.measured;
            let residual = &fit.channels.iter().find(|c| c.channel == channel)?.residual;
            Some(measured.iter().zip(residual).map(|(y, r)| if r.is_finite() { y - r } else { *y }).collect())
        };
        let column = |name: &str| log.column(name).map(<[f64]>::to_vec);
        let theta = data.theta.map(|theta| theta.iter().map(|v| v + 0.5 * data.theta_quantum).collect::<Vec<f64>>());
        let lag = data.angle_lag();
        let turned = |theta: &Vec<f64>| -> Vec<f64> {
            let slope = |k: usize| {
                let (a, b) = (k.saturating_sub(lag), (k + lag).min(n - 1));
                let span = data.t_s[b] - data.t_s[a];
                if span > 0.0 { (theta[b] - theta[a]) / span } else { 0.0 }
            };
            (0..n).map(slope).collect()
        };
        let omega = modelled(Channel::Rate).or_else(|| theta.as_ref().map(turned)).or_else(|| column("omega_rad_s")).unwrap_or_default();
        let mut begins = vec![false; n];
        for segment in &data.segments {
            if let Some(b) = begins.get_mut(segment.start) {
                *b = true;
            }
        }
        let (mut y, mut mask, mut channels) = (Vec::new(), Vec::new(), Vec::new());
        for f in &fit.channels {
            // Overlapping increments are not independent: one in `lag` is.
            let unit = f.noise
                * match (f.channel, f.is_increment) {
                    (Channel::Angle, true) => (lag as f64).sqrt(),
                    // The noise of a difference of two readings.
                    (Channel::Angle, false) => (2.0 * lag as f64).sqrt(),
                    _ => 1.0,
                };
            if f.residual.len() != n || !unit.is_finite() || unit <= 0.0 {
                return None;
            }
            let at = y.len();
            let residual = if f.channel == Channel::Angle && !f.is_increment {
                increments(&f.residual, lag, &data.segments)
            } else {
                f.residual.clone()
            };
            y.extend(residual.iter().map(|r| if r.is_finite() { r / unit } else { 0.0 }));
            mask.extend(residual.iter().map(|r| if r.is_finite() { 1.0 } else { 0.0 }));
            let power = y[at..].iter().map(|v: &f64| v * v).sum();
            channels.push(ResidualChannel { channel: f.channel, unit, power });
        }
        Some(ResidualRows {
            t_s: data.t_s.to_vec(),
            dt_s: data.dt_s,
            run: log.runs().iter().enumerate().flat_map(|(k, run)| run.rows.clone().map(move |_| k as f64)).collect(),
            runs: log.runs().len(),
            begins,
            theta: theta.unwrap_or_default(),
            omega,
            current: modelled(Channel::Current).or_else(|| column("i_A")).unwrap_or_default(),
            temp_C: column("temp_C").unwrap_or_default(),
            input: data.input.to_vec(),
            y,
            mask,
            channels,
            lag,
            drive: drive_constants(data, fit),
            driven: data.driven,
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

    /// Blocks that begin at `starts`: means of the columns; residuals in units of their noise.
    pub fn blocks(&self, starts: &[usize], of: usize) -> ResidualRows {
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
                // √rows × mean: white noise keeps a variance of 1.
                y.push(if seen > 0.0 { self.y[rows].iter().sum::<f64>() / seen.sqrt() } else { 0.0 });
                mask.push(seen.sqrt());
            }
        }
        ResidualRows {
            t_s: mean(&self.t_s),
            dt_s: self.dt_s * of as f64,
            // A run begins with a segment, and so with a block.
            run: starts.iter().map(|&s| self.run[s]).collect(),
            runs: self.runs,
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

    /// Mean square of each channel of a series in units of `y`, in units of the noise variance.
    pub fn mean_squares(&self, series: &[f64]) -> Vec<f64> {
        let n = self.len();
        let mean = |c: usize| {
            let rows = c * n..(c + 1) * n;
            let compared: f64 = self.mask[rows.clone()].iter().sum();
            // One increment in `lag` counts in `y`.
            let weight = if self.channels[c].channel == Channel::Angle { self.lag as f64 } else { 1.0 };
            weight * series[rows].iter().map(|v| v * v).sum::<f64>() / compared.max(1.0)
        };
        (0..self.channels.len()).map(mean).collect()
    }

    /// Index of a channel.
    pub fn channel(&self, channel: Channel) -> Option<usize> {
        self.channels.iter().position(|c| c.channel == channel)
    }

    /// Response of all channels to a disturbance, in units of `y`.
    pub fn response(&self, disturbance: Disturbance) -> Vec<f64> {
        let n = self.len();
        let mut out = vec![0.0; n * self.channels.len()];
        let (rate, volts) = self.rate_response(&disturbance);
        let turned = self.integral(&rate);
        for (c, channel) in self.channels.iter().enumerate() {
            let part = &mut out[c * n..(c + 1) * n];
            match (channel.channel, self.drive) {
                (Channel::Rate, Some(_)) => part.copy_from_slice(&rate),
                (Channel::Angle, Some(_)) => self.increments(&turned, part),
                (Channel::Current, Some(d)) if d.conductance_S > 0.0 => {
                    for k in 0..n {
                        part[k] = d.conductance_S * (volts.map_or(0.0, |v| v[k]) - d.motor_constant_N_m_A * rate[k]);
                    }
                }
                _ => {}
            }
            if let Some((which, values)) = disturbance.reading.filter(|r| r.0 == c) {
                match self.channels[which].channel {
                    Channel::Angle => self.increments(values, part),
                    _ => part.copy_from_slice(values),
                }
            }
            if let Some(values) = disturbance.encoder {
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

    /// Response of the rate to torque and voltage, and the voltage.
    fn rate_response<'a>(&self, disturbance: &Disturbance<'a>) -> (Vec<f64>, Option<&'a [f64]>) {
        let n = self.len();
        let mut rate = vec![0.0; n];
        let volts = disturbance.voltage;
        let (Some(d), true) = (self.drive, disturbance.torque.is_some() || volts.is_some()) else { return (rate, volts) };
        let lambda = (d.motor_constant_N_m_A.powi(2) * d.conductance_S + d.viscous_N_m_s).max(0.0) / d.inertia_kg_m2;
        let decay = (-lambda * self.dt_s).exp();
        let gain = if lambda * self.dt_s > 1e-9 { (1.0 - decay) / lambda } else { self.dt_s } / d.inertia_kg_m2;
        let mut now = 0.0;
        for k in 0..n {
            if self.begins[k] {
                now = 0.0;
            }
            let torque = disturbance.torque.map_or(0.0, |t| t[k]) + volts.map_or(0.0, |v| d.motor_constant_N_m_A * d.conductance_S * v[k]);
            let next = if self.omega.get(k) == Some(&0.0) { 0.0 } else { now * decay + torque * gain };
            rate[k] = 0.5 * (now + next);
            now = next;
        }
        (rate, volts)
    }

    /// Integral of a rate over all rows.
    fn integral(&self, rate: &[f64]) -> Vec<f64> {
        let mut sum = 0.0;
        rate.iter()
            .map(|r| {
                sum += r * self.dt_s;
                sum
            })
            .collect()
    }

    /// Increments of an angle over `lag` rows.
    fn increments(&self, angle: &[f64], part: &mut [f64]) {
        for k in self.lag..angle.len() {
            part[k] = angle[k] - angle[k - self.lag];
        }
    }

    /// Derivative of a series at row `k`, from its neighbours in the segment.
    pub fn slope(&self, values: &[f64], k: usize) -> f64 {
        let a = if k == 0 || self.begins[k] { k } else { k - 1 };
        let b = if k + 1 >= values.len() || self.begins[k + 1] { k } else { k + 1 };
        if b > a { (values[b] - values[a]) / (self.t_s[b] - self.t_s[a]).max(self.dt_s) } else { 0.0 }
    }
}

/// Constants of the drive from the fitted parameters.
fn drive_constants(data: &PreparedLog, fit: &FitResult) -> Option<DriveConstants> {
    let value = |name: &str| fit.parameters.list.iter().find(|p| p.name == name).map(|p| p.value);
    let base = |parameter: BaseParameter| value(parameter.name());
    let inertia_kg_m2 = base(BaseParameter::Inertia).filter(|j| *j > 0.0 && data.driven != Input::Motion)?;
    let ohm = base(BaseParameter::Resistance).filter(|r| *r > 0.0 && data.driven.is_voltage());
    Some(DriveConstants {
        inertia_kg_m2,
        motor_constant_N_m_A: base(BaseParameter::MotorConstant).unwrap_or(1.0),
        conductance_S: ohm.map_or(0.0, |r| 1.0 / r),
        viscous_N_m_s: value(viscous::CARD.parameters[0].name).unwrap_or(0.0),
    })
}
