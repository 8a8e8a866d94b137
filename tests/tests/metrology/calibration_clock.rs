//! The crystal's frequency error in a calibration: bounded without a clock reference, measured and corrected with one.
#![allow(clippy::unwrap_used)]

use stand_acquire::calibration_session::journal::Journal;
use stand_analysis::calibrate::{Basis, CalibrateError, Findings, Remark};
use stand_records::record::{RecordError, compute, findings};
use stand_records::stored_record::StoredRecord;
use stand_report as report;
use stand_tests::calibration::{assert_covers, calibrated, found, run};

/// Nothing but clock and noise matters for the scale.
const STAIRCASE: &str = "
[[steps]]
name = 'staircase'
mode = 'rate'
profile = 'staircase'
amplitude = 10.0
levels = 3
dwell_s = 1.5
seconds = 37.5
";

fn session(reference: &str) -> String {
    format!("what = 'gyro'\n[known]\nmisalignment_deg = 0.0\n{reference}{STAIRCASE}")
}

const REFERENCE: &str = "[clock_reference]\nname = 'GNSS receiver 4711'\nerror_ppm = 0.1\n";

fn stand(crystal_ppm: f64, more: &str) -> String {
    format!("[imu]\ngyro_scale = 1.01\n[clock]\ncrystal_ppm = {crystal_ppm:.1}\n{more}")
}

fn scale_U(findings: &Findings) -> f64 {
    found(findings, "scale").expanded_u()
}

#[test]
fn without_a_reference_the_scale_is_off_by_the_crystal_within_its_bound() {
    let findings = calibrated(&stand(40.0, ""), &session(""), 1).findings;
    assert_covers(&findings, "scale", 1.01, 7e-5);
    let error = found(&findings, "scale").value / 1.01 - 1.0;
    assert!((error - 40e-6).abs() < 8e-6, "{error}");
    assert!(findings.crystal.is_none() && scale_U(&findings) > 4e-5);
}

#[test]
fn a_reference_corrects_the_scale_and_narrows_its_uncertainty() {
    for (crystal_ppm, seed) in [(40.0, 1), (-40.0, 2), (0.0, 3)] {
        let record = calibrated(&stand(crystal_ppm, "reference = {}\n"), &session(REFERENCE), seed);
        let findings = &record.findings;
        assert_covers(findings, "scale", 1.01, 1.2e-5);
        let crystal = findings.crystal.unwrap();
        assert!((1e6 * crystal.relative_error - crystal_ppm).abs() < 0.02, "{crystal:?}");
        let clock = found(findings, "scale").contributions.iter().find(|c| c.source == "clock").unwrap();
        assert!(matches!(clock.basis, Basis::MeasuredCrystal { .. }) && (5e-8..8e-8).contains(&clock.u), "{clock:?}");
    }
}

/// The record names the reference, and the folder is enough to evaluate again.
#[test]
fn record_has_the_reference_and_the_readings() {
    let folder = run(&stand(40.0, "reference = {}\n"), &session(REFERENCE), 4);
    let record = compute(folder.path()).unwrap();
    let reading = record.journal.steps[0].clock.unwrap();
    assert!(reading.pulses >= 37.0 && reading.rejected == 0.0, "{reading:?}");
    let stored = report::calibration::stored(&record);
    let json = serde_json::to_value(&stored).unwrap();
    let again = StoredRecord::from_json(&json).unwrap();
    let crystal = again.header.crystal.as_ref().unwrap();
    assert!(crystal.reference == "GNSS receiver 4711" && (crystal.error_ppm - 40.0).abs() < 0.02, "{crystal:?}");
    assert!(again.header.remarks[0].contains("GNSS receiver 4711"), "{:?}", again.header.remarks);
    let recomputed = findings(&again.header.steps, &again.header.session, folder.path()).unwrap();
    assert_eq!(found(&recomputed, "scale").value, found(&record.findings, "scale").value);
    assert_eq!(scale_U(&recomputed), scale_U(&record.findings));
}

#[test]
fn missing_pulses_and_interference_do_not_falsify() {
    let faults = "reference = {}
[[faults]]
what = 'reference-off'
from_s = 12.0
for_s = 5.0
[[faults]]
what = 'reference-interference'
from_s = 20.345
for_s = 1e-4
[[faults]]
what = 'reference-interference'
from_s = 25.678
for_s = 1e-4
";
    let record = calibrated(&stand(40.0, faults), &session(REFERENCE), 5);
    let reading = record.journal.steps[0].clock.unwrap();
    assert!(reading.rejected == 2.0 && reading.seconds - reading.pulses >= 4.0, "{reading:?}");
    assert!((1e6 * record.findings.crystal.unwrap().relative_error - 40.0).abs() < 0.02);
    assert_covers(&record.findings, "scale", 1.01, 1.2e-5);
}

/// A reference that is named but not connected leaves everything as without one, with a remark.
#[test]
fn missing_reference_is_reported_and_the_bound_stays() {
    let none = calibrated(&stand(40.0, ""), &session(REFERENCE), 1);
    assert!(matches!(none.findings.remarks[0], Remark::ReferenceWithoutPulses { .. }), "{:?}", none.findings.remarks);
    let clock = found(&none.findings, "scale").contributions.iter().find(|c| c.source == "clock").unwrap();
    assert_eq!(clock.basis, Basis::Crystal { half_width_ppm: 50.0 });
}

/// The stand rejects the pulses of a reference by which its crystal is off by more than 200 ppm: the bound of the session does not hold.
#[test]
fn crystal_far_beyond_its_bound_gives_no_result() {
    let folder = run(&stand(300.0, "reference = {}\n"), &session(REFERENCE), 1);
    match compute(folder.path()).err().unwrap() {
        RecordError::Calibrate(CalibrateError::ReferenceRejected { rejected, pulses, .. }) => assert!(rejected > 30.0 && pulses == 1.0),
        other => panic!("{other}"),
    }
}

#[test]
fn disagreement_beyond_the_stated_bounds_is_refused() {
    let folder = run(&stand(80.0, "reference = {}\n"), &session(REFERENCE), 6);
    let error = compute(folder.path()).err().unwrap();
    assert!(matches!(error, RecordError::Calibrate(CalibrateError::ClocksDisagree { .. })), "{error}");
    let text = error.to_string();
    assert!(["GNSS receiver 4711", "+80.0 ppm", "± 50 ppm", "known.crystal_ppm"].iter().all(|part| text.contains(part)), "{text}");
}

/// The same logs with and without the correction: a time is shorter, a frequency higher by the crystal's error.
#[test]
fn time_constants_and_bandwidth_of_the_drive_are_corrected() {
    let steps = "
[[steps]]
name = 'steps'
mode = 'voltage'
profile = 'multi-step'
amplitude = 0.8
dwell_s = 0.5
seconds = 15.0
[[steps]]
name = 'sweep'
mode = 'voltage'
profile = 'chirp'
amplitude = 0.4
offset = 0.6
from_Hz = 0.05
to_Hz = 20.0
sweep_s = 40.0
seconds = 40.0
";
    let folder = run("[clock]\ncrystal_ppm = 45.0\nreference = {}\n", &format!("what = 'drive'\n{REFERENCE}{steps}"), 7);
    let (journal, mut session) = Journal::read(folder.path()).unwrap();
    let corrected = findings(&journal.steps, &session, folder.path()).unwrap();
    session.clock_reference = None;
    let plain = findings(&journal.steps, &session, folder.path()).unwrap();
    for (name, exponent) in [("mechanical_time_constant_s", -1.0), ("electrical_time_constant_s", -1.0), ("drive_bandwidth_Hz", 1.0)] {
        let [corrected, plain] = [&corrected, &plain].map(|findings| found(findings, name));
        let change = corrected.value / plain.value - 1.0;
        // The fit ends where the weakly determined inductance still changes by some ten ppm, far below its uncertainty.
        let tolerance = if name.starts_with("electrical") { 40e-6 } else { 2e-6 };
        assert!((change - exponent * 45e-6).abs() < tolerance, "{name}: {change}");
        let u = |q: &stand_analysis::calibrate::Quantity| q.contributions.iter().find(|c| c.source == "clock").unwrap().contribution();
        assert!(u(corrected) < 0.01 * u(plain), "{name}");
    }
}
