//! How evenly the simulated stand turns, in its *true* rate.
//!
//! In: a stand, a rate, orders. Out: the amplitude of each order in the plant's own rate over whole turns, and the scatter of the rate over
//! windows of one degree. Neither encoder nor rate sensor is asked. The platform begins a little before its index, so that the
//! firmware sees it on the way; what is measured begins when the loop has settled and the harmonics are in.

use std::f64::consts::{PI, TAU};

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, Record, SessionError, SessionRequest};
use stand_firmware::compensation::Compensation;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::{Compensating, Mode};

/// Where the platform begins, rad from the index: 3° before it.
const BEGIN_RAD: f64 = -PI / 60.0;
/// From the index on, what the loop (poles at 40 rad/s) and the harmonics' coming in (0.1 s) need, s.
const SETTLE_S: f64 = 1.5;
/// Shortest record that is looked at, s; at least a whole turn.
const LOOK_S: f64 = 3.0;

/// The ripple at one rate.
#[derive(Debug, Clone, PartialEq)]
pub struct Ripple {
    /// The rate asked for, rad/s.
    pub rate_rad_s: f64,
    /// Amplitude of each order in the true rate, rad/s.
    pub orders: Vec<(u16, f64)>,
    /// Standard deviation of the mean rates over each degree, relative to the rate.
    pub one_degree: f64,
    /// Harmonics were at work while it was measured.
    pub compensated: bool,
}

/// Why there is no ripple to tell.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RippleError {
    /// The stand cannot be.
    #[error(transparent)]
    Stand(#[from] StandError),
    /// The session cannot be.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The platform did not come round.
    #[error("at {0} rad/s the platform did not turn as far as it was asked to ({1}): there is no ripple to measure")]
    NotTurned(f64, String),
    /// There are harmonics, and they had to stay out.
    #[error("at {0} rad/s the index was not seen, so the orders cannot be compensated: is the platform free to turn, and the index wired?")]
    IndexNotSeen(f64),
}

/// Runs `stand` with `compensation` at `rate_rad_s` (positive) and measures.
///
/// # Errors
/// The stand or its settings cannot be; the platform did not turn.
pub fn ripple(stand: &Stand, compensation: &Compensation, rate_rad_s: f64, orders: &[u16], seed: u64) -> Result<Ripple, RippleError> {
    let mut setup = stand.setup();
    setup.settings.compensation = *compensation;
    let turns = (LOOK_S * rate_rad_s / TAU).ceil().max(1.0);
    let settle_s = SETTLE_S + 2.0 * rate_rad_s / setup.settings.acceleration_rad_s2 - BEGIN_RAD / rate_rad_s;
    let seconds = settle_s + turns * TAU / rate_rad_s + 0.5;
    let profile = ProfileConfig::new(ProfileKind::Constant, rate_rad_s, seed);
    let record = session::run(setup, Plant::new(stand, BEGIN_RAD)?, SessionRequest { mode: Mode::Rate, profile, seconds, seed })?;
    let first = (settle_s * 1e3) as usize;
    let until_rad = record.true_theta_rad.get(first).copied().unwrap_or(f64::INFINITY) + turns * TAU;
    let Some(end) = record.true_theta_rad.iter().position(|theta| *theta >= until_rad) else {
        return Err(RippleError::NotTurned(rate_rad_s, record.note("fault").unwrap_or("it is blocked or too slow").to_owned()));
    };
    let compensated = record.compensating.get(first).is_some_and(|c| c.contains(Compensating::HARMONICS));
    let orders = orders.iter().map(|order| (*order, amplitude(&record, first, end, *order))).collect();
    Ok(Ripple { rate_rad_s, orders, one_degree: one_degree(&record, first, end), compensated })
}

/// Amplitude of an order: least squares in the angle's measure would weigh slow rows less, so each row counts by the angle it covers.
fn amplitude(record: &Record, first: usize, end: usize, order: u16) -> f64 {
    let (theta, omega) = (&record.true_theta_rad, &record.true_omega_rad_s);
    let whole_rad = theta[end] - theta[first];
    let mean = whole_rad / (end - first) as f64 * 1e3;
    let (mut sine, mut cosine) = (0.0, 0.0);
    for k in first..end {
        let middle = 0.5 * (theta[k] + theta[k + 1]);
        let rate = 0.5 * (omega[k] + omega[k + 1]) - mean;
        let weight = theta[k + 1] - theta[k];
        sine += rate * (f64::from(order) * middle).sin() * weight;
        cosine += rate * (f64::from(order) * middle).cos() * weight;
    }
    2.0 * sine.hypot(cosine) / whole_rad
}

/// Scatter of the rates over each whole degree, relative to their mean.
fn one_degree(record: &Record, first: usize, end: usize) -> f64 {
    let (theta, omega) = (&record.true_theta_rad, &record.true_omega_rad_s);
    let degree = PI / 180.0;
    let mut next = (theta[first] / degree).ceil() * degree;
    let (mut last_s, mut rates) = (None, Vec::new());
    for k in first..end {
        while next < theta[k + 1] && next >= theta[k] {
            // Within a row the rate goes straight: one step of Newton's from the chord.
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
