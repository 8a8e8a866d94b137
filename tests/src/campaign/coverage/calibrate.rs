//! `calibrate`: complete sessions with random devices and drives over the simulated serial line. Conditions: the kinds of device.
//!
//! Every quantity of a record that has a true value is compared. The bias of a sensor with flicker noise wanders; its true value is the
//! mean over the steps in which it was measured, recomputed from the generator of the slow noise. [`DESCRIPTIVE`] quantities describe the
//! record itself and have none.

use std::path::Path;

use hal_sim::peripherals::SlowNoise;
use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use stand_acquire::calibration_session::journal::{Journal, read_logs};
use stand_acquire::calibration_session::simulated::simulate;
use stand_acquire::calibration_session::{DutKind, PreparedSession, SessionChanges, Step, default_session, drawn_dut};
use stand_analysis::calibrate::plateaus::plateaus;
use stand_analysis::calibrate::{Meaning, Quantity};
use stand_records::record::{self, CalibrationRecord};

use super::{Interval, Measured, TemporaryFolder};
use crate::campaign::inputs::InputHash;

/// Quantities that describe the record and have no true value.
pub const DESCRIPTIVE: [&str; 3] = ["threshold_rad_s", "blind_below_rad_s", "combined_rms_rad_s"];

const FIRST_SEED: u64 = 1;
const KINDS: [(DutKind, u64); 3] = [(DutKind::Gyro, 16), (DutKind::Accel, 16), (DutKind::Drive, 16)];

pub(super) fn conditions() -> Vec<(String, u64, u64)> {
    KINDS.map(|(kind, cases)| (kind.name().to_owned(), FIRST_SEED, cases)).to_vec()
}

pub(super) fn measured(condition: &str, seed: u64) -> Result<Measured, String> {
    let (kind, _) = KINDS.into_iter().find(|(kind, _)| kind.name() == condition).ok_or("no such condition")?;
    let folder = TemporaryFolder::new(&format!("{condition}-{seed}"));
    let (steps, found) = calibrated(kind, seed, &folder.0)?;
    let inputs = steps.iter().fold(InputHash::default(), |hash, step| hash.text(&step.name).log(&step.log)).short();
    let interval = |c: &Compared| Interval { quantity: c.name.clone(), error_sigma: Some(c.error_u()), covers: c.found.covers(c.truth) };
    Ok(Measured { inputs, intervals: found.map(|found| found.iter().map(interval).collect()) })
}

/// The default session of a device, with the latitude given.
pub fn session(what: DutKind) -> PreparedSession {
    let text = default_session(what).replace("[known]", "[known]\nlatitude_deg = 55.75");
    PreparedSession::new(Some(&text), what, SessionChanges::default()).expect("the default session is valid")
}

/// One quantity of one device.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Name.
    pub name: String,
    /// The result.
    pub found: Quantity,
    /// The true value.
    pub truth: f64,
}

impl Compared {
    /// Error in standard uncertainties.
    pub fn error_u(&self) -> f64 {
        (self.found.value - self.truth) / self.found.combined_u()
    }
}

/// The −3 dB frequency of a second-order element with a first-order low-pass in series, Hz.
pub fn bandwidth_Hz(natural_Hz: f64, damping: f64, cutoff_Hz: f64) -> f64 {
    let gain_2 = |f: f64| {
        let (x, y) = (f / natural_Hz, f / cutoff_Hz);
        1.0 / (((1.0 - x * x).powi(2) + (2.0 * damping * x).powi(2)) * (1.0 + y * y))
    };
    let (mut low, mut high) = (1.0, 10.0 * natural_Hz);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if gain_2(middle) > 0.5 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// First-order low-pass of the chip at the default rate of 1667 Hz, Hz (DS13012, table 18).
pub const CHIP_CUTOFF_HZ: f64 = 304.2;

/// Stream of the slow noise of the gyro's z axis, and of the accelerometer's x and y axes.
const SLOW_STREAMS: [u32; 3] = [16, 17, 18];

/// Mean of the slow noise over these steps.
fn slow_mean(seed: u64, stream: u32, [instability, walk]: [f64; 2], steps: &[&Step]) -> f64 {
    let mut noise = SlowNoise::new(seed, stream, instability, walk);
    let (mut sum, mut count) = (0.0, 0_u32);
    for step in steps {
        let begin_s = step.log.notes().number("since_power_on_s").unwrap_or(0.0);
        for k in 0..(step.log.duration_s() * 20.0) as u32 {
            sum += noise.at(begin_s + f64::from(k) / 20.0);
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// Mean of the slow noise over a part of a step; times since power-on, s.
fn slow_between(seed: u64, stream: u32, [instability, walk]: [f64; 2], from_s: f64, duration_s: f64) -> f64 {
    let mut noise = SlowNoise::new(seed, stream, instability, walk);
    let count = (duration_s * 100.0) as u32;
    (0..count).map(|k| noise.at(from_s + f64::from(k) / 100.0)).sum::<f64>() / f64::from(count.max(1))
}

type Named = Vec<(String, f64)>;

fn gyro_truth(seed: u64, imu: &ImuSetup, drawn: &[(&'static str, f64)], record: &CalibrationRecord, steps: &[Step]) -> Named {
    let get = |name: &str| drawn.iter().find(|(n, _)| *n == name).map_or(f64::NAN, |(_, value)| *value);
    let named = |name: &str| steps.iter().find(|s| s.name == name).expect("the default session has this step");
    let (e, findings) = (&imu.gyro, &record.findings);
    let fs = findings.response_function.as_ref().map_or(10.0, |f| f.full_scale);
    let (c2, c3) = (e.quadratic_s, e.cubic_s2);
    let slope = 1.0 + 0.6 * c3 * fs * fs;
    let at_rest = get("scale") / (1.0 + 0.6 * c3 * 100.0);
    let (n_rad_s_rts, b, k) = (imu.gyro_noise_rad_s_rtHz / 2_f64.sqrt(), imu.gyro_bias_instability_rad_s, imu.gyro_random_walk_rad_s_rts);
    let floor_2 = (0.664 * b).powi(2);
    let staircase = named("staircase");
    // Plateaus of the staircase are repeated after some 20 plateaus: Barnes' B₂(20) is 3.2.
    let repeated: Vec<f64> =
        plateaus(&staircase.log, "rate_cmd_rad_s", 0.5).iter().map(|p| n_rad_s_rts.powi(2) / p.duration_s + 3.2 * floor_2).collect();
    let repeatability = (repeated.iter().sum::<f64>() / repeated.len() as f64).sqrt();
    let mut truth = vec![
        ("scale", at_rest * slope),
        ("bias_rad_s", get("bias_rad_s") + slow_mean(seed, SLOW_STREAMS[0], [b, k], &[staircase])),
        ("nonlinearity_percent_fs", 100.0 * (2.0 / 3.0 * (c2 * fs).abs() + 0.4 * (c3 * fs * fs).abs())),
        ("quadratic_s", get("quadratic_s")),
        ("asymmetry_percent", 200.0 * c2 * fs / slope),
        ("hysteresis_percent_fs", 0.0),
        ("repeatability_percent_fs", 100.0 * repeatability / (fs * imu.gyro_scale)),
        ("dead_band_rad_s", e.dead_band_rad_s),
        ("damping", e.damping),
        ("delay_s", e.delay_s),
        ("bandwidth_Hz", bandwidth_Hz(e.natural_Hz, e.damping, CHIP_CUTOFF_HZ)),
    ];
    let (mut cubes, mut rates) = (0.0, 0.0);
    for step in steps.iter().filter(|s| s.log.note("profile") == Some("turns")) {
        for rate in step.log.column("rate_cmd_rad_s").unwrap_or_default() {
            (cubes, rates) = (cubes + rate.abs().powi(3), rates + rate.abs());
        }
    }
    // The encoder of the drawn stands has no error within a turn beside its resolution.
    truth.extend([("encoder_cosine_rad", 0.0), ("encoder_sine_rad", 0.0)]);
    // A higher order is reported where noise shows it, in 1 % of the parts.
    truth.extend(findings.quantities.iter().map(|q| q.name.as_str()).filter(|name| name.starts_with("encoder_")).map(|name| (name, 0.0)));
    truth.push(("scale_whole_turns", at_rest * (1.0 + c3 * cubes / rates)));
    for q in &findings.quantities {
        match q.meaning {
            Some(Meaning::DynamicScale { mean_rad_s: m, amplitude_rad_s: a }) => {
                truth.push(("scale_dynamic", at_rest * (1.0 + 2.0 * get("quadratic_s") * m + 3.0 * c3 * (m * m + 0.25 * a * a))));
            }
            Some(Meaning::InRunStability { averaging_s, .. }) => {
                let variance = n_rad_s_rts.powi(2) / averaging_s + floor_2 + k * k * averaging_s / 3.0;
                truth.push(("in_run_stability_rad_s", variance.sqrt()));
            }
            Some(Meaning::WarmUpChange { part_s, rest_s, .. }) => {
                let begin_s = named("rest").log.notes().number("since_power_on_s").unwrap_or(0.0);
                let mean = |from_s: f64| slow_between(seed, SLOW_STREAMS[0], [b, k], begin_s + from_s, part_s);
                truth.push(("warm_up_change_rad_s", mean(0.0) - mean(rest_s - part_s)));
            }
            _ => {}
        }
    }
    truth.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

fn accel_truth(seed: u64, imu: &ImuSetup, drawn: &[(&'static str, f64)], steps: &[Step]) -> Named {
    let get = |name: &str| drawn.iter().find(|(n, _)| *n == name).map_or(f64::NAN, |(_, value)| *value);
    // 40 µg, and its ratio to the random walk (hal-sim, mounting.rs).
    let b = imu.accel_bias_instability_m_s2.unwrap_or(40e-6 * 9.806_65);
    let quiet: Vec<&Step> = steps.iter().filter(|s| s.log.note("profile") != Some("sine")).collect();
    let slow = |stream: u32| slow_mean(seed, stream, [b, 0.0364 * b], &quiet);
    [
        ("scale", get("accel_scale")),
        ("radius_m", get("radius_m")),
        ("angle_deg", get("angle_deg")),
        ("bias_x_m_s2", get("bias_x_m_s2") + slow(SLOW_STREAMS[1])),
        ("bias_y_m_s2", get("bias_y_m_s2") + slow(SLOW_STREAMS[2])),
        // The encoder of the drawn stands has no error within a turn beside its resolution.
        ("encoder_cosine_rad", 0.0),
        ("encoder_sine_rad", 0.0),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

fn drive_truth(drawn: &[(&'static str, f64)]) -> Named {
    let get = |name: &str| drawn.iter().find(|(n, _)| *n == name).map_or(f64::NAN, |(_, value)| *value);
    let [j, k, r, l, b, c] =
        ["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "inductance_H", "viscous_N_m_s", "coulomb_N_m"].map(get);
    let mut truth: Named = drawn.iter().filter(|(name, _)| *name != "voltage_reading").map(|(n, v)| ((*n).to_owned(), *v)).collect();
    let derived = [
        ("mechanical_time_constant_s", j * r / (k * k + r * b)),
        ("electrical_time_constant_s", l / r),
        ("no_load_current_A", c / k),
        ("current_per_rate_A_s", b / k),
        ("current_asymmetry_A", 0.0),
        ("current_hysteresis_A", 0.0),
        ("dead_band_V", r * c / k),
        ("rate_per_voltage_rad_s_V", k / (k * k + r * b)),
        ("coast_decay_1_s", (b + k * k / r) / j),
        ("coast_dry_rad_s2", c / j),
        ("inertia_by_coasting_kg_m2", j),
        ("drive_bandwidth_Hz", (k * k / r + b) / (std::f64::consts::TAU * j)),
    ];
    truth.extend(derived.map(|(name, value)| (name.to_owned(), value)));
    truth
}

/// Compared quantities, or why the calibration was refused.
pub type Calibrated = Result<Vec<Compared>, String>;

/// Calibrates the random device `seed` in this folder; returns the steps of the session, and the quantities that have true values, or why
/// there is no record.
///
/// # Errors
/// The session does not complete, or its logs cannot be read.
///
/// # Panics
/// A quantity has no known true value.
pub fn calibrated(what: DutKind, seed: u64, folder: &Path) -> Result<(Vec<Step>, Calibrated), String> {
    let prepared = session(what);
    let assumed = prepared.session.assumptions;
    let (stand, drawn) = match what {
        DutKind::Drive => drawn_dut::drawn_drive(seed, &assumed),
        DutKind::Gyro | DutKind::Accel => {
            let (imu, truth) = drawn_dut::drawn_sensor(seed, &assumed, 10.0);
            // A different platform and motor for each device: identical motions past the index have identical counting errors, and these
            // would be a mean error of the campaign. The constant changes the rate at a voltage by up to 0.5 %, 0.08 counts per row.
            let mut stand = Stand { imu: Some(imu), ..Stand::default() };
            stand.drive.inertia_kg_m2 = drawn_dut::drawn_drive(seed, &assumed).0.drive.inertia_kg_m2;
            stand.drive.motor_constant_N_m_A *= 1.0 + 0.01 * ((seed as f64 * std::f64::consts::SQRT_2).fract() - 0.5);
            (stand, truth)
        }
    };
    simulate(&stand, seed, &prepared, folder, Deadline::NEVER, |_| true).map_err(|e| e.to_string())?;
    let (journal, _) = Journal::read(folder).map_err(|e| e.to_string())?;
    let steps = read_logs(&journal.steps, folder).map_err(|e| e.to_string())?;
    let record = match record::compute(folder) {
        Ok(record) => record,
        Err(e) => return Ok((steps, Err(e.to_string()))),
    };
    let truth = match (what, &stand.imu) {
        (DutKind::Gyro, Some(imu)) => gyro_truth(seed, imu, &drawn, &record, &steps),
        (DutKind::Accel, Some(imu)) => accel_truth(seed, imu, &drawn, &steps),
        _ => drive_truth(&drawn),
    };
    let of = |q: &Quantity| {
        let (_, truth) = truth.iter().find(|(name, _)| *name == q.name)?;
        Some(Compared { name: q.name.clone(), found: q.clone(), truth: *truth })
    };
    let without: Vec<&str> = record.findings.quantities.iter().map(|q| q.name.as_str()).filter(|name| !is_known(name, &truth)).collect();
    assert!(without.is_empty(), "part {seed}: no true value of {without:?}");
    let compared = record.findings.quantities.iter().filter_map(of).collect();
    Ok((steps, Ok(compared)))
}

/// The quantity has a true value, or describes the record.
fn is_known(name: &str, truth: &Named) -> bool {
    DESCRIPTIVE.contains(&name) || name.starts_with("order_") || truth.iter().any(|(n, _)| n == name)
}
