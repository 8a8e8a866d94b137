//! Calibrations of parts drawn by number, beside what is true of them: what benchmark and tests count.

use std::path::Path;

use hal_sim::plant::Stand;
use host_tools::calibrate::session::simulated::simulate;
use host_tools::calibrate::session::{Session, What};
use host_tools::calibrate::{Known, part, record};
use host_tools::statistics::uncertainty::Quantity;

/// The gyro's session, its latitude known; the sines go up to what the drawn parts need.
pub fn session(what: What) -> (Session, String) {
    let text = what.usual().replace("[known]", "[known]\nlatitude_deg = 55.75");
    let session = Session::parse(&text).expect("the usual session is good");
    (session, text)
}

/// One quantity of one part.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Name.
    pub name: &'static str,
    /// As it was found.
    pub found: Quantity,
    /// As it is.
    pub truth: f64,
}

/// The −3 dB frequency of the element (second order) with a first-order low-pass behind it, Hz.
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

/// Calibrates the part of this number in this folder: what was found beside what is true; what was not found is not there.
///
/// # Panics
/// Where the session does not run to its end.
pub fn calibrated(what: What, seed: u64, folder: &Path) -> Vec<Compared> {
    let (session, text) = session(what);
    let known: Known = session.known;
    let (stand, truth) = match what {
        What::Drive => part::drive(seed, &known),
        What::Gyro | What::Accel => {
            let (imu, truth) = part::sensor(seed, &known, 10.0);
            // Each on a platform of its own: the same motion in all would have the same errors of the encoder in all.
            let mut stand = Stand { imu: Some(imu), ..Stand::default() };
            stand.drive.inertia_kg_m2 = part::drive(seed, &known).0.drive.inertia_kg_m2;
            (stand, truth)
        }
    };
    simulate(&stand, seed, &session, &text, None, folder, |_| true).unwrap_or_else(|e| panic!("part {seed}: {e}"));
    let record = record::compute(folder).unwrap_or_else(|e| panic!("part {seed}: {e}"));
    let get = |name: &str| truth.iter().find(|(n, _)| *n == name).map(|(_, value)| *value);
    let mut all = truth.clone();
    if let (Some(natural_Hz), Some(damping)) = (get("natural_Hz"), get("damping")) {
        all.push(("bandwidth_Hz", bandwidth_Hz(natural_Hz, damping, CHIP_CUTOFF_HZ)));
    }
    // Of an accelerometer with its radius believed: the scale is the part's.
    if what == What::Accel {
        all.retain(|(name, _)| ["angle_deg", "bias_x_m_s2"].contains(name));
        all.extend(get("accel_scale").map(|scale| ("scale", scale)));
    }
    all.into_iter().filter_map(|(name, truth)| Some(Compared { name, found: record.findings.get(name)?.clone(), truth })).collect()
}

/// The chip's own first-order low-pass at the usual rate of 1667 Hz, Hz (DS13012, table 18).
pub const CHIP_CUTOFF_HZ: f64 = 304.2;
