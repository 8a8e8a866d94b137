//! The part mounted otherwise: on a tilted stand, at another radius, on its side.

use super::characteristic::{characteristic, points};
use super::{Given, samples};
use crate::calibrate::plateaus::plateaus;
use crate::calibrate::{Findings, Lying, Step};
use crate::statistics::Extremes;
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};

/// √(2 ln 20) over 1.96: from the interval of a coordinate to that of the amplitude of two.
const AMPLITUDE: f64 = 1.249;

/// Adds g-sensitivity, what of the even order is nonlinearity, and the cross-axis.
pub(super) fn add(steps: &[Step], radius_m: f64, full_scale: f64, given: &Given, findings: &mut Findings) {
    let scale = findings.get("scale").map_or(1.0, |q| q.value);
    match on_tilt(steps, scale, given) {
        Some(q) => findings.quantities.push(q),
        None => findings.lacks("g_sensitivity_rad_s_g", "it takes whole turns on a tilted stand (a step with tilt_deg)"),
    }
    match two_radii(steps, radius_m, full_scale, given) {
        Some(both) => findings.quantities.extend(both),
        None => findings.lacks("g_sensitivity_outward_rad_s_g", "it takes the same staircase at a second radius (a step with radius_m)"),
    }
    match on_its_sides(steps, scale, given) {
        Some(both) => findings.quantities.extend(both),
        None => findings.lacks("cross_axis_percent", "it takes a staircase with the part on its side, and on the other (steps with lying)"),
    }
}

/// Gravity turns through the part: what it shows of cos θ and sin θ, with no rate behind it.
fn on_tilt(steps: &[Step], scale: f64, given: &Given) -> Option<Quantity> {
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    let mut tilt_deg: f64 = 0.0;
    for step in steps.iter().filter(|s| s.mounted.tilt_deg != 0.0 && s.mounted.lying == Lying::Flat) {
        let (log, lean) = (&step.log, given.known.gravity_m_s2 / 9.806_65 * step.mounted.tilt_deg.to_radians().sin());
        let (Some(shown), Some(theta)) = (samples(log, given), log.column("theta_rad")) else { continue };
        tilt_deg = step.mounted.tilt_deg;
        for plateau in plateaus(log, "rate_cmd_rad_s", given.settle_s).into_iter().filter(|p| p.turns > 0) {
            // Parts of a turn; the rate within each by the encoder, so that its own ripple is none of the gyro's.
            let parts = 24 * plateau.turns as usize;
            let size = plateau.rows.len() / parts;
            for part in 0..parts {
                let (from, to) = (plateau.rows.start + part * size, plateau.rows.start + (part + 1) * size);
                let n = size as f64;
                let rate = (theta[to] - theta[from]) / (log.t_s()[to] - log.t_s()[from]);
                let mean = |f: fn(f64) -> f64| theta[from..to].iter().map(|a| f(*a)).sum::<f64>() / n;
                rows.push(vec![1.0, rate, lean * mean(f64::cos), lean * mean(f64::sin)]);
                y.push(shown[from..to].iter().sum::<f64>() / n);
            }
        }
    }
    let fit = least_squares(&rows, &y)?;
    // Of the rate, as the other coefficients: over the scale, whose own uncertainty is nothing beside the level's.
    let (c, s) = (fit.coefficients[2] / scale, fit.coefficients[3] / scale);
    let size = c.hypot(s).max(f64::MIN_POSITIVE);
    let u = fit.sigma_of(&[0.0, 0.0, c / size / scale.abs(), s / size / scale.abs()]);
    // An amplitude is never below 0: where noise alone makes it, 95 % lie below √(2 ln 20) and not 1.96.
    let wide = if size < 3.0 * u { AMPLITUDE } else { 1.0 };
    let noise = Part::measured("noise", wide * u, fit.dof, format!("{} parts of turns", rows.len()));
    let slope = size / tilt_deg.to_radians().tan().abs();
    let tilt = Part::within("tilt", given.known.level_deg.to_radians(), "rad", slope, format!("± {}°", given.known.level_deg));
    Some(
        Quantity::new("g_sensitivity_rad_s_g", "rad/s/g", size, vec![noise, tilt])
            .saying("amplitude over a turn on the tilted stand, per g across the axis"),
    )
}

/// The coefficient of Ω² at two radii: c₂ + G r.
fn two_radii(steps: &[Step], radius_m: f64, full_scale: f64, given: &Given) -> Option<[Quantity; 2]> {
    let upright = |s: &&Step| s.mounted.lying == Lying::Flat && s.mounted.tilt_deg == 0.0;
    let other_m = steps.iter().filter(upright).map(|s| s.mounted.radius_m).find(|r| *r != radius_m)?;
    let at = |radius: f64| {
        let there: Vec<&Step> = steps.iter().filter(upright).filter(|s| s.mounted.radius_m == radius).collect();
        let greatest = |p: &super::characteristic::Point| p.plateau.rate_rad_s.abs() > 0.0;
        let used: Vec<_> = points(&there, given).into_iter().filter(greatest).collect();
        let largest = used.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
        let logs: Vec<usize> = used.iter().filter(|p| p.plateau.rate_rad_s.abs() > 0.5 * largest).map(|p| p.log).collect();
        characteristic(used.into_iter().filter(|p| logs.contains(&p.log)).collect(), full_scale)?.quadratic()
    };
    let (near, far) = (at(radius_m)?, at(other_m)?);
    let apart_m = other_m - radius_m;
    // Outward the specific force is −Ω² r.
    let slope = (far.value - near.value) / apart_m;
    let g = 9.806_65;
    let noise = |q: &Quantity, per: f64, of: &str| Part::measured(of, q.sigma() * per.abs(), q.dof(), "the coefficient of Ω² there");
    let radius = |at: &str, sensitivity: f64| {
        Part::within(at, given.known.radius_error_m, "m", sensitivity, format!("± {} m", given.known.radius_error_m))
    };
    let outward = Quantity::new(
        "g_sensitivity_outward_rad_s_g",
        "rad/s/g",
        -slope * g,
        vec![
            noise(&near, g / apart_m, "first radius"),
            noise(&far, g / apart_m, "second radius"),
            radius("near radius", slope * g / apart_m),
            radius("far radius", slope * g / apart_m),
        ],
    )
    .saying("by the centripetal acceleration at two radii");
    let curve = Quantity::new(
        "quadratic_at_axis_s",
        "s",
        near.value - slope * radius_m,
        vec![
            noise(&near, 1.0 + radius_m / apart_m, "first radius"),
            noise(&far, radius_m / apart_m, "second radius"),
            radius("near radius", slope * (1.0 + radius_m / apart_m)),
            radius("far radius", slope * radius_m / apart_m),
        ],
    )
    .saying("the coefficient of Ω² that is the gyro's own: what is left at the axis");
    Some([outward, curve])
}

/// The sensitive axis across the platform's: what is shown is cross-axis sensitivity, which changes sign when the part is turned about its sensitive axis,
/// and misalignment, which does not.
fn on_its_sides(steps: &[Step], scale: f64, given: &Given) -> Option<[Quantity; 2]> {
    let slope = |lying: Lying| {
        let there: Vec<&Step> = steps.iter().filter(|s| s.mounted.lying == lying).collect();
        let (rows, y): (Vec<Vec<f64>>, Vec<f64>) =
            points(&there, given).iter().map(|p| (vec![1.0, p.plateau.rate_rad_s, p.plateau.rate_rad_s.powi(2)], p.shown)).unzip();
        least_squares(&rows, &y)
    };
    let (one, other) = (slope(Lying::Side)?, slope(Lying::OtherSide)?);
    let (a, b) = (one.coefficients[1], other.coefficients[1]);
    // Of the rate, not of what is shown: over the scale, whose own uncertainty is a small part of a small slope.
    let (a, b) = (a / scale, b / scale);
    let parts = |per: f64| {
        let per = per / scale.abs();
        vec![
            Part::measured("one side", one.sigma(1) * per, one.dof, "slope of what is shown over the rate"),
            Part::measured("other side", other.sigma(1) * per, other.dof, "slope of what is shown over the rate"),
        ]
    };
    let cross = Quantity::new("cross_axis_percent", "%", 50.0 * (a - b), parts(50.0))
        .saying("of the rate about the part's y: half the difference of both sides");
    let off = Quantity::new("mounting_deg", "°", (0.5 * (a + b)).to_degrees(), parts(0.5_f64.to_degrees()))
        .saying("sensitive axis off the platform's plane as it was mounted: half the sum of both sides");
    Some([cross, off])
}
