//! The device under test at rest: its in-run stability, and temperature coefficients where the static characteristic does not have them.

use super::points::{MAX_REST_ANGLE_RAD, points};
use super::{GyroSettings, dut_output};
use crate::allan::deviation::Series;
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::log::Log;
use identification::statistics::Extremes;
use identification::statistics::least_squares;
use identification::statistics::uncertainty::{Instability, u_of_standard_deviation};

/// Smallest temperature range, K.
const MIN_RANGE_K: f64 = 1.0;
/// Averaging time before the fit, after which the noise is white, s.
const BLOCK_S: f64 = 1.0;
/// Length of the means of which the Allan deviation is computed, s.
pub(super) const ALLAN_INTERVAL_S: f64 = 0.1;
/// Shortest log at rest, in means, and fewest averages of the longest averaging time.
const MIN_MEANS: usize = 64;
pub(super) const MIN_AVERAGES: usize = 4;

/// Part of the log at rest at each of its ends between which the output changes.
const WARM_UP_PART: usize = 10;

/// Adds in-run stability, warm-up and temperature coefficients.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) {
    match in_run_stability(steps, settings) {
        Some(stability) => {
            let averaged_s = points(steps, settings).iter().map(|p| p.plateau.duration_s).sum();
            if let Some(bias) = findings.quantities.iter_mut().find(|q| q.name == "bias_rad_s") {
                bias.conditions.instability = Some(Instability { allan_deviation: stability.value, averaged_s });
            }
            findings.quantities.push(stability);
        }
        None => findings.add_absent("in_run_stability_rad_s", AbsenceReason::NeedsRest),
    }
    match warm_up(steps, settings) {
        Some(change) => findings.quantities.push(change),
        None => findings.add_absent("warm_up_change_rad_s", AbsenceReason::NeedsRest),
    }
    for (name, of, reason) in [
        ("bias_per_K_rad_s", bias as fn(&[&Step], &GyroSettings) -> Option<Quantity>, AbsenceReason::NeedsWarmingAtRest),
        ("scale_per_K", scale, AbsenceReason::NeedsWarmingPlateaus),
    ] {
        if findings.get(name).is_none() {
            match of(steps, settings) {
                Some(q) => findings.quantities.push(q),
                None => findings.add_absent(name, reason),
            }
        }
    }
}

/// Whether the platform rests in a log.
pub(super) fn is_at_rest(step: &Step) -> bool {
    step.log.column("theta_rad").is_some_and(|theta| {
        let (low, high) = theta.iter().copied().min_max();
        high - low <= MAX_REST_ANGLE_RAD
    })
}

/// The longest log at rest, in means of [`ALLAN_INTERVAL_S`].
pub(super) struct LongestRest<'a> {
    pub(super) log: &'a Log,
    /// Rows of a mean.
    pub(super) size: usize,
    pub(super) means: Vec<f64>,
}

impl<'a> LongestRest<'a> {
    pub(super) fn of(steps: &[&'a Step], settings: &GyroSettings) -> Option<Self> {
        let step = steps
            .iter()
            .filter(|s| is_at_rest(s) && dut_output(&s.log, settings).is_some())
            .max_by(|a, b| a.log.duration_s().total_cmp(&b.log.duration_s()))?;
        let (log, output) = (&step.log, dut_output(&step.log, settings)?);
        let size = ((ALLAN_INTERVAL_S / log.median_dt_s().max(1e-9)).round() as usize).max(1);
        let longest = log.segments().into_iter().max_by_key(ExactSizeIterator::len)?;
        let means: Vec<f64> = output[longest].chunks_exact(size).map(|rows| rows.iter().sum::<f64>() / size as f64).collect();
        (means.len() >= MIN_MEANS).then_some(Self { log, size, means })
    }
}

/// Mean output of the first tenth minus that of the last tenth of the longest log at rest. The uncertainty is that of the white noise in
/// both means: what else changes between them is the change itself.
fn warm_up(steps: &[&Step], settings: &GyroSettings) -> Option<Quantity> {
    let LongestRest { log, size, means } = LongestRest::of(steps, settings)?;
    let part = means.len() / WARM_UP_PART;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let change = mean(&means[..part]) - mean(&means[means.len() - part..]);
    let differences = means.len() as f64 - 1.0;
    let variance = means.windows(2).map(|pair| 0.5 * (pair[1] - pair[0]).powi(2)).sum::<f64>() / differences;
    // The successive differences of white noise are correlated: two thirds of their number are degrees of freedom.
    let u = (2.0 * variance / part as f64).sqrt();
    let noise = Contribution::type_a("noise", u, 2.0 / 3.0 * differences, Basis::WindowScatter { window_s: ALLAN_INTERVAL_S });
    let meaning = Meaning::WarmUpChange {
        part_s: (part * size) as f64 * log.median_dt_s(),
        rest_s: log.duration_s(),
        since_power_on_s: log.notes().number("since_power_on_s"),
    };
    Some(Quantity::new("warm_up_change_rad_s", "rad/s", change, vec![noise]).meaning(meaning))
}

/// Smallest Allan deviation of the longest log at rest over averaging times up to a quarter of it (IEEE Std 952, annex C).
fn in_run_stability(steps: &[&Step], settings: &GyroSettings) -> Option<Quantity> {
    let LongestRest { log, size, means } = LongestRest::of(steps, settings)?;
    let count = means.len();
    let factors: Vec<usize> = (0..).map(|k| 1_usize << k).take_while(|m| m * MIN_AVERAGES <= count).collect();
    let whole = 0..count;
    let series = Series::of_rates(means, &[whole]);
    let least = series.overlapping(&factors).into_iter().filter(|v| v.variance > 0.0).min_by(|a, b| a.variance.total_cmp(&b.variance))?;
    let (deviation, averages) = (least.variance.sqrt(), count as f64 / least.factor as f64);
    // Degrees of freedom of the overlapping estimate for white rate noise (NIST SP 1065, table 5), m large.
    let dof = (1.5 * averages - 2.0).max(1.0);
    let contribution = Contribution::type_a("number of averages", u_of_standard_deviation(deviation, dof), dof, Basis::OfStandardDeviation);
    let meaning = Meaning::InRunStability { averaging_s: least.factor as f64 * size as f64 * log.median_dt_s(), rest_s: log.duration_s() };
    Some(Quantity::new("in_run_stability_rad_s", "rad/s", deviation, vec![contribution]).meaning(meaning))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;
    use hal_sim::peripherals::Noise;
    use identification::log::{Column, Notes};

    /// 60 s at rest with white noise and an exponential warm-up of 1e-3 rad/s with a time constant of 20 s.
    #[test]
    fn the_change_by_warm_up_is_covered() {
        let (change, time_constant_s) = (1e-3, 20.0);
        let mean =
            |from: f64, to: f64| change * time_constant_s * ((-from / time_constant_s).exp() - (-to / time_constant_s).exp()) / (to - from);
        let truth = mean(0.0, 6.0) - mean(54.0, 60.0);
        let mut covered = 0;
        for seed in 0..50 {
            let mut noise = Noise::new(seed, 0, 2e-3);
            let t_s: Vec<f64> = (0..6000).map(|k| f64::from(k) * 0.01).collect();
            let output = t_s.iter().map(|t| 0.01 + change * (-t / time_constant_s).exp() + noise.draw()).collect();
            let theta = vec![0.5; t_s.len()];
            let columns = [("t_s", t_s), ("theta_rad", theta), ("gyro_rad_s", output)];
            let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
            let log = Log::new("rest.csv", columns, Notes::default()).unwrap();
            let step = Step { name: "rest".to_owned(), log, mounting: Mounting::default(), added_inertia_kg_m2: None };
            let found = warm_up(&[&step], &GyroSettings::default()).unwrap();
            covered += u32::from(found.covers(truth));
            assert!(found.expanded_u() < 3e-4, "{found:?}");
        }
        // 95 % of 50 less three standard errors.
        assert!(covered >= 43, "{covered}");
    }
}
