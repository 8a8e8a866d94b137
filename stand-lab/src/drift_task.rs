//! The gyroscope of the drift work: drawn by seed, measured in the order A B B A on the simulated stand, evaluated by `drift`.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::Path;

use hal_sim::gyro::{Orientation, OwnDrift, SingleAxis, Site};

use super::LabError;
use super::course::DriftTask;
use super::draw::Draw;
use identification::log::Log;
use stand_acquire::drift_session::{CyclePlan, DriftSessionProgress, DriftSessionRequest, VisitOrder, simulate};
use stand_analysis::drift::DEG_H;
use stand_analysis::drift::compute::{DriftSettings, measurement};

/// Range of the size of the own drift, °/h; either sign.
const OWN_DRIFT_DEG_H: (f64, f64) = (0.5, 3.0);
/// Range of the azimuth, degrees. Two positions give its cosine: they do not distinguish east from west, and are insensitive near north and
/// south.
const AZIMUTH_DEG: (f64, f64) = (40.0, 140.0);
/// The measurement: that of `stand drift run` by default.
const PULSE_S: f64 = 5.0;
const PERIOD_S: f64 = 0.02;
const REST_S: f64 = 4.0;
const CYCLES: u32 = 10;
const RATES_DEG_S: [f64; 2] = [0.05, 0.02];
const ROUNDS: u32 = 2;

/// The gyroscope with this seed.
fn drawn(task: &DriftTask, seed: u64) -> SingleAxis {
    let mut draw = Draw::new(seed);
    let own_deg_h = draw.signed(OWN_DRIFT_DEG_H);
    let azimuth_rad = draw.between(AZIMUTH_DEG).to_radians();
    let mut gyroscope = SingleAxis::default();
    gyroscope.site = Site { latitude_rad: task.latitude_deg.to_radians(), azimuth_rad };
    gyroscope.own = OwnDrift { constant_rad_s: own_deg_h * DEG_H, ..OwnDrift::default() };
    gyroscope
}

/// True values by the names of the quantities.
pub(super) fn truth(task: &DriftTask, seed: u64) -> BTreeMap<String, f64> {
    let gyroscope = drawn(task, seed);
    let azimuth_rad = gyroscope.site.azimuth_rad;
    [
        ("own_drift_deg_h", gyroscope.own.constant_rad_s / DEG_H),
        // Minus the component of the Earth rate on the sensitive axis.
        ("apparent_drift_deg_h", -gyroscope.site.horizontal_rad_s() * azimuth_rad.cos() / DEG_H),
        ("azimuth_deg", azimuth_rad.to_degrees()),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .into()
}

/// The measurement.
pub(super) fn request() -> DriftSessionRequest {
    let plan = CyclePlan {
        shape: "RECTangular",
        reversed: false,
        sequence: "BOTH",
        pulse_s: PULSE_S,
        period_s: PERIOD_S,
        rest_s: REST_S,
        cycles: CYCLES,
    };
    let turned = |degrees: f64| Orientation { turned_rad: degrees.to_radians(), ..Orientation::default() };
    DriftSessionRequest {
        plan,
        rates_rad_s: RATES_DEG_S.map(f64::to_radians).to_vec(),
        positions: vec![turned(0.0), turned(180.0)],
        order: VisitOrder::Abba,
        rounds: ROUNDS,
        turn_by_drive: false,
        keep_rows: true,
    }
}

/// The log of the measurement, named `path`; `noise` is the seed of its noise.
///
/// # Errors
/// Interrupted, or the simulated stand does not run.
pub(super) fn record(
    task: &DriftTask,
    (device, noise): (u64, u64),
    path: &Path,
    on_progress: impl FnMut(f64) -> bool,
) -> Result<Log, LabError> {
    let request = request();
    let on_progress = RefCell::new(on_progress);
    let progress = |p: DriftSessionProgress| on_progress.borrow_mut()((p.visit as f64 - 1.0) / p.visits as f64);
    let recording = simulate(drawn(task, device), noise, &request, progress)?;
    Ok(recording.log(path, &request.plan, Some(task.latitude_deg))?)
}

/// Value and expanded uncertainty by the reference procedure, `stand drift compute`.
///
/// # Errors
/// The log gives no drift.
pub(super) fn reference(log: Log) -> Result<BTreeMap<String, (f64, f64)>, LabError> {
    let result = measurement(&[log], &DriftSettings::default())?.evaluate()?;
    let found = &result.corrected;
    let estimates = [
        ("own_drift_deg_h", found.own_rad_s.first(), 1.0 / DEG_H),
        ("apparent_drift_deg_h", found.apparent_rad_s.first(), 1.0 / DEG_H),
        ("azimuth_deg", found.azimuth_rad.as_ref(), 1_f64.to_degrees()),
    ];
    let known = estimates.into_iter().filter_map(|(name, estimate, unit)| {
        let estimate = estimate?;
        let expanded_u = estimate.uncertainty?.expanded();
        Some((name.to_owned(), (estimate.value * unit, expanded_u * unit)))
    });
    Ok(known.collect())
}
