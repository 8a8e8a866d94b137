//! Steps with another mounting: on a tilted stand, at another radius, on both sides.

use super::characteristic::characteristic;
use super::influences::STANDARD_GRAVITY_M_S2;
use super::points::{Point, points};
use super::{GyroSettings, dut_output};
use crate::calibrate::plateaus::plateaus;
use crate::calibrate::{AbsenceReason, Basis, Findings, Meaning, Orientation, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::Extremes;
use identification::statistics::least_squares;

/// √(2 ln 20) over 1.96: ratio of the 95 % limits of the amplitude of two normal coordinates and of one coordinate.
const AMPLITUDE_FACTOR: f64 = 1.249;
/// Amplitude in standard uncertainties below which noise dominates it.
const NOISE_DOMINATED_SIGMAS: f64 = 3.0;
/// Parts of a turn on a tilted stand.
const PARTS_PER_TURN: usize = 24;

/// Adds g-sensitivity, the even nonlinearity at the axis, and cross-axis sensitivity.
pub(super) fn add(steps: &[&Step], radius_m: f64, full_scale: f64, settings: &GyroSettings, findings: &mut Findings) {
    let scale = findings.get("scale").map_or(1.0, |q| q.value);
    match on_tilt(steps, scale, settings) {
        Some(q) => findings.quantities.push(q),
        None => findings.add_absent("g_sensitivity_rad_s_g", AbsenceReason::NeedsTilt),
    }
    match two_radii(steps, radius_m, full_scale, settings) {
        Some(both) => findings.quantities.extend(both),
        None => findings.add_absent("g_sensitivity_outward_rad_s_g", AbsenceReason::NeedsSecondRadius),
    }
    match on_its_sides(steps, scale, settings) {
        Some(both) => findings.quantities.extend(both),
        None => findings.add_absent("cross_axis_percent", AbsenceReason::NeedsBothSides),
    }
}

/// Amplitude of the output with cos θ and sin θ on a tilted stand, where gravity rotates in the frame of the device under test.
fn on_tilt(steps: &[&Step], scale: f64, settings: &GyroSettings) -> Option<Quantity> {
    let (mut rows, mut y) = (Vec::new(), Vec::new());
    let mut tilt_deg: f64 = 0.0;
    for step in steps.iter().filter(|s| s.mounting.tilt_deg != 0.0 && s.mounting.orientation == Orientation::Flat) {
        let (log, lean) =
            (&step.log, settings.assumptions.gravity_m_s2 / STANDARD_GRAVITY_M_S2 * step.mounting.tilt_deg.to_radians().sin());
        let (Some(output), Some(theta)) = (dut_output(log, settings), log.column("theta_rad")) else { continue };
        tilt_deg = step.mounting.tilt_deg;
        for plateau in plateaus(log, "rate_cmd_rad_s", settings.settle_s).into_iter().filter(|p| p.turns > 0) {
            // The encoder measures the rate within each part of a turn, so that a ripple of the rate is not attributed to gravity.
            let parts = PARTS_PER_TURN * plateau.turns as usize;
            let size = plateau.rows.len() / parts;
            for part in 0..parts {
                let (from, to) = (plateau.rows.start + part * size, plateau.rows.start + (part + 1) * size);
                let n = size as f64;
                let rate = (theta[to] - theta[from]) / (log.t_s()[to] - log.t_s()[from]);
                let mean = |f: fn(f64) -> f64| theta[from..to].iter().map(|a| f(*a)).sum::<f64>() / n;
                rows.push(vec![1.0, rate, lean * mean(f64::cos), lean * mean(f64::sin)]);
                y.push(output[from..to].iter().sum::<f64>() / n);
            }
        }
    }
    let fit = least_squares(&rows, &y)?;
    // In units of rate: divided by the scale, whose uncertainty is negligible here.
    let (c, s) = (fit.coefficients[2] / scale, fit.coefficients[3] / scale);
    let size = c.hypot(s).max(f64::MIN_POSITIVE);
    let u = fit.sigma_of(&[0.0, 0.0, c / size / scale.abs(), s / size / scale.abs()]);
    // An amplitude is positive: where noise dominates it, 95 % lie below √(2 ln 20) u and not 1.96 u.
    let factor = if size < NOISE_DOMINATED_SIGMAS * u { AMPLITUDE_FACTOR } else { 1.0 };
    let noise = Contribution::type_a("noise", factor * u, fit.dof, Basis::TurnParts { count: rows.len() });
    let slope = size / tilt_deg.to_radians().tan().abs();
    let tilt = Contribution::rectangular(
        "tilt",
        settings.assumptions.level_deg.to_radians(),
        "rad",
        slope,
        Basis::TiltHalfWidth { half_width_deg: settings.assumptions.level_deg },
    );
    Some(Quantity::new("g_sensitivity_rad_s_g", "rad/s/g", size, vec![noise, tilt]).meaning(Meaning::GSensitivityByTilt))
}

/// g-sensitivity G and c₂ by the coefficient of Ω² at two radii, c₂ + G r.
fn two_radii(steps: &[&Step], radius_m: f64, full_scale: f64, settings: &GyroSettings) -> Option<[Quantity; 2]> {
    let upright = |s: &&Step| s.mounting.orientation == Orientation::Flat && s.mounting.tilt_deg == 0.0;
    let other_m = steps.iter().copied().filter(upright).map(|s| s.mounting.radius_m).find(|r| *r != radius_m)?;
    let at = |radius: f64| {
        let there: Vec<&Step> = steps.iter().copied().filter(upright).filter(|s| s.mounting.radius_m == radius).collect();
        let is_moving = |p: &Point| p.plateau.rate_rad_s.abs() > 0.0;
        let used: Vec<_> = points(&there, settings).into_iter().filter(is_moving).collect();
        let largest = used.iter().map(|p| p.plateau.rate_rad_s.abs()).max_or_zero();
        let logs: Vec<usize> = used.iter().filter(|p| p.plateau.rate_rad_s.abs() > 0.5 * largest).map(|p| p.log).collect();
        characteristic(used.into_iter().filter(|p| logs.contains(&p.log)).collect(), full_scale)?.quadratic()
    };
    let (near, far) = (at(radius_m)?, at(other_m)?);
    let apart_m = other_m - radius_m;
    // The outward specific force is −Ω² r.
    let slope = (far.value - near.value) / apart_m;
    let g = STANDARD_GRAVITY_M_S2;
    let noise = |q: &Quantity, sensitivity: f64, source: &str| {
        Contribution::type_a(source, q.combined_u() * sensitivity.abs(), q.effective_dof(), Basis::QuadraticCoefficient)
    };
    let half_width_m = settings.assumptions.radius_error_m;
    let radius = |source: &str, sensitivity: f64| {
        Contribution::rectangular(source, half_width_m, "m", sensitivity, Basis::RadiusHalfWidth { half_width_m })
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
    .meaning(Meaning::GSensitivityByRadius);
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
    .meaning(Meaning::QuadraticAtAxis);
    Some([outward, curve])
}

/// Cross-axis sensitivity and mounting error by two orientations with the sensitive axis across the platform's axis. Turned by 180° about
/// the sensitive axis, cross-axis sensitivity changes its sign and the mounting error does not.
fn on_its_sides(steps: &[&Step], scale: f64, settings: &GyroSettings) -> Option<[Quantity; 2]> {
    let slope = |lying: Orientation| {
        let there: Vec<&Step> = steps.iter().copied().filter(|s| s.mounting.orientation == lying).collect();
        let (rows, y): (Vec<Vec<f64>>, Vec<f64>) =
            points(&there, settings).iter().map(|p| (vec![1.0, p.plateau.rate_rad_s, p.plateau.rate_rad_s.powi(2)], p.output)).unzip();
        least_squares(&rows, &y)
    };
    let (one, other) = (slope(Orientation::Side)?, slope(Orientation::OtherSide)?);
    let (a, b) = (one.coefficients[1], other.coefficients[1]);
    // In units of rate: divided by the scale, whose uncertainty is negligible for such small slopes.
    let (a, b) = (a / scale, b / scale);
    let contributions = |per: f64| {
        let per = per / scale.abs();
        vec![
            Contribution::type_a("one side", one.sigma(1) * per, one.dof, Basis::SlopeOverRate),
            Contribution::type_a("other side", other.sigma(1) * per, other.dof, Basis::SlopeOverRate),
        ]
    };
    let cross = Quantity::new("cross_axis_percent", "%", 50.0 * (a - b), contributions(50.0)).meaning(Meaning::CrossAxis);
    let off = Quantity::new("mounting_deg", "°", (0.5 * (a + b)).to_degrees(), contributions(0.5_f64.to_degrees()))
        .meaning(Meaning::MountingError);
    Some([cross, off])
}
