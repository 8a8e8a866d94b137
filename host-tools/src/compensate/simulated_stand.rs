//! Compensation on the simulated stand: its own measurement of cogging and friction, and the ripple before and after.

use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{self, SessionError};
use stand_firmware::calibration::CalibrationError;

use super::{Learnt, NotCompensated, Ripple, RippleError, ripple};

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
    let calibrated = session::calibrate(stand.setup(), plant, seed, |watch| progress(watch.percent().into()))?;
    let found = calibrated.outcome?;
    let mut not_compensated = Vec::new();
    if found.compensation.harmonics.is_empty() {
        not_compensated.push(NotCompensated::NoHarmonic { threshold_N_m: found.threshold_N_m });
    }
    Ok(Learnt { compensation: found.compensation, not_compensated })
}

/// The ripple at 10, 100 and 720 °/s of the stands `before` and `after` compensation, by the harmonic orders of the latter.
///
/// # Errors
/// A stand is invalid, does not turn, or does not see its index although it has harmonics to compensate.
pub fn ripple_before_and_after(before: &Stand, after: &Stand, seed: u64) -> Result<Vec<[Ripple; 2]>, RippleError> {
    let harmonics = after.firmware.compensation.harmonics;
    let orders: Vec<u16> = harmonics.as_slice().iter().map(|h| h.order).collect();
    let at_rate = |rate_deg_s: f64| {
        let of = |stand: &Stand| ripple(stand, &stand.firmware.compensation, rate_deg_s.to_radians(), &orders, seed);
        let pair = [of(before)?, of(after)?];
        if !harmonics.is_empty() && !pair[1].compensated {
            return Err(RippleError::IndexNotSeen(pair[1].rate_rad_s));
        }
        Ok(pair)
    };
    RATES_DEG_S.into_iter().map(at_rate).collect()
}
