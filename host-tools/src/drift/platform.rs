//! The same method with a rate gyro on the turning platform (theory.md §3.4-5): it turns at +w for T and at −w for T, and the integral of the gyro is
//! switched.
//!
//! bias = −I/T² and scale = (S/T² − 2 bias)/w for pulses without ramps. A platform has ramps: its encoder's rate is weighed as the torquer's current is, so that
//! with ∫ W Ω du and ∫∫ Ω of the platform itself both come out exactly.

use super::DriftError;
use super::error::within;
use super::find::by_current;
use super::integral::{Integral, residual_rad_s};
use crate::log::Log;

/// One cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GyroCycle {
    /// When it began, s.
    pub start_s: f64,
    /// Bias, rad/s.
    pub bias_rad_s: f64,
    /// Scale.
    pub scale: f64,
    /// By −I/T² and (S/T² − 2 bias)/w alone.
    pub plain: [f64; 2],
}

/// What many tell.
#[derive(Debug, Clone, PartialEq)]
pub struct GyroAnswer {
    /// The cycles.
    pub cycles: Vec<GyroCycle>,
    /// Bias and its standard error, rad/s.
    pub bias_rad_s: (f64, Option<f64>),
    /// Scale and its standard error.
    pub scale: (f64, Option<f64>),
}

/// A cycle by the gyro's rates and the platform's angles: 2 N + 1 samples each, the rate constant or straight between them.
pub fn cycle(start_s: f64, gyro_rad_s: &[f64], theta_rad: &[f64], pulse_s: f64) -> Option<GyroCycle> {
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
    let scale_plain = (sum - 2.0 * drift) / platform;
    scale.is_finite().then_some(GyroCycle { start_s, bias_rad_s: drift - scale * residual, scale, plain: [drift, scale_plain] })
}

/// All cycles of a log with `theta_rad` and `gyro_rad_s`.
///
/// # Errors
/// A column is missing; no cycle is in it.
pub fn of_log(log: &Log, pulse_s: f64) -> Result<GyroAnswer, DriftError> {
    let name = || log.path().display().to_string();
    within("--pulse", pulse_s, 1e-3, 1e5)?;
    let column = |column: &str| {
        let says = format!("no column `{column}`: the platform's angle and the gyro's rate are needed");
        log.column(column).ok_or_else(|| DriftError::Log { log: name(), says })
    };
    let (gyro, theta) = (column("gyro_rad_s")?, column("theta_rad")?);
    let dt_s = log.median_dt_s();
    let samples = (pulse_s / dt_s).round() as usize;
    if dt_s <= 0.0 || samples == 0 {
        return Err(DriftError::NoCycle { log: name(), pulse_s, why: ": it has one row".into() });
    }
    let rates: Vec<f64> = theta.windows(2).map(|w| (w[1] - w[0]) / dt_s).collect();
    let mut cycles = Vec::new();
    for found in by_current(&rates, samples) {
        let rows = found.rows.start..found.rows.start + 2 * samples + 1;
        if rows.end > gyro.len() {
            continue;
        }
        cycles.extend(cycle(log.t_s()[rows.start], &gyro[rows.clone()], &theta[rows], pulse_s));
    }
    if cycles.is_empty() {
        return Err(DriftError::NoCycle { log: name(), pulse_s, why: " (+w for as long, then −w)".into() });
    }
    let of = |value: &dyn Fn(&GyroCycle) -> f64| {
        let n = cycles.len() as f64;
        let mean = cycles.iter().map(value).sum::<f64>() / n;
        let squares: f64 = cycles.iter().map(|c| (value(c) - mean).powi(2)).sum();
        (mean, (cycles.len() > 1).then(|| (squares / (n - 1.0) / n).sqrt()))
    };
    let (bias_rad_s, scale) = (of(&|c| c.bias_rad_s), of(&|c| c.scale));
    Ok(GyroAnswer { bias_rad_s, scale, cycles })
}
