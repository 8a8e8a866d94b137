//! Frequency of the stand's crystal, by a clock reference with one pulse per second.
//!
//! Input: the readings of the stand in the steps of a session ([`ClockReading`]). Output: the mean relative frequency error with its
//! standard uncertainty ([`MeasuredCrystal`]), logs whose times and commanded rates are those of the reference ([`corrected`]), and the
//! contribution of the clock to a budget ([`clock`]): the half-width of the crystal, or the measured frequency.
//!
//! The budget of the frequency has four parts: jitter of the pulses at the ends of each step, resolution of the timer there, change of the
//! frequency from step to step (half-width: the greatest deviation of a step from the mean), and the half-width that the session states for
//! the reference.

use super::{Assumptions, Basis, CalibrateError, Contribution, Remark, Step};
use identification::log::{Column, Log, LogError, known};
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, coverage_factor, rectangular_u};
use stand_acquire::calibration_session::{ClockReading, ClockReference, MeasuredCrystal};
use stand_firmware::telemetry::channel::{Channel, Source};

/// Shortest time with pulses in all steps together, s.
const MIN_SECONDS: f64 = 10.0;
/// Smallest fraction of the recorded time with pulses.
const MIN_COVERED_FRACTION: f64 = 0.5;
/// Greatest number of rejected edges over that of pulses: with more, an edge may have been taken for a pulse by chance.
const MAX_REJECTED_FRACTION: f64 = 0.1;

/// Notes of a log that are frequencies of the crystal, and those that are times.
const FREQUENCY_NOTES: [&str; 3] = ["profile_frequency_Hz", "profile_from_Hz", "profile_to_Hz"];
const TIME_NOTES: [&str; 4] = ["profile_sweep_s", "profile_dwell_s", "drive_s", "since_power_on_s"];

/// The frequency of the crystal by the readings of all steps, `recorded_s` of rows together; or the remark why the reference is not used.
///
/// # Errors
/// Crystal and reference differ by more than their stated bounds; more than 10 % of the edges are not pulses of one sequence.
pub(super) fn measured(
    readings: &[ClockReading],
    recorded_s: f64,
    reference: &ClockReference,
    crystal_ppm: f64,
) -> Result<Result<MeasuredCrystal, Remark>, CalibrateError> {
    let sum = |of: fn(&ClockReading) -> f64| readings.iter().map(of).sum::<f64>();
    let (pulses, rejected) = (sum(|r| r.pulses), sum(|r| r.rejected));
    if pulses + rejected == 0.0 {
        return Ok(Err(Remark::ReferenceWithoutPulses { reference: reference.name.clone() }));
    }
    if rejected > MAX_REJECTED_FRACTION * pulses {
        return Err(CalibrateError::ReferenceRejected { reference: reference.name.clone(), rejected, pulses, crystal_ppm });
    }
    let used: Vec<(&ClockReading, f64)> = readings.iter().filter_map(|r| Some((r, r.deviation_Hz?))).collect();
    let seconds: f64 = used.iter().map(|(r, _)| r.seconds).sum();
    if seconds < MIN_SECONDS || seconds < MIN_COVERED_FRACTION * recorded_s {
        return Ok(Err(Remark::ReferenceTooShort { reference: reference.name.clone(), seconds, recorded_s }));
    }
    let error_of = |r: &ClockReading| r.steps / (r.seconds * r.timer_Hz) - 1.0;
    let relative_error = used.iter().map(|(r, _)| r.seconds * error_of(r)).sum::<f64>() / seconds;
    // The deviation of an interval is √2 times the jitter, and so is that of the time between two pulses.
    let jitter = used.iter().map(|(r, deviation_Hz)| (deviation_Hz / r.timer_Hz).powi(2)).sum::<f64>().sqrt() / seconds;
    let dof: f64 = used.iter().map(|(r, _)| r.pulses - 2.0).sum();
    let resolution = used.iter().map(|(r, _)| 2.0 * rectangular_u(0.5 / r.timer_Hz).powi(2)).sum::<f64>().sqrt() / seconds;
    let change = rectangular_u(used.iter().map(|(r, _)| error_of(r) - relative_error).max_abs());
    let of_reference = rectangular_u(reference.error_ppm * 1e-6);
    let u = [jitter, resolution, change, of_reference].iter().map(|u| u * u).sum::<f64>().sqrt();
    let dof = if jitter > 0.0 { dof * (u / jitter).powi(4) } else { f64::INFINITY };
    let measured = MeasuredCrystal { relative_error, u, dof, seconds, reference_ppm: reference.error_ppm };
    let bound = (crystal_ppm + reference.error_ppm) * 1e-6 + expanded_u(&measured);
    if relative_error.abs() > bound {
        return Err(CalibrateError::ClocksDisagree {
            reference: reference.name.clone(),
            error_ppm: 1e6 * relative_error,
            crystal_ppm,
            reference_ppm: reference.error_ppm,
        });
    }
    Ok(Ok(measured))
}

/// Expanded uncertainty of the relative frequency error.
pub fn expanded_u(measured: &MeasuredCrystal) -> f64 {
    coverage_factor(measured.dof, COVERAGE_PROBABILITY) * measured.u
}

/// Remark on a measured crystal.
pub(super) fn remark(measured: &MeasuredCrystal, reference: &ClockReference) -> Remark {
    Remark::CrystalMeasured {
        reference: reference.name.clone(),
        error_ppm: 1e6 * measured.relative_error,
        U_ppm: 1e6 * expanded_u(measured),
        seconds: measured.seconds,
    }
}

/// Clock of the stand: its relative frequency error is that of all rates and frequencies. `sensitivity`: change of the result per relative
/// error.
pub(super) fn clock(assumed: &Assumptions, sensitivity: f64) -> Contribution {
    match assumed.measured_crystal {
        Some(MeasuredCrystal { u, dof, seconds, reference_ppm, .. }) => {
            let basis = Basis::MeasuredCrystal { seconds, reference_ppm };
            Contribution { dof, ..Contribution::type_b("clock", u, "1", sensitivity, basis) }
        }
        None => {
            let half_width_ppm = assumed.crystal_ppm;
            Contribution::rectangular("clock", half_width_ppm * 1e-6, "1", sensitivity, Basis::Crystal { half_width_ppm })
        }
    }
}

/// The step with the times of the reference: those of its rows and notes, and with them the rates that the stand has set. Rates of a device
/// under test have its own clock, or none.
///
/// # Errors
/// The corrected columns make no log.
pub(super) fn corrected(step: &Step, measured: &MeasuredCrystal) -> Result<Step, LogError> {
    let frequency = 1.0 + measured.relative_error;
    let factor = |name: &str| {
        let is_set_rate = Channel::named(name).is_some_and(|channel| channel.source == Source::Command && channel.unit == "rad/s");
        match known(name) {
            Some(column) if column.unit == "s" => 1.0 / frequency,
            _ if is_set_rate => frequency,
            _ => 1.0,
        }
    };
    let columns = step.log.columns().iter().map(|column| {
        let factor = factor(&column.name);
        Column { name: column.name.clone(), values: column.values.iter().map(|value| value * factor).collect() }
    });
    let note = |(key, value): &(String, String)| {
        let factor = match key.as_str() {
            key if FREQUENCY_NOTES.contains(&key) => frequency,
            key if TIME_NOTES.contains(&key) => 1.0 / frequency,
            _ => return (key.clone(), value.clone()),
        };
        (key.clone(), step.log.notes().number(key).map_or(value.clone(), |number| (number * factor).to_string()))
    };
    let log = Log::new(step.log.path(), columns.collect(), step.log.notes().iter().map(note).collect::<Vec<_>>())?;
    Ok(Step { log, ..step.clone() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;

    fn reference() -> ClockReference {
        ClockReference { name: "GNSS receiver 7".into(), error_ppm: 0.1 }
    }

    /// A step of `seconds` by a crystal with this relative frequency error.
    fn reading(error: f64, seconds: f64) -> ClockReading {
        let timer_Hz = 90e6;
        ClockReading {
            pulses: seconds + 1.0,
            rejected: 0.0,
            seconds,
            steps: (seconds * timer_Hz * (1.0 + error)).round(),
            deviation_Hz: Some(2.5),
            timer_Hz,
        }
    }

    #[test]
    fn frequency_is_the_mean_by_time_and_its_change_is_in_the_budget() {
        let steady = measured(&[reading(40e-6, 30.0), reading(40e-6, 90.0)], 120.0, &reference(), 50.0).unwrap().unwrap();
        assert!((steady.relative_error - 40e-6).abs() < 1e-9 && steady.seconds == 120.0);
        // 0.1 ppm of the reference dominates.
        assert!((steady.u / rectangular_u(1e-7) - 1.0).abs() < 1e-3, "{}", steady.u);
        let warming = measured(&[reading(38e-6, 60.0), reading(42e-6, 60.0)], 120.0, &reference(), 50.0).unwrap().unwrap();
        assert!((warming.relative_error - 40e-6).abs() < 1e-9 && (warming.u / rectangular_u(2e-6) - 1.0).abs() < 0.01, "{}", warming.u);
        let exact = ClockReference { error_ppm: 0.0, ..reference() };
        let short = measured(&[reading(1e-6, 10.0)], 10.0, &exact, 50.0).unwrap().unwrap();
        let jitter = 2.5 / 90e6 / 10.0;
        assert!((short.u / jitter - 1.0).abs() < 0.1 && short.dof < 12.0, "{} {}", short.u, short.dof);
    }

    #[test]
    fn reference_is_refused_or_left_out_with_the_reason() {
        let error = measured(&[reading(80e-6, 60.0)], 60.0, &reference(), 50.0).unwrap_err().to_string();
        assert!(error.contains("GNSS receiver 7") && error.contains("80.0") && error.contains("± 50"), "{error}");
        assert!(measured(&[reading(80e-6, 60.0)], 60.0, &reference(), 100.0).unwrap().is_ok());
        let unused = |readings: &[ClockReading], recorded_s| measured(readings, recorded_s, &reference(), 50.0).unwrap().unwrap_err();
        let none = ClockReading { pulses: 0.0, seconds: 0.0, steps: 0.0, deviation_Hz: None, ..reading(0.0, 0.0) };
        let name = || reference().name;
        assert_eq!(unused(&[none], 60.0), Remark::ReferenceWithoutPulses { reference: name() });
        let noisy = ClockReading { rejected: 7.0, ..reading(0.0, 60.0) };
        // A pulse and edges that are none: a crystal beyond what the stand accepts.
        let far = ClockReading { pulses: 1.0, rejected: 59.0, seconds: 0.0, steps: 0.0, deviation_Hz: None, ..noisy };
        for (reading, text) in [(noisy, "7 edges"), (far, "59 edges")] {
            let error = measured(&[reading], 60.0, &reference(), 50.0).unwrap_err().to_string();
            assert!(error.contains(text) && error.contains("more than 200 ppm"), "{error}");
        }
        assert_eq!(unused(&[reading(0.0, 9.0)], 9.5), Remark::ReferenceTooShort { reference: name(), seconds: 9.0, recorded_s: 9.5 });
        assert_eq!(
            unused(&[reading(0.0, 20.0), none], 60.0),
            Remark::ReferenceTooShort { reference: name(), seconds: 20.0, recorded_s: 60.0 }
        );
    }

    #[test]
    fn times_and_set_rates_are_corrected_and_readings_of_the_device_are_not() {
        let column = |name: &str, values: [f64; 2]| Column { name: name.into(), values: values.to_vec() };
        let columns = vec![
            column("t_s", [0.0, 10.0]),
            column("theta_rad", [0.0, 5.0]),
            column("gyro_rad_s", [1.0, 2.0]),
            column("rate_cmd_rad_s", [3.0, 4.0]),
            column("sensor_age_s", [1e-3, 2e-3]),
        ];
        let notes = [("profile_frequency_Hz", "5"), ("drive_s", "3"), ("sensor_filter_Hz", "300"), ("radius_m", "0.05"), ("serial", "G-1")];
        let notes: Vec<(String, String)> = notes.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
        let log = Log::new("a.csv", columns, notes).unwrap();
        let step = Step { name: "a".into(), log, mounting: Mounting::default(), added_inertia_kg_m2: None };
        let crystal = MeasuredCrystal { relative_error: 1e-3, u: 1e-7, dof: f64::INFINITY, seconds: 60.0, reference_ppm: 0.1 };
        let log = corrected(&step, &crystal).unwrap().log;
        let last = |name: &str| log.column(name).unwrap()[1];
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
        assert!(
            close(last("t_s"), 10.0 / 1.001) && close(last("sensor_age_s"), 2e-3 / 1.001) && close(last("rate_cmd_rad_s"), 4.0 * 1.001)
        );
        assert_eq!((last("theta_rad"), last("gyro_rad_s")), (5.0, 2.0));
        let note = |key: &str| log.notes().number(key).unwrap();
        assert!(close(note("profile_frequency_Hz"), 5.005) && close(note("drive_s"), 3.0 / 1.001));
        assert_eq!((note("sensor_filter_Hz"), note("radius_m"), log.note("serial")), (300.0, 0.05, Some("G-1")));
    }
}
