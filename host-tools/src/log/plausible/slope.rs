//! dθ/dt against ω: slope 1 ± 0.05, or a word for what it is.
//!
//! The integral of ω over a window is regressed on the angle turned in it, so that quantisation and noise are small beside the motion
//! (no errors in variables), with the change of ω over the window as a second regressor, which takes up a lag, a delay or an averaging
//! of the rate channel to first order, and an intercept, which takes up its bias.

use std::f64::consts::{PI, TAU};

use super::regress::{Regression, ratio, regress};
use super::windows::{Windows, mean, sd};
use super::{Code, Finding};
use crate::log::Log;

/// Slopes within this of 1 are sound (interfaces.md); of a unit's factor, that unit.
const TOLERANCE: f64 = 0.05;
/// Shortest window, s; and shortest in quanta of the angle turned.
const WINDOW_S: f64 = 0.25;
const QUANTA: f64 = 20.0;
/// Two series belong together where one explains this much of the other: of sound logs it is above 0.999.
const TOGETHER: f64 = 0.9;
/// Motion below this (rms rate about the mean, rad/s), or misfit below so many standard deviations of the rate's white noise, is no
/// ground to say that angle and rate do not belong together.
const FAINT_RAD_S: f64 = 0.1;
const NOISES: f64 = 5.0;
const RATE: &str = "omega_rad_s";
const ANGLE: &str = "theta_rad";

/// Findings about angle and rate.
pub(super) fn check(log: &Log) -> Option<Finding> {
    let (theta, omega) = (log.column(ANGLE)?, log.column(RATE)?);
    let seen = seen_per_turned(log, theta, omega, log.quantum(ANGLE).unwrap_or(0.0))?;
    let together = seen.explained >= TOGETHER || !seen.with_intercept;
    if together && (seen.slope - 1.0).abs() <= TOLERANCE + 3.0 * seen.sigma {
        return None;
    }
    // Exchanged: what is called ω changes as fast as what is called θ says.
    if let Some(other) = seen_per_turned(log, omega, theta, 0.0)
        && (other.slope - 1.0).abs() <= TOLERANCE
        && other.explained > 0.8
        && other.explained > seen.explained
    {
        let says = "theta_rad and omega_rad_s seem to be exchanged: the slope of the second is the first";
        return Some(Finding::new(Code::Swapped, &[ANGLE, RATE], says));
    }
    if let Some(gyro) = log.column("gyro_rad_s")
        && let Some(other) = seen_per_turned(log, theta, gyro, log.quantum(ANGLE).unwrap_or(0.0))
        && (other.slope - 1.0).abs() <= TOLERANCE
        && other.explained > TOGETHER
    {
        let says =
            format!("omega_rad_s is {} × dθ/dt while gyro_rad_s agrees with it: are the two rate columns exchanged?", short(seen.slope));
        return Some(Finding::new(Code::Swapped, &[RATE, "gyro_rad_s"], says));
    }
    if !together {
        if seen.is_faint {
            return None;
        }
        let says = "omega_rad_s and dθ/dt do not belong together: is one of the columns another quantity, or of another recording?";
        return Some(Finding::new(Code::RateDisagrees, &[ANGLE, RATE], says));
    }
    let is_near = |factor: f64| (seen.slope / factor - 1.0).abs() <= TOLERANCE;
    for (size, words) in units() {
        for (factor, sign) in [(size, ""), (-size, ", with the wrong sign")] {
            if is_near(factor) {
                let code = if size == 1.0 { Code::WrongSign } else { Code::WrongUnit };
                let says = format!("omega_rad_s is {} × dθ/dt: {words}{sign}", short(seen.slope))
                    .replace("wrong sign, with the wrong sign", "wrong sign");
                return Some(Finding::new(code, &[ANGLE, RATE], says));
            }
        }
    }
    if !seen.with_intercept {
        // Without a change of rate a bias looks like a slope.
        return None;
    }
    let says =
        format!("omega_rad_s is {} × dθ/dt, and should be 1 ± {TOLERANCE}: check the scale factors of both channels", short(seen.slope));
    let code = if seen.slope < 0.0 { Code::WrongSign } else { Code::RateDisagrees };
    Some(Finding::new(code, &[ANGLE, RATE], says))
}

/// Factors between ω and dθ/dt that have a name.
fn units() -> [(f64, &'static str); 9] {
    [
        (1.0, "one of them has the wrong sign"),
        (180.0 / PI, "is omega_rad_s in degrees per second?"),
        (PI / 180.0, "is theta_rad in degrees?"),
        (30.0 / PI, "is omega_rad_s in turns per minute (rpm)?"),
        (PI / 30.0, "9.55 times too small: is the rate divided by the factor of rpm, or t_s not in seconds?"),
        (1.0 / TAU, "is omega_rad_s in turns per second?"),
        (TAU, "is theta_rad in turns?"),
        (1000.0, "is t_s in milliseconds, or omega_rad_s in mrad/s?"),
        (1e-3, "is theta_rad in mrad?"),
    ]
}

/// How much ω a channel shows for the ω that the angle turns with.
struct Seen {
    slope: f64,
    sigma: f64,
    explained: f64,
    with_intercept: bool,
    /// The motion is so small that noise and drift of the rate may hide it.
    is_faint: bool,
}

fn seen_per_turned(log: &Log, theta: &[f64], omega: &[f64], quantum: f64) -> Option<Seen> {
    let t_s = log.t_s();
    let mut length_s = WINDOW_S.max(20.0 * log.median_dt_s());
    let windows = loop {
        let windows = Windows::of_length(log, length_s);
        let turned = windows.differences(theta);
        let enough = sd(&turned).max(mean(&turned).abs()) >= QUANTA * quantum;
        if enough && windows.rows.len() >= 12 {
            break windows;
        }
        // Too little motion for this encoder, or too short a log, to say anything.
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
    if spread >= QUANTA * quantum && spread > 0.2 * mean(&turned).abs() {
        let Regression { slope, sigma, explained, .. } = regress([&turned, &change], &integral)?;
        let steps: Vec<f64> = omega.windows(2).map(|w| w[1] - w[0]).collect();
        let white = sd(&steps) * (0.5 * length_s * log.median_dt_s()).sqrt();
        let misfit = sd(&integral) * (1.0 - explained).max(0.0).sqrt();
        let is_faint = spread < FAINT_RAD_S * length_s || misfit < NOISES * white;
        return Some(Seen { slope: slope[0], sigma: sigma[0], explained, with_intercept: true, is_faint });
    }
    Some(Seen { slope: ratio(&turned, &integral), sigma: 0.0, explained: 1.0, with_intercept: false, is_faint: false })
}

/// Three digits.
fn short(value: f64) -> String {
    let digits = (2 - value.abs().max(1e-300).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}
