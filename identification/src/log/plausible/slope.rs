//! dθ/dt against ω: the slope must be 1 ± 0.05.
//!
//! The integral of ω over a window is regressed on the angle turned in the window, so that quantisation and noise are small relative to
//! the motion (no errors in variables). The second regressor is the change of ω over the window, which represents a lag, a delay or an
//! averaging of the rate channel to first order; the intercept represents its bias.

use std::f64::consts::{PI, TAU};

use super::regress::{Regression, ratio, regress};
use super::windows::{Windows, mean, sd};
use super::{Defect, UnitError};
use crate::log::Log;

/// Tolerance of the slope about 1, and about the factor of a unit error.
pub const SLOPE_TOLERANCE: f64 = 0.05;
/// Shortest window, s.
const MIN_WINDOW_S: f64 = 0.25;
/// Least motion per window, in quanta of the angle.
const MIN_QUANTA: f64 = 20.0;
/// Least explained fraction of two series that are related; sound logs have more than 0.999.
const MIN_EXPLAINED_FRACTION: f64 = 0.9;
/// Below this motion (rms rate about the mean, rad/s) no statement about unrelated columns is made.
const MIN_RATE_RMS_RAD_S: f64 = 0.1;
/// Below this misfit, in standard deviations of the rate's white noise, no statement about unrelated columns is made.
const MIN_MISFIT_SIGMAS: f64 = 5.0;
const RATE: &str = "omega_rad_s";
const ANGLE: &str = "theta_rad";

/// A defect of angle and rate.
pub(super) fn check(log: &Log) -> Option<Defect> {
    let (theta, omega) = (log.column(ANGLE)?, log.column(RATE)?);
    let fit = rate_over_derivative(log, theta, omega, log.quantization_step(ANGLE).unwrap_or(0.0))?;
    let related = fit.explained >= MIN_EXPLAINED_FRACTION || !fit.with_intercept;
    if related && (fit.slope - 1.0).abs() <= SLOPE_TOLERANCE + 3.0 * fit.sigma {
        return None;
    }
    // With the columns exchanged the slope is 1.
    if let Some(other) = rate_over_derivative(log, omega, theta, 0.0)
        && (other.slope - 1.0).abs() <= SLOPE_TOLERANCE
        && other.explained > 0.8
        && other.explained > fit.explained
    {
        return Some(Defect::ExchangedAngleAndRate);
    }
    if let Some(gyro) = log.column("gyro_rad_s")
        && let Some(other) = rate_over_derivative(log, theta, gyro, log.quantization_step(ANGLE).unwrap_or(0.0))
        && (other.slope - 1.0).abs() <= SLOPE_TOLERANCE
        && other.explained > MIN_EXPLAINED_FRACTION
    {
        return Some(Defect::ExchangedRates { ratio: fit.slope });
    }
    if !related {
        return (!fit.is_weak).then_some(Defect::UnrelatedRate);
    }
    let ratio = fit.slope;
    let is_near = |factor: f64| (ratio / factor - 1.0).abs() <= SLOPE_TOLERANCE;
    if is_near(-1.0) {
        return Some(Defect::RateScale { ratio, unit: None });
    }
    if let Some((_, unit)) = UNIT_ERRORS.into_iter().find(|(factor, _)| is_near(*factor) || is_near(-factor)) {
        return Some(Defect::RateScale { ratio, unit: Some(unit) });
    }
    // Without a change of the rate a bias is not distinguishable from a slope.
    fit.with_intercept.then_some(Defect::RateScale { ratio, unit: None })
}

/// Unit errors with the factor that each gives ω over dθ/dt.
const UNIT_ERRORS: [(f64, UnitError); 8] = [
    (180.0 / PI, UnitError::RateInDegrees),
    (PI / 180.0, UnitError::AngleInDegrees),
    (30.0 / PI, UnitError::RateInRpm),
    (PI / 30.0, UnitError::RateDividedByRpm),
    (1.0 / TAU, UnitError::RateInRevolutions),
    (TAU, UnitError::AngleInRevolutions),
    (1000.0, UnitError::Milliseconds),
    (1e-3, UnitError::AngleInMilliradians),
];

/// Slope of a rate channel over the derivative of an angle.
struct SlopeFit {
    slope: f64,
    sigma: f64,
    explained: f64,
    with_intercept: bool,
    /// The motion is so small that noise and drift of the rate may hide it.
    is_weak: bool,
}

fn rate_over_derivative(log: &Log, theta: &[f64], omega: &[f64], quantum: f64) -> Option<SlopeFit> {
    let t_s = log.t_s();
    let mut length_s = MIN_WINDOW_S.max(20.0 * log.median_dt_s());
    let windows = loop {
        let windows = Windows::of_length(log, length_s);
        let turned = windows.differences(theta);
        let enough = sd(&turned).max(mean(&turned).abs()) >= MIN_QUANTA * quantum;
        if enough && windows.rows.len() >= 12 {
            break windows;
        }
        // Too little motion for this encoder, or too short a log.
        if enough || windows.rows.len() < 24 {
            return None;
        }
        length_s *= 2.0;
    };
    let turned = windows.differences(theta);
    let integral = windows.integrals(omega, t_s);
    let smooth = |at: usize| {
        let reach = ((0.005 / log.median_dt_s()) as usize).clamp(0, 20);
        mean(&omega[at.saturating_sub(reach)..(at + reach + 1).min(omega.len())])
    };
    let change: Vec<f64> = windows.rows.iter().map(|r| smooth(r.end) - smooth(r.start)).collect();
    let spread = sd(&turned);
    if spread >= MIN_QUANTA * quantum && spread > 0.2 * mean(&turned).abs() {
        let Regression { slope, sigma, explained, .. } = regress([&turned, &change], &integral)?;
        let steps: Vec<f64> = omega.windows(2).map(|w| w[1] - w[0]).collect();
        let white = sd(&steps) * (0.5 * length_s * log.median_dt_s()).sqrt();
        let misfit = sd(&integral) * (1.0 - explained).max(0.0).sqrt();
        let is_weak = spread < MIN_RATE_RMS_RAD_S * length_s || misfit < MIN_MISFIT_SIGMAS * white;
        return Some(SlopeFit { slope: slope[0], sigma: sigma[0], explained, with_intercept: true, is_weak });
    }
    Some(SlopeFit { slope: ratio(&turned, &integral), sigma: 0.0, explained: 1.0, with_intercept: false, is_weak: false })
}
