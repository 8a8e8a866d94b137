//! Fit of one channel: residual, noise estimate, whiteness.

use super::covariance::NoiseColour;
use super::noise;
use crate::model::Channel;
use crate::recording::prepared_log::PreparedLog;
use crate::statistics::Extremes;

/// Lags of the Ljung–Box test.
const WHITENESS_LAGS: usize = 20;
/// Least p-value of a white residual.
const MIN_WHITE_P: f64 = 1e-3;
/// χ²/n above which the residual is dominated by the misfit, not by the noise.
pub(super) const MAX_NOISE_CHI2_PER_N: f64 = 1.5;

/// Fit of one channel.
#[derive(Debug, Clone)]
pub struct ChannelFit {
    /// The channel.
    pub channel: Channel,
    /// An angle is compared by its increments over 20 ms.
    pub is_increment: bool,
    /// Root mean square of the residual over the fitted rows, in the unit of the channel.
    pub rms: f64,
    /// Root mean square of the residual over the held-out rows; `None` if no rows are held out.
    pub heldout_rms: Option<f64>,
    /// Estimated standard deviation of the noise, in the unit of the channel.
    pub noise: f64,
    /// 100 (1 − ‖residual‖/‖measured − mean‖).
    pub fit_percent: f64,
    /// p-value of the Ljung–Box test of the residual.
    pub white_p: f64,
    /// Number of compared rows, including held-out rows.
    pub rows: usize,
    /// Measured minus modelled, per row of the log; NaN in rows without comparison.
    pub residual: Vec<f64>,
}

impl ChannelFit {
    /// The fit of channel `index`, from its noise and residual.
    pub(super) fn new(data: &PreparedLog, index: usize, noise: f64, residual: Vec<f64>) -> Self {
        let rms = |held_out: bool| {
            let (sum, n) = residual
                .iter()
                .enumerate()
                .filter(|(row, r)| !r.is_nan() && data.held_out(*row) == held_out)
                .fold((0.0, 0usize), |(s, n), (_, r)| (s + r * r, n + 1));
            (n > 0).then(|| (sum / n as f64).sqrt())
        };
        let spread = spread(data, index);
        let compared = compared(&residual);
        let rms_of_all = (compared.iter().map(|r| r * r).sum::<f64>() / compared.len().max(1) as f64).sqrt();
        let channel = data.channels[index].channel;
        let (_, white_p) = noise::ljung_box(&compared, independent_every(data, index), WHITENESS_LAGS);
        ChannelFit {
            channel,
            is_increment: channel == Channel::Angle && !data.angle_is_absolute(),
            rms: rms(false).unwrap_or(rms_of_all),
            heldout_rms: rms(true),
            noise,
            fit_percent: if spread > 0.0 { 100.0 * (1.0 - rms_of_all / spread) } else { 0.0 },
            white_p,
            rows: compared.len(),
            residual,
        }
    }

    /// Mean square of the residual over the variance of the noise.
    pub fn chi2_per_n(&self) -> f64 {
        (self.rms / self.noise).powi(2)
    }

    /// The residual is not distinguishable from white noise (p > 0.001).
    pub fn white(&self) -> bool {
        self.white_p > MIN_WHITE_P
    }

    /// Factor by which the variance of a slowly varying estimate exceeds that of white noise of the same size, at least 1.
    pub fn slow_variance(&self) -> f64 {
        let compared = compared(&self.residual);
        noise::inflation(&compared).max(noise::slow_inflation(&compared, self.noise)).max(1.0)
    }

    /// Colour of the noise of channel `index` for the covariance.
    pub(super) fn noise_colour(&self, data: &PreparedLog, index: usize) -> NoiseColour {
        let misfit = self.chi2_per_n().max(1.0);
        let compared = compared(&self.residual);
        if misfit >= MAX_NOISE_CHI2_PER_N {
            return NoiseColour { differencing_rows: 0, inflation: misfit * noise::inflation(&compared) };
        }
        let differencing_rows = differencing_rows(data, index);
        let correlation = if differencing_rows > 0 { 1.0 } else { self.slow_variance() };
        NoiseColour { differencing_rows, inflation: misfit * correlation }
    }
}

/// Rows between values of a channel that share no reading: an increment over m rows has one in common with the increments up to m rows
/// before and after.
pub(super) fn independent_every(data: &PreparedLog, index: usize) -> usize {
    if data.channels[index].channel == Channel::Angle && !data.angle_is_absolute() {
        2 * data.angle_lag()
    } else {
        differencing_rows(data, index).max(1) * 2 - 1
    }
}

/// Standard deviation of the measured values of channel `index`, in the unit of the channel.
pub fn spread(data: &PreparedLog, index: usize) -> f64 {
    let targets: Vec<f64> =
        data.segments.iter().flat_map(|rows| rows.clone().filter_map(|row| data.target(index, row, rows.start))).collect();
    let n = targets.len().max(1) as f64;
    let mean = targets.iter().sum::<f64>() / n;
    (targets.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// The residuals of the compared rows.
pub(super) fn compared(residual: &[f64]) -> Vec<f64> {
    residual.iter().copied().filter(|r| !r.is_nan()).collect()
}

/// Number of rows over which white noise was differenced in this channel; 0 if it was not.
pub(crate) fn differencing_rows(data: &PreparedLog, channel: usize) -> usize {
    let c = &data.channels[channel];
    if data.angle_is_absolute() && (data.predictor.is_some() || c.channel == Channel::Angle) {
        // Innovations are independent, and so are the errors of readings.
        return 0;
    }
    match c.channel {
        Channel::Angle => data.angle_lag(),
        Channel::Rate if data.rate_from_encoder => c.mean_before_s.map_or(0, |window_s| ((window_s / data.dt_s).round() as usize).max(1)),
        _ => 0,
    }
}

/// Least noise of a channel, so that its weight is finite.
fn noise_floor(data: &PreparedLog, channel: usize) -> f64 {
    let c = &data.channels[channel];
    let size = c.measured.iter().copied().max_abs();
    let quantised = c.quantum.map_or(0.0, |q| q / 12f64.sqrt());
    quantised.max(1e-9 * size).max(1e-15)
}

/// Noise of a channel estimated from the measured series, before any fit.
pub(crate) fn noise_of_series(data: &PreparedLog, channel: usize) -> f64 {
    let c = &data.channels[channel];
    let scale = if c.channel == Channel::Angle && !data.absolute_angle { 2f64.sqrt() } else { 1.0 };
    (noise::of_series(c.measured.iter().copied()) * scale).max(noise_floor(data, channel))
}

/// Noise of a channel estimated from its residual.
pub(super) fn noise_of_residual(data: &PreparedLog, channel: usize, residual: &[f64]) -> f64 {
    let c = &data.channels[channel];
    let correlation = c.filter_hz.map_or(0.0, |hz| (-std::f64::consts::TAU * hz * data.dt_s).exp());
    let fine = noise::of_residuals(residual, correlation);
    let quantised = match (c.channel, c.quantum) {
        (Channel::Angle, Some(quantum)) if !data.absolute_angle => quantisation_noise(data, channel, residual, quantum),
        _ => 0.0,
    };
    fine.max(quantised).max(noise_floor(data, channel))
}

/// Quantisation noise of the angle's increments along the modelled motion: below LSB/√6 near rest, and not white where the rate beats with
/// the row rate, so that differences of residuals do not give it.
fn quantisation_noise(data: &PreparedLog, channel: usize, residual: &[f64], quantum: f64) -> f64 {
    let lag = data.angle_lag();
    let (mut sum, mut n) = (0.0, 0usize);
    for rows in &data.segments {
        for first in 0..lag.min(rows.len()) {
            // Each chain of increments starts at another phase within the count.
            let mut path = (first as f64 + 0.5) / lag as f64;
            let mut error = path.floor() - path;
            for row in (rows.start + first + lag..rows.end).step_by(lag) {
                let Some(target) = data.target(channel, row, rows.start) else { continue };
                path += (target - residual[row]) / quantum;
                let next = path.floor() - path;
                sum += (next - error).powi(2);
                error = next;
                n += 1;
            }
        }
    }
    if n > 0 { quantum * (sum / n as f64).sqrt() } else { 0.0 }
}
