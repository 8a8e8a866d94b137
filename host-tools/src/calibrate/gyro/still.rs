//! Temperature coefficients while the device under test warms: of the bias at rest, of the scale at plateaus.

use super::characteristic::points;
use super::{GyroSettings, dut_output};
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Step};
use crate::calibrate::{Contribution, Quantity};
use crate::statistics::Extremes;
use crate::statistics::least_squares;

/// Smallest temperature range, K.
const MIN_RANGE_K: f64 = 1.0;
/// Averaging time before the fit, after which the noise is white, s.
const BLOCK_S: f64 = 1.0;
/// Greatest change of the angle of a platform at rest, rad.
const MAX_REST_ANGLE_RAD: f64 = 0.01;

/// Adds the temperature coefficients.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) {
    match bias(steps, settings) {
        Some(q) => findings.quantities.push(q),
        None => findings.add_absent("bias_per_K_rad_s", AbsenceReason::NeedsWarmingAtRest),
    }
    match scale(steps, settings) {
        Some(q) => findings.quantities.push(q),
        None => findings.add_absent("scale_per_K", AbsenceReason::NeedsWarmingPlateaus),
    }
}

fn bias(steps: &[&Step], settings: &GyroSettings) -> Option<Quantity> {
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    for step in steps {
        let log = &step.log;
        let (Some(output), Some(celsius), Some(theta)) = (dut_output(log, settings), log.column("sensor_C"), log.column("theta_rad"))
        else {
            continue;
        };
        let (low, high) = theta.iter().copied().min_max();
        if high - low > MAX_REST_ANGLE_RAD {
            continue;
        }
        let size = ((BLOCK_S / log.median_dt_s().max(1e-9)) as usize).max(1);
        for block in (0..log.len()).collect::<Vec<_>>().chunks_exact(size) {
            let mean = |column: &[f64]| block.iter().map(|k| column[*k]).sum::<f64>() / size as f64;
            rows.push(vec![1.0, mean(celsius)]);
            y.push(mean(output));
        }
    }
    coefficient("bias_per_K_rad_s", "rad/s/K", &rows, &y, 1, 1.0, settings).map(|q| q.meaning(Meaning::BiasTemperature))
}

fn scale(steps: &[&Step], settings: &GyroSettings) -> Option<Quantity> {
    let logs: Vec<&Step> = steps.iter().copied().filter(|s| s.log.column("sensor_C").is_some()).collect();
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    for point in points(&logs, settings) {
        let celsius = point.plateau.mean(logs[point.log].log.column("sensor_C")?);
        let rate = point.plateau.rate_rad_s;
        rows.push(vec![1.0, celsius, rate, rate * celsius]);
        y.push(point.output);
    }
    let scale = least_squares(&rows.iter().map(|r| vec![r[0], r[2]]).collect::<Vec<_>>(), &y)?.coefficients[1];
    coefficient("scale_per_K", "1/K", &rows, &y, 3, 1.0 / scale, settings).map(|q| q.meaning(Meaning::ScaleTemperature))
}

/// Coefficient of column `k` of `rows`, whose column 1 is the temperature. The temperature is centred, which decorrelates the coefficients.
fn coefficient(name: &str, unit: &str, rows: &[Vec<f64>], y: &[f64], k: usize, per: f64, settings: &GyroSettings) -> Option<Quantity> {
    let celsius: Vec<f64> = rows.iter().map(|r| r[1]).collect();
    let (low, high) = celsius.iter().copied().min_max();
    if (high - low).is_nan() || high - low < MIN_RANGE_K {
        return None;
    }
    let mean = celsius.iter().sum::<f64>() / celsius.len() as f64;
    let centred: Vec<Vec<f64>> = rows
        .iter()
        .map(|r| {
            let mut r = r.clone();
            r[1] -= mean;
            if r.len() > 3 {
                r[3] = r[2] * r[1];
            }
            r
        })
        .collect();
    let fit = least_squares(&centred, y)?;
    let value = fit.coefficients[k] * per;
    let noise = Contribution::type_a(
        "noise",
        fit.sigma(k) * per.abs(),
        fit.dof,
        Basis::MeansOverTemperature { count: rows.len(), range_K: high - low },
    );
    // A slope error of the thermometer is its error divided by the range.
    let thermometer = Contribution::rectangular(
        "thermometer",
        settings.assumptions.temperature_K,
        "K",
        value / (high - low),
        Basis::ThermometerHalfWidth { half_width_K: settings.assumptions.temperature_K },
    );
    Some(Quantity::new(name, unit, value, vec![noise, thermometer]))
}
