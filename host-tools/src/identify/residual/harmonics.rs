//! Periods of a residual: by the turn (orders of the angle) and by the second (lines).
//!
//! Both are found by one transform of sums in bins, so that hundreds of orders cost one pass over the rows. What an order's amplitude does
//! with the rate tells what it is: a torque leaves a/(nω) in the rate, an error of the rate's own reading a, an encoder's error a·nω; so
//! the sums are made with each of these weights.

use crate::statistics::robust::median;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

/// Bins per turn: the 400th order loses 6 % in them.
const BINS: usize = 2048;
/// Highest order that is looked for.
pub const MAX_HARMONIC_ORDER: usize = 400;

/// Amplitudes of a series by order of the angle, with the level that noise of its colour keeps below.
#[derive(Debug, Clone)]
pub struct Spectrum {
    /// Amplitude by order, from order 1 on, in the series' unit per unit of weight.
    pub amplitude: Vec<f64>,
    /// What no order of mere noise exceeds but once in a thousand such spectra, by order: from the neighbouring orders.
    pub level: Vec<f64>,
    /// Part of the series' power that each order accounts for.
    pub share: Vec<f64>,
}

/// Highest order that rows of `dt_s` resolve along this rate (rms, rad/s): four rows to a period.
pub fn resolved(rate_rad_s: f64, dt_s: f64) -> usize {
    let highest = std::f64::consts::FRAC_PI_2 / (rate_rad_s * dt_s).max(1e-12);
    if highest.is_finite() { (highest as usize).clamp(1, MAX_HARMONIC_ORDER) } else { MAX_HARMONIC_ORDER }
}

/// Orders of `value` ≈ weight × (a cos nθ + b sin nθ), n = 1 … `highest`. Rows where any is not finite take no part.
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
    let share = amplitude.iter().map(|a| 0.5 * a * a * weights / f64::max(power, f64::MIN_POSITIVE)).collect();
    Spectrum { level: levels(&amplitude), share, amplitude }
}

/// Orders on either side that show the colour.
const AROUND: usize = 12;

/// Level by order that noise keeps below at 0.1 % over the whole spectrum: squares of amplitudes are exponential, ln 2 at the median.
fn levels(amplitude: &[f64]) -> Vec<f64> {
    let beyond = (1e3 * amplitude.len().max(1) as f64).ln();
    (0..amplitude.len())
        .map(|k| {
            let (from, to) = (k.saturating_sub(AROUND), (k + AROUND + 1).min(amplitude.len()));
            let near = (from..to).filter(|j| *j != k).map(|j| amplitude[j] * amplitude[j]);
            median(near).map_or(f64::INFINITY, |median| (median / 2f64.ln() * beyond).sqrt())
        })
        .collect()
}

/// The largest peaks of a spectrum above its level, as (order, share).
pub fn peaks(s: &Spectrum, count: usize) -> Vec<(u32, f64)> {
    let orders = s.share.iter().zip(s.amplitude.iter().zip(&s.level)).enumerate();
    // The first orders have neighbours on one side only and stand on the slow part of the residual: they are tried in any case.
    let mut list: Vec<(u32, f64)> =
        orders.filter(|(k, (_, (a, level)))| *k < 2 || a > level).map(|(k, (share, _))| (k as u32 + 1, *share)).collect();
    list.sort_by(|a, b| b.1.total_cmp(&a.1));
    list.truncate(count);
    list
}

/// Strongest frequencies (Hz) of an evenly spaced series, refined to a fraction of a line.
pub fn frequencies(value: &[f64], dt_s: f64, count: usize) -> Vec<f64> {
    // Padded by four, so that a line is met within an eighth of its width.
    let padded = (4 * value.len().max(2)).next_power_of_two();
    let mut series = value.to_vec();
    series.resize(padded, 0.0);
    let lines = transform(series);
    let size: Vec<f64> = lines.iter().map(|z| z.norm_sqr()).collect();
    let mut tops: Vec<usize> = (4..size.len().saturating_sub(1)).filter(|&k| size[k] > size[k - 1] && size[k] >= size[k + 1]).collect();
    tops.sort_by(|a, b| size[*b].total_cmp(&size[*a]));
    tops.truncate(count);
    tops.iter().map(|&k| k as f64 / (padded as f64 * dt_s)).collect()
}

/// Transform of a real series; empty where it cannot be made.
pub fn transform(mut series: Vec<f64>) -> Vec<Complex<f64>> {
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(series.len());
    let mut lines = plan.make_output_vec();
    match plan.process(&mut series, &mut lines) {
        Ok(()) => lines,
        Err(_) => Vec::new(),
    }
}
