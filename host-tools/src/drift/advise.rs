//! How long a pulse should be: from a log of the angle sensor with the loop open, or closed and quiet, and no pulses.
//!
//! The method weighs the drift with a triangle over 2 T, whose response to a vibration of frequency f is sinc²(f T): nothing at whole multiples of its period.
//! So: the strongest line of the angle's spectrum, and of the durations near the one that is wanted the multiple of its period for which all lines together
//! leave least.

use super::DriftError;
use super::error::within;
use crate::log::Log;
use crate::statistics::Extremes;
use crate::statistics::robust::median;
use realfft::RealFftPlanner;
use std::f64::consts::PI;

/// Lines below this share of the greatest are noise to nobody's harm.
const LEAST_SHARE: f64 = 0.05;
/// A line stands out of the median of the spectrum by this factor: of 4096 bins of noise one in 10⁵ logs has one by chance.
const STANDS_OUT: f64 = 25.0;
/// Most lines that are told.
const MOST_LINES: usize = 6;

/// A line of the spectrum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its frequency, Hz.
    pub frequency_Hz: f64,
    /// Amplitude of the angle, rad.
    pub amplitude_rad: f64,
}

/// The advice.
#[derive(Debug, Clone, PartialEq)]
pub struct Advice {
    /// T, s.
    pub pulse_s: f64,
    /// The period that it is a multiple of, s; 0: no line was found.
    pub period_s: f64,
    /// How many periods.
    pub periods: u32,
    /// The lines, the strongest first.
    pub lines: Vec<Line>,
    /// What they leave at most in one cycle of this T, and of the one that was wanted, rad/s.
    pub leaves_rad_s: [f64; 2],
    /// Scatter of one cycle by the rest, white, rad/s.
    pub noise_rad_s: f64,
    /// Amplitudes over frequency, for the picture: Hz, rad.
    pub spectrum: Vec<(f64, f64)>,
}

/// Most that an oscillation of the angle leaves in (13), whatever its phase: a rate of 2πf a, weighed by sinc²(f T), rad/s.
pub fn leaves_rad_s(line: &Line, pulse_s: f64) -> f64 {
    let x = PI * line.frequency_Hz * pulse_s;
    let sinc = if x.abs() < 1e-9 { 1.0 } else { x.sin() / x };
    2.0 * PI * line.frequency_Hz * line.amplitude_rad * sinc * sinc
}

/// Advice for pulses of about `wanted_s`; `gain_V_rad`: K_k.
///
/// # Errors
/// No column, a log too short, numbers that make no sense.
pub fn advise(log: &Log, gain_V_rad: f64, wanted_s: f64) -> Result<Advice, DriftError> {
    let name = || log.path().display().to_string();
    within("--angle-gain", gain_V_rad, 1e-9, 1e12)?;
    within("--pulse", wanted_s, 1e-3, 1e5)?;
    let volts = log.column("angle_sensor_V").ok_or_else(|| DriftError::Column { log: name(), column: "angle_sensor_V".into() })?;
    let longest = log.segments().into_iter().max_by_key(|rows| rows.len()).unwrap_or(0..0);
    let dt_s = log.median_dt_s();
    let angles: Vec<f64> = volts[longest].iter().map(|v| v / gain_V_rad).collect();
    if angles.len() < 256 || (angles.len() as f64) * dt_s < 2.0 * wanted_s {
        let says = format!(
            "{} s without a gap are too short: the static log should last twice the pulse, {} s",
            angles.len() as f64 * dt_s,
            2.0 * wanted_s
        );
        return Err(DriftError::Log { log: name(), says });
    }
    let amplitudes = spectrum(&detrended(&angles));
    let step_Hz = 1.0 / (angles.len() as f64 * dt_s);
    let median = median(amplitudes.iter().skip(2).map(|a| a * a)).unwrap_or(0.0);
    let lines = lines(&amplitudes, median, step_Hz);
    // The median of |a|² of white noise is ln 2 of its mean; Hann's window has 1.5 bins of noise, and a sample's variance is half the sum of a².
    let white_rad = (median / std::f64::consts::LN_2 * amplitudes.len() as f64 / 2.0 / 1.5).sqrt();
    let (pulse_s, period_s, periods) = match lines.first() {
        None => (wanted_s, 0.0, 0),
        Some(strongest) => best(strongest, &lines, wanted_s),
    };
    let leaves = |pulse_s: f64| lines.iter().map(|line| leaves_rad_s(line, pulse_s).powi(2)).sum::<f64>().sqrt();
    Ok(Advice {
        pulse_s,
        period_s,
        periods,
        leaves_rad_s: [leaves(pulse_s), leaves(wanted_s)],
        noise_rad_s: (2.0 * dt_s / pulse_s).sqrt() * white_rad / pulse_s,
        spectrum: amplitudes.iter().enumerate().skip(1).map(|(k, a)| (k as f64 * step_Hz, *a)).collect(),
        lines,
    })
}

/// Of the multiples of the strongest line's period from half to twice what is wanted, the one that leaves least; the nearest of equals.
fn best(strongest: &Line, lines: &[Line], wanted_s: f64) -> (f64, f64, u32) {
    let period_s = 1.0 / strongest.frequency_Hz;
    let least = (0.7 * wanted_s / period_s).ceil().max(1.0) as u32;
    let most = ((1.4 * wanted_s / period_s).floor() as u32).max(least);
    // Not every multiple of a fast line: a few hundred near the wanted one.
    let near = (wanted_s / period_s).round().max(1.0) as u32;
    let candidates = (least.max(near.saturating_sub(300))..=most.min(near + 300)).map(|periods| {
        let pulse_s = f64::from(periods) * period_s;
        let leaves: f64 = lines.iter().map(|line| leaves_rad_s(line, pulse_s).powi(2)).sum::<f64>().sqrt();
        // 1 % farther from what is wanted is worth a hundredth of what the wanted one leaves.
        let floor = lines.iter().map(|line| leaves_rad_s(line, wanted_s)).max_or_zero();
        (leaves + floor * 0.01 * ((pulse_s - wanted_s) / wanted_s).abs(), periods)
    });
    let (_, periods) = candidates.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((0.0, near));
    (f64::from(periods) * period_s, period_s, periods)
}

fn lines(amplitudes: &[f64], median: f64, step_Hz: f64) -> Vec<Line> {
    let mut found: Vec<Line> = (2..amplitudes.len() - 1)
        .filter(|k| {
            let a = amplitudes[*k];
            a >= amplitudes[k - 1] && a > amplitudes[k + 1] && a * a > STANDS_OUT * median && a > 0.0
        })
        .map(|k| {
            // Hann's window: the ratio of the neighbours tells where between the bins the line is.
            let (left, mid, right) = (amplitudes[k - 1], amplitudes[k], amplitudes[k + 1]);
            let (side, sign) = if right >= left { (right, 1.0) } else { (left, -1.0) };
            let ratio = side / mid;
            let off = sign * (2.0 * ratio - 1.0) / (1.0 + ratio);
            let x = PI * off;
            let shape = if off.abs() < 1e-6 { 1.0 } else { x.sin() / x / (1.0 - off * off) };
            Line { frequency_Hz: (k as f64 + off) * step_Hz, amplitude_rad: mid / shape }
        })
        .collect();
    // The strongest in what it leaves, were it met at its worst: a · f, less what a fast one is weighed down anyway, is 1/(f T²).
    found.sort_by(|a, b| (b.amplitude_rad / b.frequency_Hz).total_cmp(&(a.amplitude_rad / a.frequency_Hz)));
    let greatest = found.first().map_or(0.0, |line| line.amplitude_rad / line.frequency_Hz);
    found.retain(|line| line.amplitude_rad / line.frequency_Hz >= LEAST_SHARE * greatest);
    found.truncate(MOST_LINES);
    found
}

/// Without its straight line, which is the drift.
fn detrended(angles: &[f64]) -> Vec<f64> {
    let n = angles.len() as f64;
    let middle = (n - 1.0) / 2.0;
    let mean = angles.iter().sum::<f64>() / n;
    let slope: f64 = angles.iter().enumerate().map(|(k, a)| (k as f64 - middle) * a).sum::<f64>() * 12.0 / (n * (n * n - 1.0));
    angles.iter().enumerate().map(|(k, a)| a - mean - slope * (k as f64 - middle)).collect()
}

/// Amplitudes of a sine at each bin, by Hann's window.
fn spectrum(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let window = |k: usize| 0.5 - 0.5 * (2.0 * PI * k as f64 / n as f64).cos();
    let mut input: Vec<f64> = values.iter().enumerate().map(|(k, v)| v * window(k)).collect();
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut output = plan.make_output_vec();
    if plan.process(&mut input, &mut output).is_err() {
        return vec![0.0; n / 2 + 1];
    }
    // The window's mean is ½, and a sine's amplitude is in two bins.
    output.iter().map(|c| c.norm() * 4.0 / n as f64).collect()
}
