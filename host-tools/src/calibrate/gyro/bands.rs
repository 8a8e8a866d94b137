//! Small rates: what is shown of them, and the dead band about rest.

use super::characteristic::points;
use super::{Given, samples};
use crate::calibrate::{Curve, Findings, Step};
use crate::uncertainty::{Part, Quantity, least_squares};

/// Most of a log's rate that is small, as a part of the greatest of all.
const SMALL: f64 = 0.05;

/// Adds the dead band, and the smallest rate that is told from rest.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) {
    let all = points(steps, given);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).fold(0.0, f64::max);
    let is_small = |log: usize| {
        let of: Vec<f64> = all.iter().filter(|p| p.log == log).map(|p| p.plateau.rate_rad_s).collect();
        of.iter().all(|rate| rate.abs() < SMALL * greatest) && of.iter().any(|r| *r > 0.0) && of.iter().any(|r| *r < 0.0)
    };
    let small: Vec<(f64, f64)> = all.iter().filter(|p| is_small(p.log)).map(|p| (p.plateau.rate_rad_s, p.shown)).collect();
    if small.len() < 8 || !steps.iter().any(|s| samples(&s.log, given).is_some()) {
        return findings
            .lacks("dead_band_rad_s", "it takes a staircase of small rates (below 5 % of the greatest), eight plateaus or more");
    }
    let y: Vec<f64> = small.iter().map(|(_, shown)| *shown).collect();
    let largest = small.iter().map(|(rate, _)| rate.abs()).fold(0.0, f64::max);
    let fit_at = |band: f64| {
        let rows: Vec<Vec<f64>> = small.iter().map(|(rate, _)| vec![1.0, (rate.abs() - band).max(0.0).copysign(*rate)]).collect();
        least_squares(&rows, &y)
    };
    // The sum of squares over the band: least, then where it has risen by one variance.
    let grid: Vec<(f64, f64)> = (0..400)
        .map(|k| f64::from(k) / 400.0 * 0.9 * largest)
        .filter_map(|band| fit_at(band).map(|f| (band, f.residuals.iter().map(|r| r * r).sum())))
        .collect();
    let Some(&(band, least)) = grid.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
    let dof = small.len() as f64 - 3.0;
    let variance = least / dof;
    let inside: Vec<f64> = grid.iter().filter(|(_, sum)| *sum < least + variance).map(|(band, _)| *band).collect();
    let step = 0.9 * largest / 400.0;
    let (low, high) = (inside.first().copied().unwrap_or(band), inside.last().copied().unwrap_or(band));
    let u = (0.5 * (high - low)).max(step / 12_f64.sqrt());
    let slope = fit_at(band).map_or(1.0, |f| f.coefficients[1]);
    let scatter = Part::measured("noise and repeatability", u, dof, format!("{} plateaus", small.len()));
    findings.quantities.push(Quantity::new("dead_band_rad_s", "rad/s", band, vec![scatter]).saying("rates within ± this show as rest"));
    let threshold = band + 2.0 * variance.sqrt() / slope.abs();
    let part = Part::measured(
        "noise and repeatability",
        u.hypot(2.0 * variance.sqrt() / slope.abs() / (2.0 * dof).sqrt()),
        dof,
        "two standard deviations of a plateau",
    );
    findings
        .quantities
        .push(Quantity::new("threshold_rad_s", "rad/s", threshold, vec![part]).saying("least rate that one plateau tells from rest"));
    let level = fit_at(band).map_or(0.0, |f| f.coefficients[0]);
    findings.curves.push(Curve {
        title: "Small rates".into(),
        x: "rate by the encoder, rad/s".into(),
        y: "shown less what is shown at rest, rad/s".into(),
        is_log: false,
        points: small.iter().map(|(rate, shown)| (*rate, shown - level)).collect(),
        line: (-100..=100).map(|k| f64::from(k) / 100.0 * largest).map(|r| (r, slope * (r.abs() - band).max(0.0).copysign(r))).collect(),
        ..Curve::default()
    });
}
