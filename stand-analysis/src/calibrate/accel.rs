//! Accelerometer as a rate sensor at a radius (docs/theory.md §4): f_x = −Ω² r cos χ + Ω′ r sin χ, f_y = Ω² r sin χ + Ω′ r cos χ, with
//! scale, bias and the gravity of a tilted stand.
//!
//! Input: steps with `accel_x_m_s2`, `accel_y_m_s2` and the encoder angle. Output: radius or scale (one radius determines their product
//! only, so one of them is an assumption; a second radius separates them), the angle χ, the biases, the rate below which the sensor is
//! blind, and the rates by rate gyro, accelerometer and back-EMF with their weighted combination, compared with the encoder.
//!
//! Rate Ω and acceleration Ω′ are slope and curvature of a parabola through the encoder angle over [`WINDOW_S`]. Windows in which the
//! platform accelerates have residuals up to thirty times those at constant rate (the age of the sample and the low-pass of the chip), so
//! the fit is weighted by the scatter of windows of similar acceleration. Neighbouring residuals are correlated (flicker noise, ripple of
//! the rate), so the uncertainties follow from sums over clusters.
//!
//! An eccentric encoder shows φ = θ + c cos θ + s sin θ. Rate and acceleration by the encoder then have ripples, and the forces terms φ′²
//! cos φ and φ′² sin φ, which gravity does not have: its terms do not grow with the rate. Both terms are fitted where the platform turns in
//! both senses at different rates; both senses cancel the delay of the samples, which makes such a term of the gravity. The angle is
//! corrected by the coefficients found, and the fit repeated with both terms: the uncertainty of the correction is in that of scale, angle
//! and bias.

use super::crystal;
use super::plateaus::{Plateau, plateaus};
use super::{AbsenceReason, Basis, CalibrateError, Curve, CurveKind, Findings, Meaning, Remark, SeriesKind, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::statistics::Extremes;
use identification::statistics::robust::median;
use identification::statistics::uncertainty::u_of_standard_deviation;
use identification::statistics::{LeastSquares, clustered_least_squares, least_squares};
use stand_acquire::calibration_session::Session;
use std::ops::Range;

/// Length of a window, s.
const WINDOW_S: f64 = 0.03;

/// Means over a window.
struct Window {
    /// Mean of Ω².
    square: f64,
    /// Mean rate.
    rate: f64,
    acceleration: f64,
    /// Number of the cluster.
    cluster: usize,
    cos: f64,
    sin: f64,
    x: f64,
    y: f64,
}

/// Number of clusters into which the windows of a radius are divided in time.
const CLUSTERS: usize = 48;
/// Limits of the acceleration that divide the windows by their scatter, rad/s².
const ACCELERATION_CLASSES: [f64; 5] = [0.3, 1.0, 5.0, 20.0, 60.0];
/// Fewest windows of a class.
const MIN_CLASS_WINDOWS: usize = 8;
/// Repetitions of the weighted fit.
const WEIGHTINGS: usize = 3;
/// Smallest fraction of the sum of Ω² in each sense of rotation with which the terms of the encoder are fitted.
const MIN_SENSE_FRACTION: f64 = 0.2;
/// Smallest relative spread of Ω², weighted by Ω², that separates the terms of the encoder from gravity.
const MIN_RELATIVE_SPREAD: f64 = 0.2;
/// Corrections of the angle by the error found: each leaves less than a tenth.
const CORRECTIONS: usize = 2;
/// Greatest error that is corrected, rad.
const MAX_ENCODER_ERROR_RAD: f64 = 0.1;
/// Coefficients of Ω² cos θ and Ω² sin θ in the fit.
const ENCODER_TERMS: [usize; 2] = [5, 6];

/// Samples at the greatest magnitude of the log from which a window counts as saturated.
const MIN_SATURATED_SAMPLES: usize = 3;
/// Relative tolerance of that magnitude: both ends of a range differ by one code.
const SATURATION_TOLERANCE: f64 = 1e-4;
/// Windows whose residual exceeds this multiple of the median are left out: the acceleration changed within them.
const MAX_RESIDUAL_RATIO: f64 = 3.0;
/// Smallest residual taken as non-zero, rad: rounding.
const MIN_RESIDUAL_RAD: f64 = 1e-9;

/// Means over the windows of a step, with the angle of the encoder corrected by an error of these coefficients of cos and sin, rad.
fn windows(step: &Step, [c, s]: [f64; 2]) -> Vec<Window> {
    let log = &step.log;
    let (Some(shown), Some(x), Some(y)) = (log.column("theta_rad"), log.column("accel_x_m_s2"), log.column("accel_y_m_s2")) else {
        return Vec::new();
    };
    let theta: Vec<f64> = shown.iter().map(|shown| shown - c * shown.cos() - s * shown.sin()).collect();
    let greatest = x.iter().chain(y).copied().max_abs();
    let is_saturated = |rows: &Range<usize>| {
        let is = |column: &[f64]| {
            column[rows.clone()].iter().filter(|v| v.abs() >= greatest * (1.0 - SATURATION_TOLERANCE)).count() >= MIN_SATURATED_SAMPLES
        };
        greatest > 0.0 && (is(x) || is(y))
    };
    let t_s = log.t_s();
    let size = ((WINDOW_S / log.median_dt_s().max(1e-9)).round() as usize).max(8);
    let (mut found, mut scatters) = (Vec::new(), Vec::new());
    for segment in log.segments() {
        for from in segment.clone().step_by(size).filter(|from| from + size <= segment.end) {
            let rows = from..from + size;
            if is_saturated(&rows) {
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
                // Mean of a linearly changing rate squared.
                square: rate * rate + (acceleration * length_s).powi(2) / 12.0,
                rate,
                acceleration,
                cluster: 0,
                cos: mean(&|k| theta[k].cos()),
                sin: mean(&|k| theta[k].sin()),
                x: mean(&|k| x[k]),
                y: mean(&|k| y[k]),
            });
        }
    }
    let limit = MAX_RESIDUAL_RATIO * median(scatters.iter().copied()).unwrap_or(0.0).max(MIN_RESIDUAL_RAD);
    found.into_iter().zip(scatters).filter(|(_, scatter)| *scatter <= limit).map(|(window, _)| window).collect()
}

/// Fits of both axes at one radius.
struct AtRadius {
    radius_m: f64,
    x: LeastSquares,
    y: LeastSquares,
    /// Coefficients of the encoder's error by which its angle is corrected, rad.
    corrected_rad: [f64; 2],
}

impl AtRadius {
    /// Coefficients of the encoder's error that the fits still see, by both axes, with their standard uncertainties, rad; `None` where the
    /// fits do not have them.
    ///
    /// θ′² = φ′² (1 + 2 c sin φ − 2 s cos φ) and θ″ = φ″ + φ′² (c cos φ + s sin φ) to first order give f_x = … + φ′² ((2 s C + c S) cos φ +
    /// (s S − 2 c C) sin φ), f_y = … + φ′² ((c C − 2 s S) cos φ + (2 c S + s C) sin φ), with C and S = scale × radius × cos χ and sin χ.
    fn encoder(&self) -> Option<[(f64, f64); 2]> {
        if self.x.coefficients.len() <= ENCODER_TERMS[1] {
            return None;
        }
        let [(c, _), (s, _)] = self.effective();
        let equations = [(&self.x, [[s, 2.0 * c], [-2.0 * c, s]]), (&self.y, [[c, -2.0 * s], [2.0 * s, c]])];
        let (mut normal, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
        for (fit, rows) in equations {
            for (term, row) in ENCODER_TERMS.into_iter().zip(rows) {
                let weight = fit.sigma(term).powi(-2);
                for i in 0..2 {
                    right[i] += weight * row[i] * fit.coefficients[term];
                    (0..2).for_each(|j| normal[i][j] += weight * row[i] * row[j]);
                }
            }
        }
        let determinant = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
        let values = [
            (normal[1][1] * right[0] - normal[0][1] * right[1]) / determinant,
            (normal[0][0] * right[1] - normal[1][0] * right[0]) / determinant,
        ];
        let u = [(normal[1][1] / determinant).sqrt(), (normal[0][0] / determinant).sqrt()];
        (determinant.is_finite() && determinant > 0.0).then_some([(values[0], u[0]), (values[1], u[1])])
    }

    /// Scale × radius × (cos χ, sin χ), each with its standard uncertainty: weighted mean of both axes.
    fn effective(&self) -> [(f64, f64); 2] {
        let weighted_mean = |a: (f64, f64), b: (f64, f64)| {
            let (wa, wb) = (a.1.powi(-2), b.1.powi(-2));
            ((a.0 * wa + b.0 * wb) / (wa + wb), (wa + wb).powf(-0.5))
        };
        let of = |fit: &LeastSquares, k: usize, sign: f64| (sign * fit.coefficients[k], fit.sigma(k));
        [weighted_mean(of(&self.x, 1, -1.0), of(&self.y, 2, 1.0)), weighted_mean(of(&self.y, 1, 1.0), of(&self.x, 2, 1.0))]
    }

    /// Scale × radius and its standard uncertainty.
    fn product(&self) -> (f64, f64) {
        let [(c, uc), (s, us)] = self.effective();
        let size = c.hypot(s);
        (size, (c * uc).hypot(s * us) / size.max(f64::MIN_POSITIVE))
    }
}

fn at_radius(steps: &[&Step]) -> Option<AtRadius> {
    // Gravity is periodic in the angle, so all steps must have the same zero: the index, or none of them.
    let has_index = steps.iter().any(|step| step.log.theta_zero_is_index());
    let from_one_zero: Vec<&Step> = steps.iter().copied().filter(|step| step.log.theta_zero_is_index() == has_index).collect();
    let radius_m = steps.first()?.mounting.radius_m;
    let with = |corrected_rad: [f64; 2]| {
        let mut all: Vec<Window> = from_one_zero.iter().flat_map(|step| windows(step, corrected_rad)).collect();
        let count = all.len().max(1);
        all.iter_mut().enumerate().for_each(|(k, window)| window.cluster = k * CLUSTERS / count);
        all
    };
    let all = with([0.0; 2]);
    // Without the index the zero of each log is another one.
    if (has_index || steps.len() == 1)
        && separates_encoder(&all)
        && let Some(mut found) = fits(&all, radius_m, [0.0; 2], true)
    {
        for _ in 0..CORRECTIONS {
            let Some([(c, _), (s, _)]) = found.encoder() else { break };
            let corrected_rad = [found.corrected_rad[0] + c, found.corrected_rad[1] + s];
            let size_rad = corrected_rad[0].hypot(corrected_rad[1]);
            if size_rad.is_nan() || size_rad > MAX_ENCODER_ERROR_RAD {
                break;
            }
            found = fits(&with(corrected_rad), radius_m, corrected_rad, true)?;
        }
        return Some(found);
    }
    fits(&all, radius_m, [0.0; 2], false)
}

/// Fits of both axes, with or without the terms of the encoder.
fn fits(all: &[Window], radius_m: f64, corrected_rad: [f64; 2], encoder: bool) -> Option<AtRadius> {
    let fit = |of: fn(&Window) -> f64| weighted(all, &all.iter().map(of).collect::<Vec<_>>(), encoder);
    Some(AtRadius { radius_m, x: fit(|w| w.x)?, y: fit(|w| w.y)?, corrected_rad })
}

/// The windows have both senses of rotation, and different rates.
fn separates_encoder(all: &[Window]) -> bool {
    let total: f64 = all.iter().map(|w| w.square).sum();
    let forward: f64 = all.iter().filter(|w| w.rate > 0.0).map(|w| w.square).sum();
    let squares: f64 = all.iter().map(|w| w.square * w.square).sum();
    let mean = squares / total;
    let spread = (all.iter().map(|w| w.square * (w.square - mean).powi(2)).sum::<f64>() / total).sqrt();
    let fraction = (forward / total).min(1.0 - forward / total);
    fraction >= MIN_SENSE_FRACTION && spread >= MIN_RELATIVE_SPREAD * mean
}

/// Fit of one axis, weighted by the scatter of windows of similar acceleration; with or without the terms of the encoder.
fn weighted(all: &[Window], y: &[f64], encoder: bool) -> Option<LeastSquares> {
    let row = |w: &Window| {
        let mut row = vec![1.0, w.square, w.acceleration, w.cos, w.sin];
        if encoder {
            row.extend([w.square * w.cos, w.square * w.sin]);
        }
        row
    };
    let rows: Vec<Vec<f64>> = all.iter().map(row).collect();
    let clusters: Vec<usize> = all.iter().map(|w| w.cluster).collect();
    let classes: Vec<usize> =
        all.iter().map(|w| ACCELERATION_CLASSES.iter().filter(|limit| w.acceleration.abs() > **limit).count()).collect();
    let mut fit = least_squares(&rows, y)?;
    for _ in 0..WEIGHTINGS {
        let overall = fit.residuals.iter().map(|r| r * r).sum::<f64>() / y.len() as f64;
        let variance: Vec<f64> = (0..=ACCELERATION_CLASSES.len())
            .map(|class| {
                let squares: Vec<f64> = classes.iter().zip(&fit.residuals).filter(|(c, _)| **c == class).map(|(_, r)| r * r).collect();
                let is_large = squares.len() >= MIN_CLASS_WINDOWS;
                if is_large { squares.iter().sum::<f64>() / squares.len() as f64 } else { overall }.max(f64::MIN_POSITIVE)
            })
            .collect();
        let weights: Vec<f64> = classes.iter().map(|class| 1.0 / variance[*class]).collect();
        fit = clustered_least_squares(&rows, y, &weights, &clusters)?;
    }
    Some(fit)
}

/// Calibrates the accelerometer from the steps of a session.
///
/// # Errors
/// No log has the columns; the platform hardly turned.
pub fn calibrate(steps: &[Step], session: &Session) -> Result<Findings, CalibrateError> {
    let has = |s: &&Step| s.log.column("accel_x_m_s2").is_some() && s.log.column("accel_y_m_s2").is_some();
    let used: Vec<&Step> = steps.iter().filter(has).collect();
    let Some(first) = used.first() else {
        return Err(CalibrateError::AccelColumns);
    };
    let near_m = first.mounting.radius_m;
    let of_radius = |radius: f64| used.iter().copied().filter(|s| s.mounting.radius_m == radius).collect::<Vec<_>>();
    let near = at_radius(&of_radius(near_m)).ok_or(CalibrateError::HardlyTurned)?;
    let far = used.iter().map(|s| s.mounting.radius_m).find(|r| *r != near_m).and_then(|radius| at_radius(&of_radius(radius)));
    let mut findings = Findings::default();
    let (product, u) = near.product();
    if product.is_nan() || product <= 5.0 * u {
        return Err(CalibrateError::HardlyTurned);
    }
    let radius_error_m = session.assumptions.radius_error_m;
    let scatter = |u: f64, fit: &LeastSquares| Contribution::type_a("noise", u, fit.dof, Basis::WindowScatter { window_s: WINDOW_S });
    // The centripetal force is that of the square of the rate.
    let clock = |value: f64| crystal::clock(&session.assumptions, -2.0 * value);
    match far {
        Some(far) => {
            let (other, other_u) = far.product();
            let apart_m = far.radius_m - near_m;
            let scale = (other - product) / apart_m;
            let basis = Basis::RadiusHalfWidth { half_width_m: radius_error_m };
            let mut contributions = vec![
                scatter(u / apart_m.abs(), &near.x),
                scatter(other_u / apart_m.abs(), &far.x),
                Contribution::rectangular("near radius", radius_error_m, "m", scale / apart_m, basis.clone()),
                Contribution::rectangular("far radius", radius_error_m, "m", scale / apart_m, basis),
            ];
            // The error of the clock is that of the products too: it cancels in the radius.
            let scale_u = Quantity::new("scale", "1", scale, contributions.clone()).combined_u();
            contributions.push(clock(scale));
            findings.quantities.push(Quantity::new("scale", "1", scale, contributions).meaning(Meaning::ScaleByTwoRadii));
            let contributions = vec![
                scatter(u / scale, &near.x),
                Contribution::type_b("scale", scale_u, "1", product / scale / scale, Basis::ScaleByTwoRadii),
            ];
            findings.quantities.push(Quantity::new("radius_m", "m", product / scale, contributions).meaning(Meaning::ElementRadius));
        }
        None => {
            let basis = Basis::AssumedRadius { radius_m: near_m, half_width_m: radius_error_m };
            let contributions = vec![
                scatter(u / near_m, &near.x),
                Contribution::rectangular("radius", radius_error_m, "m", product / near_m / near_m, basis),
                clock(product / near_m),
            ];
            findings.quantities.push(Quantity::new("scale", "1", product / near_m, contributions).meaning(Meaning::ScaleAtGivenRadius));
            let percent = session.assumptions.scale_percent;
            let basis = Basis::AssumedScale { half_width_percent: percent };
            let contributions =
                vec![scatter(u, &near.x), Contribution::rectangular("scale", percent / 100.0, "1", product, basis), clock(product)];
            let q = Quantity::new("radius_m", "m", product, contributions).meaning(Meaning::RadiusAtUnitScale);
            findings.quantities.push(q);
        }
    }
    let [(c, uc), (s, us)] = near.effective();
    let angle_u = (s * uc).hypot(c * us) / (c * c + s * s);
    let mut angle = vec![scatter(angle_u.to_degrees(), &near.x)];
    if let Some([(_, cosine_u), (_, sine_u)]) = near.encoder() {
        // What is left of the encoder's error turns the angle by itself at most.
        let (u, dof) = (cosine_u.hypot(sine_u).to_degrees(), near.x.dof.min(near.y.dof));
        angle.push(Contribution::type_a("encoder", u, dof, Basis::WindowScatter { window_s: WINDOW_S }));
    }
    findings.quantities.push(Quantity::new("angle_deg", "°", s.atan2(c).to_degrees(), angle).meaning(Meaning::MountingAngle));
    for (name, fit) in [("bias_x_m_s2", &near.x), ("bias_y_m_s2", &near.y)] {
        findings
            .quantities
            .push(Quantity::new(name, "m/s²", fit.coefficients[0], vec![scatter(fit.sigma(0), fit)]).meaning(Meaning::AccelerometerBias));
    }
    add_encoder(&near, &mut findings);
    add_blind_rate(&near, product, &mut findings);
    compare_rate_readings(&of_radius(near_m), product, near.x.coefficients[0], session, &mut findings);
    Ok(findings)
}

/// Adds the error of the encoder of harmonic order 1.
fn add_encoder(near: &AtRadius, findings: &mut Findings) {
    let names = ["encoder_cosine_rad", "encoder_sine_rad"];
    let Some(left) = near.encoder() else {
        return names.into_iter().for_each(|name| findings.add_absent(name, AbsenceReason::NeedsBothSensesAtRates));
    };
    let dof = near.x.dof.min(near.y.dof);
    for ((name, (left, u)), corrected) in names.into_iter().zip(left).zip(near.corrected_rad) {
        let noise = Contribution::type_a("noise", u, dof, Basis::WindowScatter { window_s: WINDOW_S });
        findings.quantities.push(Quantity::new(name, "rad", corrected + left, vec![noise]).meaning(Meaning::EncoderEccentricityByForce));
    }
}

/// Error of the rate |Ω| = √(f/r) by a small error of the specific force f: f/(2 Ω r), rad/s.
fn rate_error(force_m_s2: f64, rate_rad_s: f64, radius_m: f64) -> f64 {
    force_m_s2 / (2.0 * rate_rad_s.abs() * radius_m)
}

/// Adds the rate below which an error f of the specific force makes a rate error f/(2 Ω r) greater than the rate itself: √(f/(2 r)).
fn add_blind_rate(near: &AtRadius, product: f64, findings: &mut Findings) {
    let windows = near.x.residuals.len() as f64;
    let scatter = (near.x.residuals.iter().map(|r| r * r).sum::<f64>() / windows).sqrt();
    let value = (scatter.hypot(near.x.sigma(0)) / (2.0 * product)).sqrt();
    let contribution = Contribution::type_a("noise", value / (8.0 * windows).sqrt(), windows, Basis::OneWindow);
    findings
        .quantities
        .push(Quantity::new("blind_below_rad_s", "rad/s", value, vec![contribution]).meaning(Meaning::BlindRate { window_s: WINDOW_S }));
    findings.remarks.push(Remark::SquareOfRate);
}

/// Adds the rates of all sensors at the plateaus of one run and their weighted combination. Weights follow from scatter and from the
/// deviation from the encoder.
fn compare_rate_readings(steps: &[&Step], product: f64, bias: f64, session: &Session, findings: &mut Findings) {
    let Some((log, found)) = steps
        .iter()
        .map(|s| (&s.log, plateaus(&s.log, "rate_cmd_rad_s", session.settle_s)))
        .max_by(|a, b| greatest_rate(&a.1).total_cmp(&greatest_rate(&b.1)))
        .filter(|(_, found)| found.len() >= 6)
    else {
        return;
    };
    let column = |name: &str| log.column(name);
    let moving: Vec<&Plateau> = found.iter().filter(|p| p.rate_rad_s != 0.0).collect();
    let mut readings: Vec<(SeriesKind, Vec<(f64, f64)>)> = Vec::new();
    // Standard uncertainty of a plateau mean by the scatter of means over tenths of the plateau.
    let u_of = |values: &[f64], rows: &Range<usize>| {
        let tenths: Vec<f64> = (0..10)
            .map(|k| rows.start + k * rows.len() / 10..rows.start + (k + 1) * rows.len() / 10)
            .map(|r| values[r.clone()].iter().sum::<f64>() / r.len().max(1) as f64)
            .collect();
        let mean = tenths.iter().sum::<f64>() / 10.0;
        (tenths.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / 90.0).sqrt()
    };
    let mut weighted: Vec<Vec<(f64, f64)>> = vec![Vec::new(); moving.len()];
    let mut add_reading = |kind: SeriesKind, rates: Vec<(f64, f64)>| {
        // The rms deviation over all plateaus adds to the scatter: it contains the nonlinearity of the sensor.
        let deviation =
            moving.iter().zip(&rates).map(|(p, (rate, _))| (rate - p.rate_rad_s).powi(2)).sum::<f64>() / rates.len().max(1) as f64;
        for (k, (rate, u)) in rates.iter().enumerate() {
            weighted[k].push((*rate, u.hypot(deviation.sqrt())));
        }
        readings.push((kind, moving.iter().zip(&rates).map(|(p, (rate, _))| (p.rate_rad_s, rate - p.rate_rad_s)).collect()));
    };
    if let Some(gyro) = column("gyro_rad_s") {
        let rows: Vec<Vec<f64>> = found.iter().map(|p| vec![1.0, p.rate_rad_s]).collect();
        if let Some(fit) = least_squares(&rows, &found.iter().map(|p| p.mean(gyro)).collect::<Vec<_>>()) {
            let [b, s] = [fit.coefficients[0], fit.coefficients[1]];
            add_reading(SeriesKind::RateGyro, moving.iter().map(|p| ((p.mean(gyro) - b) / s, u_of(gyro, &p.rows) / s.abs())).collect());
        }
    }
    if let Some(x) = column("accel_x_m_s2") {
        let rate = |p: &Plateau| {
            let size = ((bias - p.mean(x)) / product).max(0.0).sqrt();
            (size.copysign(p.rate_rad_s), rate_error(u_of(x, &p.rows), size.max(1e-3), product))
        };
        add_reading(SeriesKind::Accelerometer, moving.iter().map(|p| rate(p)).collect());
    }
    if let (Some(u_V), Some(i_A)) = (column("u_V"), column("i_A")) {
        // u = R i + K Ω + V sign Ω, with all coefficients fitted to this run.
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
            add_reading(SeriesKind::BackEmf, moving.iter().map(|p| rate(p)).collect());
        }
    }
    let combined: Vec<(f64, f64)> = moving
        .iter()
        .zip(&weighted)
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
    let contribution = Contribution::type_a("number of plateaus", u_of_standard_deviation(rms, n), n, Basis::OfStandardDeviation);
    findings.quantities.push(Quantity::new("combined_rms_rad_s", "rad/s", rms, vec![contribution]).meaning(Meaning::CombinedRate));
    findings.curves.push(Curve { other_series: readings, ..Curve::new(CurveKind::RateReadings, combined, Vec::new()) });
}

fn greatest_rate(found: &[Plateau]) -> f64 {
    found.iter().map(|p| p.rate_rad_s.abs()).max_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Mounting;
    use hal_sim::peripherals::Noise;
    use identification::log::{Column, Log};

    /// A platform that accelerates to 20 rad/s by 5 rad/s² and decelerates again, with the forces of docs/theory.md §4 at this radius and
    /// angle.
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
        Step { name: "up".into(), log, mounting: Mounting { radius_m, ..Mounting::default() }, added_inertia_kg_m2: None }
    }

    #[test]
    fn radius_and_angle_are_recovered() {
        for (radius_m, chi_deg) in [(0.05, 2.0_f64), (0.03, -1.5), (0.08, 0.0)] {
            let step = step(radius_m, chi_deg.to_radians());
            let found = at_radius(&[&step]).unwrap();
            let [(c, _), (s, _)] = found.effective();
            // (Ω′ times the window length)²/12 in the mean of Ω² is constant and goes into the bias.
            assert!((found.product().0 / radius_m - 1.0).abs() < 1e-6, "{}", found.product().0);
            assert!((s.atan2(c).to_degrees() - chi_deg).abs() < 1e-4, "{}", s.atan2(c).to_degrees());
        }
    }

    /// Two staircases of both senses and a run to and fro, on a stand tilted by 0.5°, whose encoder shows θ + c cos θ + s sin θ.
    fn turning([c, s]: [f64; 2], seed: u64) -> Step {
        let mut noise = [0, 1].map(|stream| Noise::new(seed, stream, 0.02));
        let levels = [0.0, 6.0, 12.0, 18.0, 12.0, 6.0, -6.0, -12.0, -18.0, -12.0, -6.0, 0.0];
        let setpoint = |t: f64| if t < 24.0 { levels[(t / 2.0) as usize] } else { 8.0 * (std::f64::consts::TAU * (t - 24.0)).sin() };
        let (radius_m, chi_rad, dt_s) = (0.05, 2_f64.to_radians(), 1e-3);
        let (mut theta, mut rate) = (0.3, 0.0);
        let mut columns = [Vec::new(), Vec::new(), Vec::new(), Vec::new()];
        for k in 0..34_000 {
            let t = f64::from(k) * dt_s;
            let acceleration = ((setpoint(t) - rate) / 0.02).clamp(-60.0, 60.0);
            let (outward, along) = (-rate * rate * radius_m, acceleration * radius_m);
            let (sin, cos) = chi_rad.sin_cos();
            let lean = 9.81 * 0.5_f64.to_radians();
            let x = outward * cos + along * sin + lean * f64::cos(theta + chi_rad) + 0.1 + noise[0].draw();
            let y = along * cos - outward * sin - lean * f64::sin(theta + chi_rad) - 0.2 + noise[1].draw();
            let shown = theta + c * f64::cos(theta) + s * f64::sin(theta);
            columns.iter_mut().zip([t, shown, x, y]).for_each(|(column, value)| column.push(value));
            theta += rate * dt_s + 0.5 * acceleration * dt_s * dt_s;
            rate += acceleration * dt_s;
        }
        let names = ["t_s", "theta_rad", "accel_x_m_s2", "accel_y_m_s2"];
        let columns = names.into_iter().zip(columns).map(|(name, values)| Column { name: name.into(), values }).collect();
        let log = Log::new("x.csv", columns, Vec::new()).unwrap();
        Step { name: "turning".into(), log, mounting: Mounting { radius_m, ..Mounting::default() }, added_inertia_kg_m2: None }
    }

    /// Product of scale and radius, angle, and both biases, each minus its true value, over its standard uncertainty.
    fn errors(found: &AtRadius) -> [f64; 4] {
        let (product, u) = found.product();
        let [(c, uc), (s, us)] = found.effective();
        let angle_u = (s * uc).hypot(c * us) / (c * c + s * s);
        [
            (product - 0.05) / u,
            (s.atan2(c) - 2_f64.to_radians()) / angle_u,
            (found.x.coefficients[0] - 0.1) / found.x.sigma(0),
            (found.y.coefficients[0] + 0.2) / found.y.sigma(0),
        ]
    }

    #[test]
    fn an_eccentric_encoder_is_found_and_corrected() {
        let error = [3e-3, -4e-3];
        let (mut before, mut after, mut found_inside) = ([0; 4], [0; 4], 0);
        for seed in 0..20 {
            let step = turning(error, seed);
            let found = at_radius(&[&step]).unwrap();
            let without = fits(&windows_in_clusters(&step), 0.05, [0.0; 2], false).unwrap();
            let inside = |errors: [f64; 4]| errors.map(|e| i32::from(e.abs() <= 2.02));
            (0..4).for_each(|k| before[k] += inside(errors(&without))[k]);
            (0..4).for_each(|k| after[k] += inside(errors(&found))[k]);
            for ((left, u), (corrected, truth)) in found.encoder().unwrap().into_iter().zip(found.corrected_rad.into_iter().zip(error)) {
                found_inside += i32::from((corrected + left - truth).abs() <= 2.02 * u);
                assert!(u < 1e-3, "{u}");
            }
        }
        println!("inside U without the terms {before:?}, with them {after:?}, encoder {found_inside} of 40");
        // 95 % of 20 and of 40 less three standard errors.
        assert!(after.iter().all(|n| *n >= 16) && found_inside >= 33, "{after:?} {found_inside}");
        assert!(before.iter().any(|n| *n <= 5), "{before:?}");
    }

    /// The windows as in a calibration, without a correction.
    fn windows_in_clusters(step: &Step) -> Vec<Window> {
        let mut all = windows(step, [0.0; 2]);
        let count = all.len();
        all.iter_mut().enumerate().for_each(|(k, window)| window.cluster = k * CLUSTERS / count);
        all
    }

    #[test]
    fn an_exact_encoder_changes_nothing_beyond_the_uncertainty() {
        let mut outside = 0;
        for seed in 0..5 {
            let step = turning([0.0; 2], seed);
            let (found, without) = (at_radius(&[&step]).unwrap(), fits(&windows_in_clusters(&step), 0.05, [0.0; 2], false).unwrap());
            let ((product, u), (before, _)) = (found.product(), without.product());
            assert!(found.corrected_rad.iter().all(|e| e.abs() < 1e-3), "{:?}", found.corrected_rad);
            let changes = [
                (product - before) / u,
                (found.x.coefficients[0] - without.x.coefficients[0]) / found.x.sigma(0),
                (found.y.coefficients[0] - without.y.coefficients[0]) / found.y.sigma(0),
            ];
            // U with k = 2.02 of 41 degrees of freedom.
            outside += changes.iter().filter(|change| change.abs() > 2.02).count();
        }
        // 5 % of 15 are 0.75 if the change were as uncertain as the value, which it is less.
        assert!(outside <= 2, "{outside}");
    }

    /// One sense of rotation does not separate the delay of the samples from the encoder: the step of the other tests.
    #[test]
    fn one_sense_has_no_terms_of_the_encoder() {
        assert!(at_radius(&[&step(0.05, 0.0)]).unwrap().encoder().is_none());
    }

    #[test]
    fn rate_error_of_one_milli_g() {
        let mg = 9.806_65e-3;
        assert!((rate_error(mg, 1.0, 0.05) - 0.098_066_5).abs() < 1e-12);
        assert!((rate_error(mg, -10.0, 0.05) - 0.009_806_65).abs() < 1e-12);
    }
}
