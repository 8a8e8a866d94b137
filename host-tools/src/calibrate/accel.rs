//! An accelerometer as a rate sensor at a radius (theory.md §4): f_x = −Ω² r cos χ + Ω′ r sin χ, f_y = Ω² r sin χ + Ω′ r cos χ, with scale, bias, and what
//! gravity does on a stand that leans.
//!
//! In: steps with `accel_x_m_s2`, `accel_y_m_s2` and the encoder's angle. Out: radius or scale (one radius cannot tell them apart: one of the two is believed; a
//! second radius can), the angle χ, the biases; where it is blind; and the rates that gyro, accelerometer, encoder and back-EMF give of one run, with
//! their weighted combination.
//!
//! The angle is fitted by a parabola over [`WINDOW_S`]: its slope is Ω, its curvature Ω′.

use super::plateaus::{Plateau, plateaus};
use super::session::Session;
use super::{CalibrateError, Curve, Findings, Step};
use crate::statistics::Extremes;
use crate::statistics::robust::median;
use crate::statistics::uncertainty::{Part, Quantity};
use crate::statistics::{LeastSquares, least_squares};
use std::ops::Range;

/// Length of a window, s.
const WINDOW_S: f64 = 0.03;

/// Means over a window.
struct Window {
    /// Of Ω².
    square: f64,
    acceleration: f64,
    cos: f64,
    sin: f64,
    x: f64,
    y: f64,
}

/// A window with so many samples at the greatest size that either axis shows is at the end of the part's range, and shows no more than that.
const AT_END: usize = 3;
/// Both ends of a range are one code apart in size.
const END: f64 = 1e-4;
/// Where the angle is off its parabola by more than this many times what it is elsewhere, the acceleration changed within the window.
const BENT: f64 = 3.0;

fn windows(step: &Step) -> Vec<Window> {
    let log = &step.log;
    let (Some(theta), Some(x), Some(y)) = (log.column("theta_rad"), log.column("accel_x_m_s2"), log.column("accel_y_m_s2")) else {
        return Vec::new();
    };
    let most = x.iter().chain(y).copied().max_abs();
    let at_end = |rows: &Range<usize>| {
        let is = |column: &[f64]| column[rows.clone()].iter().filter(|v| v.abs() >= most * (1.0 - END)).count() >= AT_END;
        most > 0.0 && (is(x) || is(y))
    };
    let t_s = log.t_s();
    let size = ((WINDOW_S / log.median_dt_s().max(1e-9)).round() as usize).max(8);
    let (mut found, mut scatters) = (Vec::new(), Vec::new());
    for segment in log.segments() {
        for from in segment.clone().step_by(size).filter(|from| from + size <= segment.end) {
            let rows = from..from + size;
            if at_end(&rows) {
                continue;
            }
            let length_s = t_s[rows.end - 1] - t_s[rows.start];
            let middle_s = 0.5 * (t_s[rows.start] + t_s[rows.end - 1]);
            let parabola: Vec<Vec<f64>> = rows.clone().map(|k| t_s[k] - middle_s).map(|t| vec![1.0, t, t * t / 2.0]).collect();
            let Some(fit) = least_squares(&parabola, &theta[rows.clone()]) else { continue };
            let [rate, acceleration] = [fit.coefficients[1], fit.coefficients[2]];
            let mean = |of: &dyn Fn(usize) -> f64| rows.clone().map(of).sum::<f64>() / size as f64;
            scatters.push(fit.residual_sd);
            found.push(Window {
                // Of the middle's rate, and of what it changes to both sides.
                square: rate * rate + (acceleration * length_s).powi(2) / 12.0,
                acceleration,
                cos: mean(&|k| theta[k].cos()),
                sin: mean(&|k| theta[k].sin()),
                x: mean(&|k| x[k]),
                y: mean(&|k| y[k]),
            });
        }
    }
    // A nanoradian is rounding.
    let straight = BENT * median(scatters.iter().copied()).unwrap_or(0.0).max(1e-9);
    found.into_iter().zip(scatters).filter(|(_, scatter)| *scatter <= straight).map(|(window, _)| window).collect()
}

/// What both axes show at one radius.
struct AtRadius {
    radius_m: f64,
    x: LeastSquares,
    y: LeastSquares,
}

impl AtRadius {
    /// Scale × radius × (cos χ, sin χ), with variances: x and y both show each; weighted.
    fn effective(&self) -> [(f64, f64); 2] {
        let both = |a: (f64, f64), b: (f64, f64)| {
            let (wa, wb) = (a.1.powi(-2), b.1.powi(-2));
            ((a.0 * wa + b.0 * wb) / (wa + wb), (wa + wb).powf(-0.5))
        };
        let of = |fit: &LeastSquares, k: usize, sign: f64| (sign * fit.coefficients[k], fit.sigma(k));
        [both(of(&self.x, 1, -1.0), of(&self.y, 2, 1.0)), both(of(&self.y, 1, 1.0), of(&self.x, 2, 1.0))]
    }

    /// Scale × radius and its standard uncertainty.
    fn product(&self) -> (f64, f64) {
        let [(c, uc), (s, us)] = self.effective();
        let size = c.hypot(s);
        (size, (c * uc).hypot(s * us) / size.max(f64::MIN_POSITIVE))
    }
}

fn at_radius(steps: &[&Step]) -> Option<AtRadius> {
    // Gravity comes round with the angle: a step whose angle is from another zero than the index does not go with those from it.
    let has_index = steps.iter().any(|step| step.log.theta_zero_is_index());
    let from_one_zero = steps.iter().filter(|step| step.log.theta_zero_is_index() == has_index);
    let all: Vec<Window> = from_one_zero.flat_map(|step| windows(step)).collect();
    let rows: Vec<Vec<f64>> = all.iter().map(|w| vec![1.0, w.square, w.acceleration, w.cos, w.sin]).collect();
    let x: Vec<f64> = all.iter().map(|w| w.x).collect();
    let y: Vec<f64> = all.iter().map(|w| w.y).collect();
    Some(AtRadius { radius_m: steps.first()?.mounted.radius_m, x: least_squares(&rows, &x)?, y: least_squares(&rows, &y)? })
}

/// Computes what the steps show.
///
/// # Errors
/// No log has the columns; nothing turned.
pub fn calibrate(steps: &[Step], session: &Session) -> Result<Findings, CalibrateError> {
    let has = |s: &&Step| s.log.column("accel_x_m_s2").is_some() && s.log.column("accel_y_m_s2").is_some();
    let used: Vec<&Step> = steps.iter().filter(has).collect();
    let Some(first) = used.first() else {
        return Err(CalibrateError::Column {
            what: "accel",
            column: "accel_x_m_s2 and accel_y_m_s2".into(),
            hint: "the stand must carry an accelerometer",
        });
    };
    let near_m = first.mounted.radius_m;
    let of_radius = |radius: f64| used.iter().copied().filter(|s| s.mounted.radius_m == radius).collect::<Vec<_>>();
    let too_little = || CalibrateError::TooLittle {
        what: "accel",
        says: "the platform hardly turned; record a staircase and a sine in rate mode".into(),
    };
    let near = at_radius(&of_radius(near_m)).ok_or_else(too_little)?;
    let far = used.iter().map(|s| s.mounted.radius_m).find(|r| *r != near_m).and_then(|radius| at_radius(&of_radius(radius)));
    let mut findings = Findings::default();
    let (product, u) = near.product();
    if product.is_nan() || product <= 5.0 * u {
        return Err(too_little());
    }
    let radius_error_m = session.known.radius_error_m;
    let scatter = |u: f64, fit: &LeastSquares| Part::measured("noise", u, fit.dof, format!("scatter of windows of {} ms", WINDOW_S * 1e3));
    match far {
        Some(far) => {
            let (other, other_u) = far.product();
            let apart_m = far.radius_m - near_m;
            let scale = (other - product) / apart_m;
            let says = format!("± {radius_error_m} m");
            let parts = vec![
                scatter(u / apart_m.abs(), &near.x),
                scatter(other_u / apart_m.abs(), &far.x),
                Part::within("near radius", radius_error_m, "m", scale / apart_m, says.clone()),
                Part::within("far radius", radius_error_m, "m", scale / apart_m, says),
            ];
            let q = Quantity::new("scale", "1", scale, parts).saying("by the difference of two radii: no bias, no radius enters by itself");
            let su = q.sigma();
            findings.quantities.push(q);
            let parts = vec![scatter(u / scale, &near.x), Part::known("scale", su, "1", product / scale / scale, "by two radii")];
            findings.quantities.push(
                Quantity::new("radius_m", "m", product / scale, parts).saying("of the accelerometer's element, at the first mounting"),
            );
        }
        None => {
            let says = format!("the radius is believed to be {near_m} ± {radius_error_m} m");
            let parts = vec![scatter(u / near_m, &near.x), Part::within("radius", radius_error_m, "m", product / near_m / near_m, says)];
            findings.quantities.push(
                Quantity::new("scale", "1", product / near_m, parts)
                    .saying("with the radius as it was given; a second radius tells them apart"),
            );
            let percent = session.known.scale_percent;
            let says = format!("the scale is believed to be 1 ± {percent} %");
            let parts = vec![scatter(u, &near.x), Part::within("scale", percent / 100.0, "1", product, says)];
            let q = Quantity::new("radius_m", "m", product, parts).saying("with a scale of 1; a second radius tells them apart");
            findings.quantities.push(q);
        }
    }
    let [(c, uc), (s, us)] = near.effective();
    let angle_u = (s * uc).hypot(c * us) / (c * c + s * s);
    findings.quantities.push(
        Quantity::new("angle_deg", "°", s.atan2(c).to_degrees(), vec![scatter(angle_u.to_degrees(), &near.x)])
            .saying("from outward to the sensor's x, towards the motion"),
    );
    for (name, fit) in [("bias_x_m_s2", &near.x), ("bias_y_m_s2", &near.y)] {
        findings.quantities.push(
            Quantity::new(name, "m/s²", fit.coefficients[0], vec![scatter(fit.sigma(0), fit)])
                .saying("gravity on a leaning stand is taken off by the angle"),
        );
    }
    blind(&near, product, &mut findings);
    combine(&of_radius(near_m), product, near.x.coefficients[0], session, &mut findings);
    Ok(findings)
}

/// What an error of the specific force makes of a rate |Ω| = √(f/r): f/(2 Ω r) for a small one, rad/s.
fn rate_error(force_m_s2: f64, rate_rad_s: f64, radius_m: f64) -> f64 {
    force_m_s2 / (2.0 * rate_rad_s.abs() * radius_m)
}

/// Where |Ω| = √(f/r) is worth nothing: an error of f makes one of f/(2 Ω r), and below √(f/(2 r)) that is the rate itself.
fn blind(near: &AtRadius, product: f64, findings: &mut Findings) {
    let error = near.x.residual_sd.hypot(near.x.sigma(0));
    let value = (error / (2.0 * product)).sqrt();
    let part = Part::measured("noise", value / (8.0 * near.x.dof).sqrt(), near.x.dof, "of the scatter of one window");
    findings.quantities.push(
        Quantity::new("blind_below_rad_s", "rad/s", value, vec![part])
            .saying(format!("a window of {} ms then errs by the rate itself; the sign of the rate is never seen", WINDOW_S * 1e3)),
    );
    findings.says.push("an accelerometer at a radius shows the square of the rate: no sign, and nothing near rest".into());
}

/// The rates of all witnesses at the plateaus of one run: each with its scatter, and the combination by their weights.
fn combine(steps: &[&Step], product: f64, bias: f64, session: &Session, findings: &mut Findings) {
    let Some((log, found)) = steps
        .iter()
        .map(|s| (&s.log, plateaus(&s.log, "rate_cmd_rad_s", session.settle_s)))
        .max_by(|a, b| widest(&a.1).total_cmp(&widest(&b.1)))
        .filter(|(_, found)| found.len() >= 6)
    else {
        return;
    };
    let column = |name: &str| log.column(name);
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s != 0.0).collect();
    let mut witnesses: Vec<(String, Vec<(f64, f64)>)> = Vec::new();
    // The spread of means over a tenth of a plateau, over √10.
    let u_of = |values: &[f64], rows: &Range<usize>| {
        let parts: Vec<f64> = (0..10)
            .map(|k| rows.start + k * rows.len() / 10..rows.start + (k + 1) * rows.len() / 10)
            .map(|r| values[r.clone()].iter().sum::<f64>() / r.len().max(1) as f64)
            .collect();
        let mean = parts.iter().sum::<f64>() / 10.0;
        (parts.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 90.0).sqrt()
    };
    let mut weighed: Vec<Vec<(f64, f64)>> = vec![Vec::new(); moving.len()];
    let mut witness = |name: &str, rates: Vec<(f64, f64)>| {
        // A witness errs by more than its scatter: its own curve shows over all plateaus.
        let off = moving.iter().zip(&rates).map(|(p, (rate, _))| (rate - p.rate_rad_s).powi(2)).sum::<f64>() / rates.len().max(1) as f64;
        for (k, (rate, u)) in rates.iter().enumerate() {
            weighed[k].push((*rate, u.hypot(off.sqrt())));
        }
        witnesses.push((name.to_owned(), moving.iter().zip(&rates).map(|(p, (rate, _))| (p.rate_rad_s, rate - p.rate_rad_s)).collect()));
    };
    if let Some(gyro) = column("gyro_rad_s") {
        let rows: Vec<Vec<f64>> = found.iter().map(|p| vec![1.0, p.rate_rad_s]).collect();
        if let Some(fit) = least_squares(&rows, &found.iter().map(|p| p.mean(gyro)).collect::<Vec<_>>()) {
            let [b, s] = [fit.coefficients[0], fit.coefficients[1]];
            witness("gyro", moving.iter().map(|p| ((p.mean(gyro) - b) / s, u_of(gyro, &p.rows) / s.abs())).collect());
        }
    }
    if let Some(x) = column("accel_x_m_s2") {
        let rate = |p: &Plateau| {
            let size = ((bias - p.mean(x)) / product).max(0.0).sqrt();
            (size.copysign(p.rate_rad_s), rate_error(u_of(x, &p.rows), size.max(1e-3), product))
        };
        witness("accelerometer (its sign from the encoder)", moving.iter().map(|p| rate(p)).collect());
    }
    if let (Some(u_V), Some(i_A)) = (column("u_V"), column("i_A")) {
        // u = R i + K Ω + V sign Ω, all from this run.
        let rows: Vec<Vec<f64>> = moving.iter().map(|p| vec![p.rate_rad_s, p.mean(i_A), p.rate_rad_s.signum()]).collect();
        let y: Vec<f64> = moving.iter().map(|p| p.mean(u_V)).collect();
        if let Some(fit) = least_squares(&rows, &y) {
            let [k, r, v] = [fit.coefficients[0], fit.coefficients[1], fit.coefficients[2]];
            let rate = |p: &Plateau| {
                (
                    (p.mean(u_V) - r * p.mean(i_A) - v * p.rate_rad_s.signum()) / k,
                    u_of(u_V, &p.rows).hypot(r * u_of(i_A, &p.rows)) / k.abs(),
                )
            };
            witness("back-EMF", moving.iter().map(|p| rate(p)).collect());
        }
    }
    let combined: Vec<(f64, f64)> = moving
        .iter()
        .zip(&weighed)
        .map(|(p, rates)| {
            let (sum, weights) = rates
                .iter()
                .filter(|(_, u)| *u > 0.0)
                .fold((0.0, 0.0), |(sum, weights), (rate, u)| (sum + rate / (u * u), weights + 1.0 / (u * u)));
            (p.rate_rad_s, sum / weights - p.rate_rad_s)
        })
        .filter(|(_, off)| off.is_finite())
        .collect();
    let n = combined.len() as f64;
    let rms = (combined.iter().map(|(_, off)| off * off).sum::<f64>() / n).sqrt();
    let part = Part::measured("number of plateaus", rms / (2.0 * n).sqrt(), n, "standard uncertainty of a standard deviation");
    findings.quantities.push(
        Quantity::new("combined_rms_rad_s", "rad/s", rms, vec![part])
            .saying("weighted combination of all witnesses but the encoder, less the encoder, over the plateaus of one run; weights by scatter and by departure"),
    );
    findings.curves.push(Curve {
        title: "All witnesses of one run, less the encoder".into(),
        x: "rate by the encoder, rad/s".into(),
        y: "shown less the encoder, rad/s".into(),
        name: "all together, weighted".into(),
        points: combined,
        beside: witnesses,
        ..Curve::default()
    });
}

fn widest(found: &[Plateau]) -> f64 {
    found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounted;
    use crate::log::{Column, Log};

    /// A platform that speeds up from 0 to 20 rad/s by 5 rad/s² and down again, and what a part at this radius and angle shows of it by theory.md §4.
    fn step(radius_m: f64, chi_rad: f64) -> Step {
        let t_s: Vec<f64> = (0..8000).map(|k| f64::from(k) * 1e-3).collect();
        let (sin, cos) = chi_rad.sin_cos();
        let force = |t: &f64| {
            let (rate, acceleration) = if *t < 4.0 { (5.0 * t, 5.0) } else { (5.0 * (8.0 - t), -5.0) };
            [-rate * rate * radius_m * cos + acceleration * radius_m * sin, rate * rate * radius_m * sin + acceleration * radius_m * cos]
        };
        let angle = |t: &f64| if *t < 4.0 { 2.5 * t * t } else { 80.0 - 2.5 * (8.0 - t).powi(2) };
        let at_10 = force(&2.0);
        if (radius_m, chi_rad.to_degrees()) == (0.05, 2.0) {
            assert!((at_10[0] + 4.988_229_261).abs() < 1e-9 && (at_10[1] - 0.424_345_190).abs() < 1e-9, "{at_10:?}");
        }
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        let columns = vec![
            column("theta_rad", t_s.iter().map(angle).collect()),
            column("accel_x_m_s2", t_s.iter().map(|t| force(t)[0]).collect()),
            column("accel_y_m_s2", t_s.iter().map(|t| force(t)[1]).collect()),
            column("t_s", t_s),
        ];
        let log = Log::new("x.csv", columns, Vec::new()).unwrap();
        Step { name: "up".into(), log, mounted: Mounted { radius_m, ..Mounted::default() }, added_inertia_kg_m2: None }
    }

    #[test]
    fn radius_and_angle_come_back_from_the_forces_of_theory_4() {
        for (radius_m, chi_deg) in [(0.05, 2.0_f64), (0.03, -1.5), (0.08, 0.0)] {
            let step = step(radius_m, chi_deg.to_radians());
            let found = at_radius(&[&step]).unwrap();
            let [(c, _), (s, _)] = found.effective();
            // The mean of Ω² over a window is its middle's and (Ω′ times its length)²/12: it goes into the bias, all but rounding.
            assert!((found.product().0 / radius_m - 1.0).abs() < 1e-6, "{}", found.product().0);
            assert!((s.atan2(c).to_degrees() - chi_deg).abs() < 1e-4, "{}", s.atan2(c).to_degrees());
        }
    }

    #[test]
    fn a_thousandth_of_g_is_a_tenth_of_a_radian_a_second_at_one() {
        let mg = 9.806_65e-3;
        assert!((rate_error(mg, 1.0, 0.05) - 0.098_066_5).abs() < 1e-12);
        assert!((rate_error(mg, -10.0, 0.05) - 0.009_806_65).abs() < 1e-12);
    }
}
