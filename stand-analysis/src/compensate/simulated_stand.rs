//! Compensation on the simulated stand: its own measurement of cogging and friction, and the ripple before and after.

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, SessionError};
use stand_firmware::calibration::CalibrationError;

use super::trial::orders_of;
use super::{Learnt, NotCompensated, OrderChange, Ripple, RippleError, ripple};

/// Rates at which the ripple is measured, °/s.
const RATES_DEG_S: [f64; 3] = [10.0, 100.0, 720.0];
/// Angle of the platform at power-on, rad: not at the index, as on most stands.
const START_ANGLE_RAD: f64 = 2.0;

/// Why the stand could not measure itself.
#[derive(Debug, thiserror::Error)]
pub enum SelfMeasurementError {
    /// The description of the stand is invalid.
    #[error(transparent)]
    Stand(#[from] StandError),
    /// The simulation does not run.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The firmware rejected the measurement.
    #[error(transparent)]
    Rejected(#[from] CalibrationError),
}

/// Has the simulated stand measure its cogging and friction; `progress` receives the percentage done.
///
/// # Errors
/// The stand is invalid, or its firmware rejects the measurement.
pub fn measure(stand: &Stand, seed: u64, progress: impl Fn(f64)) -> Result<Learnt, SelfMeasurementError> {
    let plant = Plant::new(stand, START_ANGLE_RAD)?;
    let calibrated = session::calibrate(stand.setup(), Box::new(plant), seed, &|watch| progress(watch.percent().into()))?;
    let found = calibrated.outcome?;
    let mut not_compensated = Vec::new();
    if found.compensation.harmonics.is_empty() {
        not_compensated.push(NotCompensated::NoHarmonic { threshold_N_m: found.threshold_N_m });
    }
    Ok(Learnt { compensation: found.compensation, not_compensated })
}

/// The ripple at 10, 100 and 720 °/s of the stands `before` and `after` compensation.
///
/// # Errors
/// A stand is invalid, does not turn, or does not see its index although it has harmonics to compensate.
pub fn ripple_before_and_after(before: &Stand, after: &Stand, seed: u64) -> Result<Vec<[Ripple; 2]>, RippleError> {
    let harmonics = after.firmware.compensation.harmonics;
    let at_rate = |rate_deg_s: f64| {
        let of = |stand: &Stand| ripple(stand, &stand.firmware.compensation, rate_deg_s.to_radians(), seed);
        let pair = [of(before)?, of(after)?];
        if !harmonics.is_empty() && !pair[1].compensated {
            return Err(RippleError::IndexNotSeen(pair[1].rate_rad_s));
        }
        Ok(pair)
    };
    RATES_DEG_S.into_iter().map(at_rate).collect()
}

/// A change of an order at a rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateChange {
    /// Rate, rad/s.
    pub rate_rad_s: f64,
    /// The order and its amplitudes.
    pub change: OrderChange,
}

/// The orders that are larger with the compensation of `after` than with that of `before`, if it makes the ripple larger at any rate.
pub fn grown(before: &Stand, after: &Stand, ripple: &[[Ripple; 2]]) -> Option<Vec<RateChange>> {
    let orders = orders_of(&before.firmware.compensation, &after.firmware.compensation);
    let at_rate = |[was, is]: &[Ripple; 2]| {
        let rate_rad_s = was.rate_rad_s;
        is.spectrum.grown_from(&was.spectrum, &orders).map(|grown| grown.into_iter().map(move |change| RateChange { rate_rad_s, change }))
    };
    let mut grown = ripple.iter().filter_map(at_rate).peekable();
    grown.peek().is_some().then(|| grown.flatten().collect())
}
