//! Findings of the recorded steps of a session.

use super::{Assumptions, CalibrateError, DutKind, Findings, accel, crystal, drive, gyro};
use identification::deadline::Deadline;
use stand_acquire::calibration_session::journal::StepRecord;
use stand_acquire::calibration_session::{Session, Step};

/// Computes the findings, with times and rates corrected by the clock reference of the session, if it has one that can be used.
///
/// # Errors
/// The logs give no calibration; the deadline has passed.
pub fn of_session(logs: &[Step], steps: &[StepRecord], session: &Session, deadline: Deadline) -> Result<Findings, CalibrateError> {
    let Some(reference) = &session.clock_reference else { return of_steps(logs, session, deadline) };
    let readings: Vec<_> = steps.iter().filter_map(|step| step.clock).collect();
    let recorded_s = logs.iter().map(|step| step.log.duration_s()).sum();
    match crystal::measured(&readings, recorded_s, reference, session.assumptions.crystal_ppm)? {
        Ok(found) => {
            let logs = logs.iter().map(|step| crystal::corrected(step, &found)).collect::<Result<Vec<_>, _>>();
            let logs = logs.map_err(|error| CalibrateError::Log(error.to_string()))?;
            let assumptions = Assumptions { measured_crystal: Some(found), ..session.assumptions };
            let mut findings = of_steps(&logs, &Session { assumptions, ..session.clone() }, deadline)?;
            findings.remarks.insert(0, crystal::remark(&found, reference));
            findings.crystal = Some(found);
            Ok(findings)
        }
        Err(unused) => {
            let mut findings = of_steps(logs, session, deadline)?;
            findings.remarks.insert(0, unused);
            Ok(findings)
        }
    }
}

/// Computes the findings as the session was recorded.
///
/// # Errors
/// The logs give no calibration; the deadline has passed.
pub fn of_steps(steps: &[Step], session: &Session, deadline: Deadline) -> Result<Findings, CalibrateError> {
    match session.dut_kind {
        DutKind::Gyro => gyro::calibrate(steps, &gyro::GyroSettings::of(session)),
        DutKind::Accel => accel::calibrate(steps, session),
        DutKind::Drive => drive::calibrate(steps, session, deadline),
    }
}
