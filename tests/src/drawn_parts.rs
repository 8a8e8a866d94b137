//! Calibrations of random devices with known true values, for the benchmark and the coverage tests.

use std::path::Path;

use hal_sim::plant::Stand;
use host_tools::acquire::calibration_session::simulated::simulate;
use host_tools::acquire::calibration_session::{DutKind, PreparedSession, SessionChanges, default_session, drawn_dut};
use host_tools::calibrate::{Quantity, record};

/// The default session of a device, with the latitude given.
pub fn session(what: DutKind) -> PreparedSession {
    let text = default_session(what).replace("[known]", "[known]\nlatitude_deg = 55.75");
    PreparedSession::new(Some(&text), what, SessionChanges::default()).expect("the default session is valid")
}

/// One quantity of one device.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Name.
    pub name: &'static str,
    /// The result.
    pub found: Quantity,
    /// The true value.
    pub truth: f64,
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

/// Calibrates the random device `seed` in this folder; returns the quantities found with their true values.
///
/// # Panics
/// The session does not complete.
pub fn calibrated(what: DutKind, seed: u64, folder: &Path) -> Vec<Compared> {
    let prepared = session(what);
    let assumed = prepared.session.assumptions;
    let (stand, truth) = match what {
        DutKind::Drive => drawn_dut::drawn_drive(seed, &assumed),
        DutKind::Gyro | DutKind::Accel => {
            let (imu, truth) = drawn_dut::drawn_sensor(seed, &assumed, 10.0);
            // A different platform for each device: identical motions would give identical encoder errors.
            let mut stand = Stand { imu: Some(imu), ..Stand::default() };
            stand.drive.inertia_kg_m2 = drawn_dut::drawn_drive(seed, &assumed).0.drive.inertia_kg_m2;
            (stand, truth)
        }
    };
    simulate(&stand, seed, &prepared, folder, |_| true).unwrap_or_else(|e| panic!("part {seed}: {e}"));
    let record = record::compute(folder).unwrap_or_else(|e| panic!("part {seed}: {e}"));
    let get = |name: &str| truth.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
    let mut all = truth.clone();
    if let (Some(natural_Hz), Some(damping)) = (get("natural_Hz"), get("damping")) {
        all.push(("bandwidth_Hz", bandwidth_Hz(natural_Hz, damping, CHIP_CUTOFF_HZ)));
    }
    // With an assumed radius, the scale of the accelerometer is compared.
    if what == DutKind::Accel {
        all.retain(|(name, _)| ["angle_deg", "bias_x_m_s2"].contains(name));
        all.extend(get("accel_scale").map(|scale| ("scale", scale)));
    }
    all.into_iter().filter_map(|(name, truth)| Some(Compared { name, found: record.findings.get(name)?.clone(), truth })).collect()
}

/// First-order low-pass of the chip at the default rate of 1667 Hz, Hz (DS13012, table 18).
pub const CHIP_CUTOFF_HZ: f64 = 304.2;
