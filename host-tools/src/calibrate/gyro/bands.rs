//! Small rates: what is shown of them, and the dead band about rest.

use super::characteristic::{Point, points};
use super::{Given, samples};
use crate::calibrate::{Curve, Findings, Step};
use crate::statistics::Extremes;
use crate::statistics::least_squares;
use crate::statistics::robust::quantile;
use crate::statistics::uncertainty::{Part, Quantity};

/// Most of a log's rate that is small, as a part of the greatest of all.
const SMALL: f64 = 0.05;

/// A plateau whose samples scatter by more than this many times those of the quietest quarter was no constant rate.
const STEADY: f64 = 1.5;

/// Standard deviation of the samples within a plateau.
fn scatter(step: &Step, point: &Point, given: &Given) -> f64 {
    let Some(shown) = samples(&step.log, given) else { return 0.0 };
    let rows = point.plateau.rows.clone();
    let n = rows.len() as f64;
    (shown[rows].iter().map(|y| (y - point.shown).powi(2)).sum::<f64>() / n).sqrt()
}

/// Adds the dead band, and the smallest rate that is told from rest.
pub(super) fn add(steps: &[&Step], given: &Given, findings: &mut Findings) {
    let all = points(steps, given);
    let greatest = all.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
    let is_small = |log: usize| {
        let of: Vec<f64> = all.iter().filter(|p| p.log == log).map(|p| p.plateau.rate_rad_s).collect();
        of.iter().all(|rate| rate.abs() < SMALL * greatest) && of.iter().any(|r| *r > 0.0) && of.iter().any(|r| *r < 0.0)
    };
    let in_small: Vec<(&Point, f64)> = all.iter().filter(|p| is_small(p.log)).map(|p| (p, scatter(steps[p.log], p, given))).collect();
    // Where the platform creeps from count to count its rate runs over the band's corner, and the mean of what is shown is not that of the mean rate.
    let steady = STEADY * quantile(in_small.iter().map(|(_, scatter)| *scatter), 0.25).unwrap_or(0.0);
    let small: Vec<(f64, f64)> =
        in_small.iter().filter(|(_, scatter)| *scatter <= steady).map(|(p, _)| (p.plateau.rate_rad_s, p.shown)).collect();
    if small.len() < 8 || !steps.iter().any(|s| samples(&s.log, given).is_some()) {
        return findings.lacks(
            "dead_band_rad_s",
            "it takes a staircase of small rates (below 5 % of the greatest) at which the platform turns evenly, eight plateaus or more",
        );
    }
    let y: Vec<f64> = small.iter().map(|(_, shown)| *shown).collect();
    let largest = small.iter().map(|(rate, _)| rate.abs()).max_or_zero();
    let fit_at = |band: f64| {
        let rows: Vec<Vec<f64>> = small.iter().map(|(rate, _)| vec![1.0, (rate.abs() - band).max(0.0).copysign(*rate)]).collect();
        least_squares(&rows, &y)
    };
    // Roughly where the sum of squares is least; which plateaus lie within is then known, and the rest is linear: level + slope·rate − slope·band·sign.
    let rough = (0..400)
        .map(|k| f64::from(k) / 400.0 * 0.9 * largest)
        .filter_map(|band| fit_at(band).map(|f| (band, f.residuals.iter().map(|r| r * r).sum::<f64>())))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0.0, |(band, _)| band);
    let rows: Vec<Vec<f64>> =
        small.iter().map(|(rate, _)| if rate.abs() > rough { vec![1.0, *rate, -rate.signum()] } else { vec![1.0, 0.0, 0.0] }).collect();
    let Some(fit) = least_squares(&rows, &y) else {
        return findings.lacks("dead_band_rad_s", "it takes small rates beyond the band, two or more of each sign");
    };
    let [level, slope, below] = [fit.coefficients[0], fit.coefficients[1], fit.coefficients[2]];
    // A gyro that shows more than it should is none with a band below 0.
    let band = (below / slope).max(0.0);
    let u = fit.sigma_of(&[0.0, -below / slope / slope, 1.0 / slope]);
    let scatter = Part::measured("noise and repeatability", u, fit.dof, format!("{} plateaus", small.len()));
    // A plateau of the same rate is cut at the same part of a count each time: no scatter shows it.
    let quantum = steps.iter().filter_map(|s| s.log.quantum("theta_rad")).max_or_zero();
    let shortest_s = in_small.iter().map(|(p, _)| p.plateau.duration_s).min_or_infinity();
    let count = quantum / 6_f64.sqrt() / shortest_s;
    let encoder = Part::known("encoder", count, "rad/s", 1.0, "a count at either end of a plateau");
    findings
        .quantities
        .push(Quantity::new("dead_band_rad_s", "rad/s", band, vec![scatter, encoder.clone()]).saying("rates within ± this show as rest"));
    let two = 2.0 * fit.residual_sd / slope.abs();
    let part =
        Part::measured("noise and repeatability", u.hypot(two / (2.0 * fit.dof).sqrt()), fit.dof, "two standard deviations of a plateau");
    findings.quantities.push(
        Quantity::new("threshold_rad_s", "rad/s", band + two, vec![part, encoder]).saying("least rate that one plateau tells from rest"),
    );
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
