//! Ripple of the *true* rate of the simulated stand.
//!
//! Input: a stand, a rate. Output: the amplitude of each harmonic order in the plant's rate over whole turns, and the standard deviation of
//! the mean rates over one degree. Neither encoder nor rate sensor is used. The platform starts a little before its index, so that the
//! firmware detects the index; the evaluation begins when the loop has settled and the harmonics are active.

use std::f64::consts::{PI, TAU};

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, Record, SessionError, SessionRequest};
use stand_firmware::compensation::Compensation;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::{Compensating, Mode};

use super::OrderSpectrum;

/// Initial angle relative to the index, rad: 3° before it.
const START_RAD: f64 = -PI / 60.0;
/// Settling time after the index, s: loop (poles at 40 rad/s) and fade-in of the harmonics (0.1 s).
const SETTLE_S: f64 = 1.5;
/// Minimum duration of the evaluation, s; at least one whole turn.
const MIN_EVALUATION_S: f64 = 3.0;

/// The ripple at one rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Ripple {
    /// Rate setpoint, rad/s.
    pub rate_rad_s: f64,
    /// Amplitudes of the harmonic orders of the true rate.
    pub spectrum: OrderSpectrum,
    /// Standard deviation of the mean rates over each degree, relative to the rate.
    pub one_degree: f64,
    /// Whether harmonics were compensated during the evaluation.
    pub compensated: bool,
}

/// Reasons why no ripple can be measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RippleError {
    /// Invalid stand.
    #[error(transparent)]
    Stand(#[from] StandError),
    /// Invalid session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The platform did not turn far enough.
    #[error("at {rate_rad_s} rad/s the platform did not turn far enough to measure the ripple: {}", .fault.as_deref().unwrap_or("blocked or too slow"))]
    NotTurned {
        /// Rate setpoint, rad/s.
        rate_rad_s: f64,
        /// The fault that stopped the drive; `None`: there was none.
        fault: Option<String>,
    },
    /// Harmonics are configured and were not active.
    #[error(
        "at {0} rad/s the index was not detected, so the harmonics cannot be compensated; check that the platform turns freely and that the index is wired"
    )]
    IndexNotSeen(f64),
}

/// Runs `stand` with `compensation` at `rate_rad_s` (positive) and measures the ripple.
///
/// # Errors
/// Invalid stand or settings; the platform did not turn.
pub fn ripple(stand: &Stand, compensation: &Compensation, rate_rad_s: f64, seed: u64) -> Result<Ripple, RippleError> {
    let mut setup = stand.setup();
    setup.settings.compensation = *compensation;
    let turns = (MIN_EVALUATION_S * rate_rad_s / TAU).ceil().max(1.0);
    let settle_s = SETTLE_S + 2.0 * rate_rad_s / setup.settings.acceleration_rad_s2 - START_RAD / rate_rad_s;
    let seconds = settle_s + turns * TAU / rate_rad_s + 0.5;
    let profile = ProfileConfig::new(ProfileKind::Constant, rate_rad_s, seed);
    let record = session::run(setup, Plant::new(stand, START_RAD)?, SessionRequest { mode: Mode::Rate, profile, seconds, seed })?;
    let first = (settle_s * 1e3) as usize;
    let until_rad = record.true_theta_rad.get(first).copied().unwrap_or(f64::INFINITY) + turns * TAU;
    let Some(end) = record.true_theta_rad.iter().position(|theta| *theta >= until_rad) else {
        return Err(RippleError::NotTurned { rate_rad_s, fault: record.note("fault").map(str::to_owned) });
    };
    let compensated = record.compensating.get(first).is_some_and(|c| c.contains(Compensating::HARMONICS));
    Ok(Ripple { rate_rad_s, spectrum: spectrum(&record, first, end), one_degree: one_degree(&record, first, end), compensated })
}

/// Harmonic orders over the angle; each row is weighted by the angle that it covers.
fn spectrum(record: &Record, first: usize, end: usize) -> OrderSpectrum {
    let (theta, omega) = (&record.true_theta_rad, &record.true_omega_rad_s);
    let mean = (theta[end] - theta[first]) / (end - first) as f64 * 1e3;
    OrderSpectrum::of((first..end).map(|k| {
        let middle = 0.5 * (theta[k] + theta[k + 1]);
        (middle, 0.5 * (omega[k] + omega[k + 1]) - mean, theta[k + 1] - theta[k])
    }))
}

/// Standard deviation of the mean rates over each whole degree, relative to their mean.
fn one_degree(record: &Record, first: usize, end: usize) -> f64 {
    let (theta, omega) = (&record.true_theta_rad, &record.true_omega_rad_s);
    let degree = PI / 180.0;
    let mut next = (theta[first] / degree).ceil() * degree;
    let (mut last_s, mut rates) = (None, Vec::new());
    for k in first..end {
        while next < theta[k + 1] && next >= theta[k] {
            // The rate is linear within a row: one Newton step from the chord.
            let slope = (omega[k + 1] - omega[k]) * 1e3;
            let chord = (next - theta[k]) / (theta[k + 1] - theta[k]) * 1e-3;
            let at = theta[k] + (omega[k] + 0.5 * slope * chord) * chord;
            let t_s = k as f64 * 1e-3 + chord + (next - at) / (omega[k] + slope * chord);
            rates.extend(last_s.map(|last| degree / (t_s - last)));
            last_s = Some(t_s);
            next += degree;
        }
    }
    let mean = rates.iter().sum::<f64>() / rates.len().max(1) as f64;
    let variance = rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>() / rates.len().max(1) as f64;
    variance.sqrt() / mean.abs()
}
