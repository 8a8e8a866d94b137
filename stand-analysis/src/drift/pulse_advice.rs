//! Advice on the pulse duration, from a log of the angle sensor without pulses.
//!
//! The method weights the rate with a triangle over 2 T, whose response to a vibration of frequency f is sinc²(f T): zero for multiples of
//! its period. The advice is the multiple of the period of the strongest spectral line, near the wanted duration, for which the error by
//! all lines is smallest.

use super::error::{DriftError, within};
use identification::log::Log;
use identification::statistics::Extremes;
use identification::statistics::fourier::transform;
use identification::statistics::robust::median;
use std::f64::consts::PI;

/// Fewest rows of a spectrum.
const MIN_ROWS: usize = 256;
/// Smallest line relative to the strongest.
const MIN_LINE_RATIO: f64 = 0.05;
/// Power of a line over the median of the spectrum: noise exceeds it in 4096 bins in one of 10⁵ logs.
const MIN_LINE_TO_MEDIAN: f64 = 25.0;
/// Error of the position of a line between two bins by the interpolation, in bins.
const MIN_BIN_ERROR: f64 = 1e-3;
/// Most lines reported.
const MAX_LINES: usize = 6;

/// A spectral line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpectralLine {
    /// Frequency, Hz.
    pub frequency_Hz: f64,
    /// Amplitude of the angle, rad.
    pub amplitude_rad: f64,
    /// Half-width of the frequency, Hz.
    pub frequency_error_Hz: f64,
}

/// Advice on the pulse duration.
#[derive(Debug, Clone, PartialEq)]
pub struct PulseAdvice {
    /// Recommended duration T, s.
    pub pulse_s: f64,
    /// Period of the strongest line, s; 0 without lines.
    pub period_s: f64,
    /// Number of periods in T.
    pub periods: u32,
    /// The lines, strongest first.
    pub lines: Vec<SpectralLine>,
    /// Greatest error of one cycle by the lines, for T and for the wanted duration, rad/s.
    pub line_error_rad_s: [f64; 2],
    /// Standard deviation of one cycle by white noise, rad/s.
    pub noise_rad_s: f64,
    /// Spectrum: frequency, Hz, and amplitude, rad.
    pub spectrum: Vec<(f64, f64)>,
}

/// Greatest error of formula (13) by an oscillation of any phase, and of any frequency that the log does not exclude: the rate 2πf a
/// weighted by sinc²(f T), rad/s.
pub fn line_error_rad_s(line: &SpectralLine, pulse_s: f64) -> f64 {
    let at = |frequency_Hz: f64| {
        let x = PI * frequency_Hz * pulse_s;
        let sinc = if x.abs() < 1e-9 { 1.0 } else { x.sin() / x };
        2.0 * PI * frequency_Hz * line.amplitude_rad * sinc * sinc
    };
    [-1.0, 0.0, 1.0].into_iter().map(|side| at(line.frequency_Hz + side * line.frequency_error_Hz)).max_or_zero()
}

/// Advice for pulses of about `wanted_s`; `gain_V_rad` is K_k, without it the note `angle_gain_V_rad` of the log.
///
/// # Errors
/// The column or K_k is missing, the log is too short, a number is out of its range.
pub fn advise(log: &Log, gain_V_rad: Option<f64>, wanted_s: f64) -> Result<PulseAdvice, DriftError> {
    let name = || log.path().display().to_string();
    let missing = || DriftError::Note { log: name(), note: "angle_gain_V_rad" };
    let gain_V_rad = gain_V_rad.or(log.notes().number("angle_gain_V_rad")).ok_or_else(missing)?;
    within("angle_gain_V_rad", gain_V_rad, 1e-9, 1e12)?;
    within("pulse_s", wanted_s, 1e-3, 1e5)?;
    let volts = log.column("angle_sensor_V").ok_or_else(|| DriftError::Column { log: name(), column: "angle_sensor_V".into() })?;
    let longest = log.segments().into_iter().max_by_key(|rows| rows.len()).unwrap_or(0..0);
    let dt_s = log.median_dt_s();
    let angles: Vec<f64> = volts[longest].iter().map(|v| v / gain_V_rad).collect();
    if angles.len() < MIN_ROWS || (angles.len() as f64) * dt_s < 2.0 * wanted_s {
        return Err(DriftError::TooShort { log: name(), length_s: angles.len() as f64 * dt_s, needed_s: 2.0 * wanted_s });
    }
    let amplitudes = spectrum(&detrended(&angles));
    let step_Hz = 1.0 / (angles.len() as f64 * dt_s);
    let median = median(amplitudes.iter().skip(2).map(|a| a * a)).unwrap_or(0.0);
    let lines = lines(&amplitudes, median, step_Hz);
    // The median of |a|² of white noise is ln 2 of its mean; the Hann window has a noise bandwidth of 1.5 bins, and the variance is half
    // the sum of a².
    let white_rad = (median / std::f64::consts::LN_2 * amplitudes.len() as f64 / 2.0 / 1.5).sqrt();
    let (pulse_s, period_s, periods) = match lines.first() {
        None => (wanted_s, 0.0, 0),
        Some(strongest) => best(strongest, &lines, wanted_s),
    };
    let total_error = |pulse_s: f64| lines.iter().map(|line| line_error_rad_s(line, pulse_s).powi(2)).sum::<f64>().sqrt();
    Ok(PulseAdvice {
        pulse_s,
        period_s,
        periods,
        line_error_rad_s: [total_error(pulse_s), total_error(wanted_s)],
        noise_rad_s: (2.0 * dt_s / pulse_s).sqrt() * white_rad / pulse_s,
        spectrum: amplitudes.iter().enumerate().skip(1).map(|(k, a)| (k as f64 * step_Hz, *a)).collect(),
        lines,
    })
}

/// The multiple of the strongest line's period, from 0.7 to 1.4 of the wanted duration, with the smallest error. Returns T, s, the period,
/// s, and their ratio.
fn best(strongest: &SpectralLine, lines: &[SpectralLine], wanted_s: f64) -> (f64, f64, u32) {
    let period_s = 1.0 / strongest.frequency_Hz;
    let fewest = (0.7 * wanted_s / period_s).ceil().max(1.0) as u32;
    let largest = ((1.4 * wanted_s / period_s).floor() as u32).max(fewest);
    // For a fast line only the multiples near the wanted duration.
    let near = (wanted_s / period_s).round().max(1.0) as u32;
    let candidates = (fewest.max(near.saturating_sub(300))..=largest.min(near + 300)).map(|periods| {
        let pulse_s = f64::from(periods) * period_s;
        let error: f64 = lines.iter().map(|line| line_error_rad_s(line, pulse_s).powi(2)).sum::<f64>().sqrt();
        // 1 % of deviation from the wanted duration costs 1 % of the error at the wanted duration.
        let wanted_error = lines.iter().map(|line| line_error_rad_s(line, wanted_s)).max_or_zero();
        (error + wanted_error * 0.01 * ((pulse_s - wanted_s) / wanted_s).abs(), periods)
    });
    let (_, periods) = candidates.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, near));
    (f64::from(periods) * period_s, period_s, periods)
}

fn lines(amplitudes: &[f64], median: f64, step_Hz: f64) -> Vec<SpectralLine> {
    let mut found: Vec<SpectralLine> = (2..amplitudes.len() - 1)
        .filter(|k| {
            let a = amplitudes[*k];
            a >= amplitudes[k - 1] && a > amplitudes[k + 1] && a * a > MIN_LINE_TO_MEDIAN * median && a > 0.0
        })
        .map(|k| {
            // For the Hann window, the ratio of neighbouring bins gives the position of the line between them.
            let (left, mid, right) = (amplitudes[k - 1], amplitudes[k], amplitudes[k + 1]);
            let (side, sign) = if right >= left { (right, 1.0) } else { (left, -1.0) };
            let ratio = side / mid;
            let off = sign * (2.0 * ratio - 1.0) / (1.0 + ratio);
            let x = PI * off;
            let shape = if off.abs() < 1e-6 { 1.0 } else { x.sin() / x / (1.0 - off * off) };
            let amplitude_rad = mid / shape;
            // Rife and Boorstyn (IEEE Trans. Inf. Theory 20 (1974) 591): var f = 6 σ²/(π² a² n L²); with 1.5 for the Hann window, twice that
            // deviation. `median` is that of the power of white noise in a bin, 6 ln 2 σ²/n.
            let white = median / (6.0 * std::f64::consts::LN_2);
            let noise = 2.0 * (1.5 * 6.0 * white).sqrt() / (PI * amplitude_rad);
            SpectralLine { frequency_Hz: (k as f64 + off) * step_Hz, amplitude_rad, frequency_error_Hz: noise.max(MIN_BIN_ERROR) * step_Hz }
        })
        .collect();
    // By the greatest error: a · f times the weight 1/(f T)² of a line.
    found.sort_by(|a, b| (b.amplitude_rad / b.frequency_Hz).total_cmp(&(a.amplitude_rad / a.frequency_Hz)));
    let greatest = found.first().map_or(0.0, |line| line.amplitude_rad / line.frequency_Hz);
    found.retain(|line| line.amplitude_rad / line.frequency_Hz >= MIN_LINE_RATIO * greatest);
    found.truncate(MAX_LINES);
    found
}

/// The angles without their least-squares line, which is the drift.
fn detrended(angles: &[f64]) -> Vec<f64> {
    let n = angles.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = angles.iter().sum::<f64>() / n;
    let slope: f64 = angles.iter().enumerate().map(|(k, a)| (k as f64 - middle) * a).sum::<f64>() * 12.0 / (n * (n * n - 1.0));
    angles.iter().enumerate().map(|(k, a)| a - mean - slope * (k as f64 - middle)).collect()
}

/// Amplitude of a sine in each bin, with the Hann window.
fn spectrum(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let window = |k: usize| 0.5 - 0.5 * (2.0 * PI * k as f64 / n as f64).cos();
    // The mean of the window is ½, and the amplitude of a sine is divided between two bins.
    transform(values.iter().enumerate().map(|(k, v)| v * window(k)).collect()).iter().map(|c| c.norm() * 4.0 / n as f64).collect()
}
