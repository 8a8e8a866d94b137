//! Periodic components of a residual: harmonics of the angle, and lines in time.
//!
//! A Fourier transform of sums in bins of the angle gives hundreds of harmonics in one pass over the rows. The dependence of the amplitude
//! on the rate discriminates the causes: in the rate, a torque gives a/(nω), an error of the rate sensor a, an encoder error a·nω. The sums
//! are therefore weighted in each of these ways.

use crate::statistics::fourier::transform;
use crate::statistics::robust::median;

/// Bins per revolution: harmonic 400 loses 6 % of its amplitude.
const BINS: usize = 2048;
/// Highest harmonic order that is searched.
pub const MAX_HARMONIC_ORDER: usize = 400;

/// Spectrum of a series over the harmonic order, with the level of noise of the same colour.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// Amplitude by harmonic order from 1 on, in the unit of the series per unit of weight.
    pub amplitude: Vec<f64>,
    /// Level that the largest peak of noise exceeds in one of 1000 spectra, by harmonic order, from the neighbouring orders.
    pub level: Vec<f64>,
    /// Fraction of the power of the series, by harmonic order.
    pub fraction: Vec<f64>,
}

/// Highest harmonic order that rows of `dt_s` resolve at this rate (rms, rad/s): four rows per period.
pub fn resolvable_order(rate_rad_s: f64, dt_s: f64) -> usize {
    let highest = std::f64::consts::FRAC_PI_2 / (rate_rad_s * dt_s).max(1e-12);
    if highest.is_finite() { (highest as usize).clamp(1, MAX_HARMONIC_ORDER) } else { MAX_HARMONIC_ORDER }
}

/// Spectrum of `value` ≈ weight × (a cos nθ + b sin nθ), n = 1 … `highest`. Rows with a value that is not finite are ignored.
pub fn spectrum(theta: &[f64], value: &[f64], weight: impl Fn(usize) -> f64, highest: usize) -> Spectrum {
    let mut sums = vec![0.0; BINS];
    let (mut weights, mut power) = (0.0, 0.0);
    let per_turn = BINS as f64 / std::f64::consts::TAU;
    for (k, (angle, v)) in theta.iter().zip(value).enumerate() {
        let w = weight(k);
        if !(v.is_finite() && w.is_finite() && angle.is_finite()) {
            continue;
        }
        let bin = (angle * per_turn).rem_euclid(BINS as f64) as usize;
        if let Some(sum) = sums.get_mut(bin) {
            *sum += v * w;
            weights += w * w;
            power += v * v;
        }
    }
    let lines = transform(sums);
    let scale = 2.0 / f64::max(weights, f64::MIN_POSITIVE);
    let amplitude: Vec<f64> = lines.iter().skip(1).take(highest).map(|z| scale * z.norm()).collect();
    let fraction = amplitude.iter().map(|a| 0.5 * a * a * weights / f64::max(power, f64::MIN_POSITIVE)).collect();
    Spectrum { level: levels(&amplitude), fraction, amplitude }
}

/// Neighbouring orders on either side that give the noise level.
const NEIGHBOURS: usize = 12;

/// Noise level by order, at 0.1 % for the whole spectrum. Squared amplitudes of noise have an exponential distribution with median ln 2.
fn levels(amplitude: &[f64]) -> Vec<f64> {
    let beyond = (1e3 * amplitude.len().max(1) as f64).ln();
    (0..amplitude.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(NEIGHBOURS), (k + NEIGHBOURS + 1).min(amplitude.len()));
            let near = (from..to).filter(|j| *j != k).map(|j| amplitude[j] * amplitude[j]);
            median(near).map_or(f64::INFINITY, |median| (median / 2f64.ln() * beyond).sqrt())
        })
        .collect()
}

/// The largest peaks of a spectrum above the noise level, as (harmonic order, fraction).
pub fn peaks(s: &Spectrum, count: usize) -> Vec<(u32, f64)> {
    let orders = s.fraction.iter().zip(s.amplitude.iter().zip(&s.level)).enumerate();
    // The first orders have neighbours on one side only and contain slow residuals: they are always included.
    let mut list: Vec<(u32, f64)> =
        orders.filter(|(k, (_, (a, level)))| *k < 2 || a > level).map(|(k, (fraction, _))| (k as u32 + 1, *fraction)).collect();
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    list.truncate(count);
    list
}

/// Strongest frequencies, Hz, of an evenly sampled series.
pub fn frequencies(value: &[f64], dt_s: f64, count: usize) -> Vec<f64> {
    // Zero-padded four times: the error of a line is at most an eighth of its width.
    let padded = (4 * value.len().max(2)).next_power_of_two();
    let mut series = value.to_vec();
    series.resize(padded, 0.0);
    let lines = transform(series);
    let size: Vec<f64> = lines.iter().map(|z| z.norm_sqr()).collect();
    let mut peaks: Vec<usize> = (4..size.len().saturating_sub(1)).filter(|&k| size[k] > size[k - 1] && size[k] >= size[k + 1]).collect();
    peaks.sort_by(|a, b| size[*b].total_cmp(&size[*a]));
    peaks.truncate(count);
    peaks.iter().map(|&k| k as f64 / (padded as f64 * dt_s)).collect()
}
