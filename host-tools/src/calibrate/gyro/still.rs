//! At rest: warm-up, and the temperature coefficient of the bias. Turning at plateaus while it warms: that of the scale.

use super::characteristic::points;
use super::{Given, samples};
use crate::calibrate::{Findings, Step};
use crate::statistics::Extremes;
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};

/// Less than this is no change of temperature, K.
const LEAST_K: f64 = 1.0;
/// Rows are averaged over so long before the fit: the noise is then white, s.
const BLOCK_S: f64 = 1.0;

/// Adds the temperature coefficients.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) {
    let why = "it takes a log at rest with the column sensor_C in which the part warms by 1 K or more";
    match bias(steps, given) {
        Some(q) => findings.quantities.push(q),
        None => findings.lacks("bias_per_K_rad_s", why),
    }
    match scale(steps, given) {
        Some(q) => findings.quantities.push(q),
        None => {
            findings.lacks("scale_per_K", "it takes plateaus of both signs with the column sensor_C while the part warms by 1 K or more")
        }
    }
}

fn bias(steps: &[&Step], given: &Given) -> Option<Quantity> {
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    for step in steps {
        let log = &step.log;
        let (Some(shown), Some(celsius), Some(theta)) = (samples(log, given), log.column("sensor_C"), log.column("theta_rad")) else {
            continue;
        };
        let went = theta.iter().copied().min_max();
        if went.1 - went.0 > 0.01 {
            continue;
        }
        let size = ((BLOCK_S / log.median_dt_s().max(1e-9)) as usize).max(1);
        for block in (0..log.len()).collect::<Vec<_>>().chunks_exact(size) {
            let mean = |column: &[f64]| block.iter().map(|k| column[*k]).sum::<f64>() / size as f64;
            rows.push(vec![1.0, mean(celsius)]);
            y.push(mean(shown));
        }
    }
    coefficient("bias_per_K_rad_s", "rad/s/K", &rows, &y, 1, 1.0, given).map(|q| q.saying("at rest, while the part warms"))
}

fn scale(steps: &[&Step], given: &Given) -> Option<Quantity> {
    let logs: Vec<&Step> = steps.iter().copied().filter(|s| s.log.column("sensor_C").is_some()).collect();
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    for point in points(&logs, given) {
        let celsius = point.plateau.mean(logs[point.log].log.column("sensor_C")?);
        let rate = point.plateau.rate_rad_s;
        rows.push(vec![1.0, celsius, rate, rate * celsius]);
        y.push(point.shown);
    }
    let scale = least_squares(&rows.iter().map(|r| vec![r[0], r[2]]).collect::<Vec<_>>(), &y)?.coefficients[1];
    coefficient("scale_per_K", "1/K", &rows, &y, 3, 1.0 / scale, given).map(|q| q.saying("of the scale, as a part of it"))
}

/// The coefficient of column `k`, whose column 1 is the temperature; about the mean temperature, so that the others stay apart from it.
fn coefficient(name: &str, unit: &str, rows: &[Vec<f64>], y: &[f64], k: usize, per: f64, given: &Given) -> Option<Quantity> {
    let celsius: Vec<f64> = rows.iter().map(|r| r[1]).collect();
    let (low, high) = celsius.iter().copied().min_max();
    if (high - low).is_nan() || high - low < LEAST_K {
        return None;
    }
    let mean = celsius.iter().sum::<f64>() / celsius.len() as f64;
    let about: Vec<Vec<f64>> = rows
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
    let fit = least_squares(&about, y)?;
    let value = fit.coefficients[k] * per;
    let noise = Part::measured("noise", fit.sigma(k) * per.abs(), fit.dof, format!("{} means, over {:.1} K", rows.len(), high - low));
    // A thermometer that is off by a slope: its error over the range.
    let thermometer = Part::within(
        "thermometer",
        given.known.temperature_K,
        "K",
        value / (high - low),
        format!("± {} K over the range", given.known.temperature_K),
    );
    Some(Quantity::new(name, unit, value, vec![noise, thermometer]))
}
