//! A test run of a stand before and after its compensation is changed, evaluated by its own encoder.
//!
//! Errors of the encoder that repeat over the turn are the same in both runs; the comparison is of their difference.

use std::f64::consts::TAU;
use std::io::sink;

use stand_firmware::board::ROW_HZ;
use stand_firmware::compensation::Compensation;
use stand_firmware::profile::{ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;
use stand_firmware::telemetry::{Channels, RowFrame};

use super::{OrderChange, OrderSpectrum};
use identification::log::Notes;
use stand_acquire::connection::{ConnectionError, StandConnection};
use stand_acquire::preparation::{bring_to_rest, latched_fault};
use stand_acquire::profile_recording::early_end;
use stand_acquire::record::Recorder;
use stand_acquire::recording::{RecordingEnd, RecordingError, RecordingMonitor, RecordingProgress, RecordingRequest, record};

/// Greatest rate of a test run, rad/s: 100 °/s.
const RATE_RAD_S: f64 = 100.0 * TAU / 360.0;
/// Share of the stand's overspeed limit that a test run may reach.
const OVERSPEED_SHARE: f64 = 0.5;
/// Turns of the evaluation.
const TURNS: f64 = 2.0;
/// Part of the rows of these turns that may be lost on the line.
const MAX_LOST: f64 = 0.01;
/// Settling time after the acceleration, s: loop and fade-in of the harmonics.
const SETTLE_S: f64 = 1.5;

/// Why a test run failed.
#[derive(Debug, thiserror::Error)]
pub enum TrialError {
    /// The connection fails, or the stand rejects a command.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// The run ended early.
    #[error("the test run of the compensation ended early: {0}")]
    Ended(String),
    /// The platform did not turn as far as commanded.
    #[error("the platform did not make {TURNS} turns in the test run of the compensation; check that it turns freely")]
    NotTurned,
    /// Rows were lost on the line.
    #[error(
        "the line lost {lost} of {all} rows in the test run of the compensation: the ripple is not known; repeat it on a computer that is less busy"
    )]
    RowsLost {
        /// Number of lost rows.
        lost: usize,
        /// Number of rows of the evaluated turns.
        all: usize,
    },
}

/// The ripple of the stand before and after a change of its compensation.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Rate of both runs, rad/s.
    pub rate_rad_s: f64,
    /// Orders of the old and of the new compensation.
    pub orders: Vec<u16>,
    /// Ripple before.
    pub before: OrderSpectrum,
    /// Ripple after.
    pub after: OrderSpectrum,
}

impl Trial {
    /// The orders that the new compensation has made larger, if it has made the ripple larger.
    pub fn grown(&self) -> Option<Vec<OrderChange>> {
        self.after.grown_from(&self.before, &self.orders)
    }
}

/// Orders of two compensations, each once.
pub fn orders_of(before: &Compensation, after: &Compensation) -> Vec<u16> {
    let mut orders: Vec<u16> = [before, after].iter().flat_map(|c| c.harmonics.as_slice()).map(|h| h.order).collect();
    orders.sort_unstable();
    orders.dedup();
    orders
}

/// Rate of the test runs of a stand with this overspeed limit, rad/s.
pub fn trial_rate_rad_s(overspeed_rad_s: f64) -> f64 {
    RATE_RAD_S.min(OVERSPEED_SHARE * overspeed_rad_s)
}

/// Duration of one test run with this acceleration, s.
pub fn trial_s(rate_rad_s: f64, acceleration_rad_s2: f64) -> f64 {
    settle_s(rate_rad_s, acceleration_rad_s2) + (TURNS + 0.05) * TAU / rate_rad_s
}

fn settle_s(rate_rad_s: f64, acceleration_rad_s2: f64) -> f64 {
    SETTLE_S + rate_rad_s / acceleration_rad_s2
}

/// The ripple of the stand at a constant rate, by its encoder. The platform is at rest before and coasts after. `goes_on` returns false to
/// interrupt the run.
///
/// # Errors
/// The connection fails, a fault switches the drive off, or the platform does not turn.
pub async fn measured_ripple(
    stand: &mut impl StandConnection,
    rate_rad_s: f64,
    acceleration_rad_s2: f64,
    goes_on: fn() -> bool,
) -> Result<OrderSpectrum, TrialError> {
    if let Some(fault) = latched_fault(stand).await? {
        return Err(TrialError::Ended(format!("fault {fault}")));
    }
    bring_to_rest(stand).await?;
    let profile = ProfileConfig::new(ProfileKind::Constant, rate_rad_s, 1);
    let channels = Channels::named("theta_rad").unwrap_or(Channels::DEFAULT).and(Channels::named("fault").unwrap_or(Channels::DEFAULT));
    let seconds = trial_s(rate_rad_s, acceleration_rad_s2);
    let request = RecordingRequest {
        profile: Some((Mode::Rate, &profile)),
        profile_s: seconds + 0.2,
        channels,
        decimation: 1,
        seconds,
        max_incomplete_rows: None,
    };
    let mut monitor = Angles { rows: Vec::new(), goes_on };
    let mut recorder = Recorder::new(sink(), channels, Notes::default());
    let recording = record(stand, &request, &mut recorder, &mut monitor).await.map_err(|error| match error {
        RecordingError::Connection(error) => TrialError::Connection(error),
        RecordingError::Write(error) => TrialError::Ended(error.to_string()),
    })?;
    match recording.end {
        RecordingEnd::Complete => spectrum(&monitor.rows, settle_s(rate_rad_s, acceleration_rad_s2)),
        end => Err(TrialError::Ended(early_end(&end).unwrap_or_default())),
    }
}

/// Rate ripple by angle over [`TURNS`] whole turns after `from_s`; rows are time, s, and angle, rad.
///
/// # Errors
/// The platform turned less, or rows are missing: turns of which few rows are known seem to have no ripple.
fn spectrum(rows: &[(f64, f64)], from_s: f64) -> Result<OrderSpectrum, TrialError> {
    let settled = rows.iter().position(|(t_s, _)| *t_s >= from_s).ok_or(TrialError::NotTurned)?;
    let rows = &rows[settled..];
    let (first_s, first_rad) = rows[0];
    let end = rows.iter().position(|(_, theta_rad)| (theta_rad - first_rad).abs() >= TURNS * TAU).ok_or(TrialError::NotTurned)?;
    let (end_s, end_rad) = rows[end];
    let all = ((end_s - first_s) * ROW_HZ as f64).round();
    let lost = all - end as f64;
    if lost > MAX_LOST * all {
        return Err(TrialError::RowsLost { lost: lost as usize, all: all as usize });
    }
    let mean_rad_s = (end_rad - first_rad) / (end_s - first_s);
    let deviations = rows[..end].iter().map(|(t_s, theta_rad)| (*theta_rad, theta_rad - first_rad - mean_rad_s * (t_s - first_s), 1.0));
    Ok(OrderSpectrum::of(deviations).of_angle_to_rate(mean_rad_s))
}

/// Collects the angles.
struct Angles {
    rows: Vec<(f64, f64)>,
    goes_on: fn() -> bool,
}

impl RecordingMonitor for Angles {
    fn row(&mut self, t_s: f64, row: &RowFrame) -> bool {
        self.rows.extend(row.value("theta_rad").map(|theta_rad| (t_s, theta_rad)));
        false
    }

    fn progress(&mut self, _: RecordingProgress) -> bool {
        (self.goes_on)()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a platform at 2 rad/s with a ripple of order 8, from 0 s.
    fn rows() -> Vec<(f64, f64)> {
        let row = |k: u32| {
            let t_s = f64::from(k) / ROW_HZ as f64;
            (t_s, 2.0 * t_s + 1e-3 * (16.0 * t_s).sin())
        };
        (0..9000).map(row).collect()
    }

    #[test]
    fn ripple_of_complete_rows_is_known() {
        let found = spectrum(&rows(), 1.0).unwrap().amplitude(8);
        assert!((found - 16e-3).abs() < 1e-4, "{found}");
    }

    #[test]
    fn turns_whose_rows_are_lost_have_no_ripple() {
        // All rows of the turns but the first hundred: without the check, the ripple would be that of a tenth of a turn.
        let kept: Vec<_> = rows().into_iter().filter(|(t_s, _)| *t_s < 1.1 || *t_s > 7.5).collect();
        let error = spectrum(&kept, 1.0).unwrap_err();
        assert!(matches!(error, TrialError::RowsLost { lost, .. } if lost > 6000), "{error}");
        assert!(matches!(spectrum(&rows()[..3000], 1.0), Err(TrialError::NotTurned)));
    }
}
