//! The pulse method with a rate gyro on the turning platform (docs/theory.md §3): the platform turns at +w for T and at −w for T, and the integral of the
//! rate gyro is switched.
//!
//! bias = −I/T² and scale = (S/T² − 2 bias)/w for pulses without ramps. The ramps of a real platform are corrected by the rate of its encoder, weighted as
//! the current of a torquer: ∫ W Ω du and ∫∫ Ω.

use super::detection::cycles_by_current;
use super::error::{DriftError, NoCycleReason, within};
use super::estimate::Estimate;
use super::integral::{Integral, residual_rad_s};
use crate::log::Log;

/// One cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlatformCycle {
    /// Begin, s.
    pub start_s: f64,
    /// Bias, rad/s.
    pub bias_rad_s: f64,
    /// Scale.
    pub scale: f64,
    /// Bias, rad/s, and scale by −I/T² and (S/T² − 2 bias)/w, without the correction of the ramps.
    pub uncorrected: [f64; 2],
}

/// Bias and scale over all cycles.
#[derive(Debug, Clone, PartialEq)]
pub struct PlatformResult {
    /// The cycles.
    pub cycles: Vec<PlatformCycle>,
    /// Bias, rad/s.
    pub bias_rad_s: Estimate,
    /// Scale.
    pub scale: Estimate,
}

/// Evaluates a cycle: 2 N + 1 rates of the gyro, rad/s, and angles of the platform, rad; rates are interpolated linearly. `None` for other lengths.
pub fn cycle(start_s: f64, gyro_rad_s: &[f64], theta_rad: &[f64], pulse_s: f64) -> Option<PlatformCycle> {
    let n = gyro_rad_s.len().checked_sub(1)? / 2;
    let dt_s = pulse_s / n as f64;
    let mut angle = 0.0;
    let angles: Vec<f64> = std::iter::once(0.0)
        .chain(gyro_rad_s.windows(2).map(|w| {
            angle += (w[0] + w[1]) / 2.0 * dt_s;
            angle
        }))
        .collect();
    let of_gyro = Integral::of(&angles, pulse_s)?;
    let turned: Vec<f64> = theta_rad.iter().map(|theta| theta - theta_rad[0]).collect();
    let of_platform = Integral::of(&turned, pulse_s)?;
    // θ_gyro = s θ + b t: −I/T² = b + s r with r = ∫ W Ω du; S/T² = 2 b + s S_p/T².
    let residual = residual_rad_s(&theta_rad.windows(2).map(|w| (w[1] - w[0]) / dt_s).collect::<Vec<_>>());
    let (drift, sum, platform) =
        (of_gyro.drift_rad_s(), of_gyro.sum_rad_s / (pulse_s * pulse_s), of_platform.sum_rad_s / (pulse_s * pulse_s));
    let scale = (sum - 2.0 * drift) / (platform - 2.0 * residual);
    let uncorrected_scale = (sum - 2.0 * drift) / platform;
    scale.is_finite().then_some(PlatformCycle {
        start_s,
        bias_rad_s: drift - scale * residual,
        scale,
        uncorrected: [drift, uncorrected_scale],
    })
}

/// Evaluates all cycles of a log with `theta_rad` and `gyro_rad_s`.
///
/// # Errors
/// A column is missing; the log has no cycle.
pub fn of_log(log: &Log, pulse_s: f64) -> Result<PlatformResult, DriftError> {
    let name = || log.path().display().to_string();
    within("--pulse", pulse_s, 1e-3, 1e5)?;
    let column = |column: &'static str| log.column(column).ok_or_else(|| DriftError::PlatformColumn { log: name(), column });
    let (gyro, theta) = (column("gyro_rad_s")?, column("theta_rad")?);
    let dt_s = log.median_dt_s();
    let samples = (pulse_s / dt_s).round() as usize;
    if dt_s <= 0.0 || samples == 0 {
        return Err(DriftError::NoCycle { log: name(), pulse_s, reason: Some(NoCycleReason::OneRow) });
    }
    let rates: Vec<f64> = theta.windows(2).map(|w| (w[1] - w[0]) / dt_s).collect();
    let mut cycles = Vec::new();
    for detected in cycles_by_current(&rates, samples) {
        let rows = detected.rows.start..detected.rows.start + 2 * samples + 1;
        if rows.end > gyro.len() {
            continue;
        }
        cycles.extend(cycle(log.t_s()[rows.start], &gyro[rows.clone()], &theta[rows], pulse_s));
    }
    if cycles.is_empty() {
        return Err(DriftError::NoCycle { log: name(), pulse_s, reason: Some(NoCycleReason::NoPlatformPulses) });
    }
    let of = |value: &dyn Fn(&PlatformCycle) -> f64| {
        let n = cycles.len() as f64;
        let mean = cycles.iter().map(value).sum::<f64>() / n;
        let squares: f64 = cycles.iter().map(|c| (value(c) - mean).powi(2)).sum();
        Estimate { value: mean, sigma: (cycles.len() > 1).then(|| (squares / (n - 1.0) / n).sqrt()) }
    };
    let (bias_rad_s, scale) = (of(&|c| c.bias_rad_s), of(&|c| c.scale));
    Ok(PlatformResult { bias_rad_s, scale, cycles })
}
