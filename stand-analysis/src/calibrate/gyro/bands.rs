//! Small rates: dead band about rest, and the smallest rate that is distinguishable from rest.

use super::points::{Point, points};
use super::{GyroSettings, dut_output};
use crate::calibrate::{AbsenceReason, Basis, Curve, CurveKind, Findings, Meaning, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::Extremes;
use identification::statistics::least_squares;
use identification::statistics::robust::quantile;

/// Fraction of the greatest rate below which all rates of a log count as small.
const SMALL_RATE_FRACTION: f64 = 0.05;
/// Scatter within a plateau, over that of the quietest quarter, above which the rate was not constant.
const MAX_SCATTER_RATIO: f64 = 1.5;
/// Fewest plateaus of small rates.
const MIN_PLATEAUS: usize = 8;
/// Points of the search for the dead band, and the fraction of the largest small rate that it covers.
const SEARCH_POINTS: u32 = 400;
const SEARCH_FRACTION: f64 = 0.9;

/// Standard deviation of the output within a plateau.
fn scatter(step: &Step, point: &Point, settings: &GyroSettings) -> f64 {
    let Some(output) = dut_output(&step.log, settings) else { return 0.0 };
    let rows = point.plateau.rows.clone();
    let n = rows.len() as f64;
    (output[rows].iter().map(|y| (y - point.output).powi(2)).sum::<f64>() / n).sqrt()
}

/// Adds the dead band and the smallest rate distinguishable from rest.
pub(super) fn add(steps: &[&Step], settings: &GyroSettings, findings: &mut Findings) {
    let all = points(steps, settings);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
    let is_small = |log: usize| {
        let of: Vec<f64> = all.iter().filter(|p| p.log == log).map(|p| p.plateau.rate_rad_s).collect();
        of.iter().all(|rate| rate.abs() < SMALL_RATE_FRACTION * greatest) && of.iter().any(|r| *r > 0.0) && of.iter().any(|r| *r < 0.0)
    };
    let in_small: Vec<(&Point, f64)> = all.iter().filter(|p| is_small(p.log)).map(|p| (p, scatter(steps[p.log], p, settings))).collect();
    // A platform that creeps from count to count has rates on both sides of the corner: its mean output is not the output at the mean rate.
    let steady = MAX_SCATTER_RATIO * quantile(in_small.iter().map(|(_, scatter)| *scatter), 0.25).unwrap_or(0.0);
    let small: Vec<(f64, f64)> =
        in_small.iter().filter(|(_, scatter)| *scatter <= steady).map(|(p, _)| (p.plateau.rate_rad_s, p.output)).collect();
    if small.len() < MIN_PLATEAUS || !steps.iter().any(|s| dut_output(&s.log, settings).is_some()) {
        return findings.add_absent("dead_band_rad_s", AbsenceReason::NeedsSmallRates);
    }
    let y: Vec<f64> = small.iter().map(|(_, output)| *output).collect();
    let largest = small.iter().map(|(rate, _)| rate.abs()).max_or_zero();
    let fit_at = |band: f64| {
        let rows: Vec<Vec<f64>> = small.iter().map(|(rate, _)| vec![1.0, (rate.abs() - band).max(0.0).copysign(*rate)]).collect();
        least_squares(&rows, &y)
    };
    // Search for the smallest sum of squares. Then the plateaus within the band are known and the problem is linear: level + slope·rate −
    // slope·band·sign.
    let rough = (0..SEARCH_POINTS)
        .map(|k| f64::from(k) / f64::from(SEARCH_POINTS) * SEARCH_FRACTION * largest)
        .filter_map(|band| fit_at(band).map(|f| (band, f.residuals.iter().map(|r| r * r).sum::<f64>())))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0.0, |(band, _)| band);
    let rows: Vec<Vec<f64>> =
        small.iter().map(|(rate, _)| if rate.abs() > rough { vec![1.0, *rate, -rate.signum()] } else { vec![1.0, 0.0, 0.0] }).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.add_absent("dead_band_rad_s", AbsenceReason::NeedsRatesBeyondDeadBand);
    };
    let [level, slope, offset] = [fit.coefficients[0], fit.coefficients[1], fit.coefficients[2]];
    // A negative dead band is not possible.
    let band = (offset / slope).max(0.0);
    let u = fit.sigma_of(&[0.0, -offset / slope / slope, 1.0 / slope]);
    let scatter = Contribution::type_a("noise and repeatability", u, fit.dof, Basis::Plateaus { count: small.len() });
    // Plateaus of one rate are cut at the same fraction of a count, so the scatter does not contain the quantisation.
    let quantum = steps.iter().filter_map(|s| s.log.quantization_step("theta_rad")).max_or_zero();
    let shortest_s = in_small.iter().map(|(p, _)| p.plateau.duration_s).min_or_infinity();
    let count = quantum / 6_f64.sqrt() / shortest_s;
    let encoder = Contribution::type_b("encoder", count, "rad/s", 1.0, Basis::EncoderQuantisation);
    findings
        .quantities
        .push(Quantity::new("dead_band_rad_s", "rad/s", band, vec![scatter, encoder.clone()]).meaning(Meaning::RateDeadBand));
    let two = 2.0 * fit.residual_sd / slope.abs();
    let noise_u = u.hypot(two / (2.0 * fit.dof).sqrt());
    let noise = Contribution::type_a("noise and repeatability", noise_u, fit.dof, Basis::TwoStandardDeviations);
    findings.quantities.push(Quantity::new("threshold_rad_s", "rad/s", band + two, vec![noise, encoder]).meaning(Meaning::Threshold));
    let line = (-100..=100).map(|k| f64::from(k) / 100.0 * largest).map(|r| (r, slope * (r.abs() - band).max(0.0).copysign(r)));
    let points = small.iter().map(|(rate, output)| (*rate, output - level));
    findings.curves.push(Curve::new(CurveKind::SmallRates, points.collect(), line.collect()));
}
