//! Students of the works on gyro, accelerometer and drift.

use std::f64::consts::TAU;
use std::path::Path;

use identification::log::Log;

use super::Values;
use super::regression::{Fit, expanded, mean, sigma_of_mean};

/// Rate and means of columns over a level of 2.5 s without its first 0.5 s, cut to whole turns where there is one.
fn levels(log: &Log, columns: &[&str]) -> Vec<Vec<f64>> {
    const DWELL_S: f64 = 2.5;
    let (t_s, theta) = (log.t_s(), log.column("theta_rad").unwrap());
    let columns: Vec<&[f64]> = columns.iter().map(|name| log.column(name).unwrap()).collect();
    let at = |t: f64| t_s.partition_point(|row| *row < t_s[0] + t - 1e-9);
    let count = ((t_s[t_s.len() - 1] - t_s[0]) / DWELL_S + 0.1) as usize;
    let level = |k: usize| {
        let (from, end) = (at(DWELL_S * k as f64 + 0.5), (at(DWELL_S * (k as f64 + 1.0)) - 2).min(t_s.len() - 1));
        let turns = ((theta[end] - theta[from]).abs() / TAU).floor();
        let to = if turns < 1.0 { end } else { (from..end).rev().find(|to| (theta[*to] - theta[from]).abs() <= turns * TAU).unwrap() };
        let rate = (theta[to] - theta[from]) / (t_s[to] - t_s[from]);
        std::iter::once(rate).chain(columns.iter().map(|column| mean(&column[from..to]))).collect()
    };
    (0..count).map(level).collect()
}

/// Work 4: mean at rest in blocks of 10 s, cubic curve through the levels.
pub fn gyro(logs: &Path) -> Values {
    const FULL_SCALE: f64 = 10.0;
    const EARTH: f64 = 7.292e-5;
    const CRYSTAL: f64 = 50e-6;
    let rest = Log::read(logs.join("01-rest.parquet")).unwrap();
    let blocks: Vec<f64> = rest.column("gyro_rad_s").unwrap().chunks_exact(10_000).map(mean).collect();
    let staircase = levels(&Log::read(logs.join("02-staircase.parquet")).unwrap(), &["gyro_rad_s"]);
    let rows: Vec<Vec<f64>> = staircase.iter().map(|l| vec![1.0, l[0], l[0].powi(2), l[0].powi(3)]).collect();
    let fit = Fit::of(&rows, &staircase.iter().map(|l| l[1]).collect::<Vec<_>>());
    let [_, slope, quadratic, cubic] = fit.found[..] else { panic!("four coefficients") };
    let misalignment = 0.5_f64.to_radians();
    let in_line = 0.6 * FULL_SCALE * FULL_SCALE;
    let scale = (slope + in_line * cubic) * (1.0 + misalignment.powi(2) / 6.0);
    // The cosine of the angle is no rectangle; its standard uncertainty as that of one.
    let scale_u = expanded(&[CRYSTAL, 0.149 * misalignment.powi(2) * 3_f64.sqrt()], fit.sigma_of(&[0.0, 1.0, 0.0, in_line]));
    let (by_square, by_cube) = (100.0 * 2.0 / 3.0 * FULL_SCALE / slope, 100.0 * 0.4 * FULL_SCALE * FULL_SCALE / slope);
    let nonlinearity = by_square * quadratic.abs() + by_cube * cubic.abs();
    let scatter = fit.sigma_of(&[0.0, 0.0, by_square * quadratic.signum(), by_cube * cubic.signum()]);
    let acceleration = by_square * 0.1_f64.to_radians() * 0.05 / 9.806_65;
    [
        ("bias_rad_s", mean(&blocks), expanded(&[EARTH], sigma_of_mean(&blocks))),
        ("scale", scale, scale_u),
        ("nonlinearity_percent_fs", nonlinearity, expanded(&[acceleration], scatter)),
    ]
    .map(|(name, value, u)| (name.to_owned(), (value, u)))
    .into()
}

/// Work 5: lines of both axes over ω² at two radii whose error is common.
pub fn accelerometer(logs: &Path) -> Values {
    /// Distance of the holes, m, with the half-width of its last digit.
    const HOLES: (f64, f64) = (0.02, 0.005e-3);
    const CRYSTAL: f64 = 50e-6;
    let lines = ["01-outer.parquet", "03-inner.parquet"].map(|name| {
        let levels = levels(&Log::read(logs.join(name)).unwrap(), &["accel_x_m_s2", "accel_y_m_s2"]);
        let rows: Vec<Vec<f64>> = levels.iter().map(|l| vec![l[0] * l[0], 1.0]).collect();
        let axis = |k: usize| {
            let fit = Fit::of(&rows, &levels.iter().map(|l| l[k]).collect::<Vec<_>>());
            (fit.found[0], fit.sigma(0))
        };
        let ((x, x_u), (y, y_u)) = (axis(1), axis(2));
        let product = x.hypot(y);
        // k r with its uncertainty, and the angle.
        (product, x_u.hypot(y_u), y.atan2(-x), x_u.hypot(y_u) / product)
    });
    let [outer, inner] = lines;
    let difference = outer.0 - inner.0;
    let scale = difference / HOLES.0;
    let scatter = outer.1.hypot(inner.1) / difference;
    let scale_u = expanded(&[HOLES.1 / HOLES.0, 2.0 * CRYSTAL], scatter);
    // Both radii have the same angle; weighted mean.
    let weights = [outer.3.powi(-2), inner.3.powi(-2)];
    let angle = (outer.2 * weights[0] + inner.2 * weights[1]) / (weights[0] + weights[1]);
    let angle_u = (weights[0] + weights[1]).sqrt().recip();
    let radius = outer.0 / scale;
    // r = h p/(p − q): ∂ ln r/∂p = −q/(p (p − q)), ∂ ln r/∂q = 1/(p − q).
    let radius_scatter = (outer.1 * inner.0 / outer.0).hypot(inner.1) / difference;
    let radius_u = expanded(&[HOLES.1 / HOLES.0], radius_scatter);
    [
        ("scale", scale, scale_u * scale),
        ("radius_m", radius, radius_u * radius),
        ("angle_deg", angle.to_degrees(), 2.0 * angle_u.to_degrees()),
    ]
    .map(|(name, value, u)| (name.to_owned(), (value, u)))
    .into()
}

/// Work 6: the drift of each cycle by the trapezoidal rule; a regression of the cycles and one of the five visits, of which the less
/// certain counts.
pub fn drift(logs: &Path) -> Values {
    const EARTH_DEG_H: f64 = 15.041;
    /// 97.5 % of Student's t: two degrees of freedom.
    const T_VISITS: f64 = 4.30;
    let log = Log::read_also(logs.join("drift.parquet"), &["angle_sensor_V", "torquer_A", "drift_mark", "turned_deg"]).unwrap();
    let note = |name: &str| log.notes().number(name).unwrap();
    let (gain, pulse_s, latitude) = (note("angle_gain_V_rad"), note("pulse_s"), note("latitude_deg").to_radians());
    let torquer_rad_s_A = note("torquer_gain_rad_s_A");
    let column = |name: &str| &log.columns().iter().find(|c| c.name == name).unwrap().values;
    let (t_s, angle, current) = (log.t_s(), column("angle_sensor_V"), column("torquer_A"));
    let (mark, turned) = (column("drift_mark"), column("turned_deg"));
    let integral = |from: f64, to: f64| {
        let rows = t_s.partition_point(|t| *t < from - 5e-4)..t_s.partition_point(|t| *t < to + 5e-4);
        rows.clone().zip(rows.skip(1)).map(|(a, b)| 0.5 * (angle[a] + angle[b]) * (t_s[b] - t_s[a])).sum::<f64>()
    };
    let (mut cycles, mut visit) = (Vec::new(), 0);
    for k in 1..t_s.len() {
        visit += usize::from(turned[k] != turned[k - 1]);
        if mark[k] % 4.0 == 1.0 && mark[k - 1] != mark[k] {
            let (start, middle, end) = (t_s[k], t_s[k] + pulse_s, t_s[k] + 2.0 * pulse_s);
            if end > t_s[t_s.len() - 1] {
                continue;
            }
            let difference = integral(start, middle) - integral(middle, end);
            // Unequal pulses leave half the sum of their rates: the mean current of both pulses beside that before the cycle.
            let row = |t: f64| t_s.partition_point(|row| *row < t - 5e-4);
            let unequal = mean(&current[k + 1..row(end) + 1]) - mean(&current[row(start - 0.4)..k]);
            let drift_deg_h = (-difference / (gain * pulse_s * pulse_s) - torquer_rad_s_A * unequal) * 206_264.806;
            let side = if turned[k] > 90.0 { -1.0 } else { 1.0 };
            let plateau = mean(&current[k + 1000..k + 4000]);
            cycles.push((middle, side, plateau, drift_deg_h, visit));
        }
    }
    let centre = mean(&cycles.iter().map(|c| c.0).collect::<Vec<_>>());
    let rows: Vec<Vec<f64>> = cycles.iter().map(|c| vec![1.0, c.1, c.0 - centre, c.2]).collect();
    let fit = Fit::of(&rows, &cycles.iter().map(|c| c.3).collect::<Vec<_>>());
    // Means of the visits without the part of the pulse's sign, weighted by their cycles.
    let (mut rows, mut values) = (Vec::new(), Vec::new());
    for visit in 0..=visit {
        let of: Vec<_> = cycles.iter().filter(|c| c.4 == visit).collect();
        let weight = (of.len() as f64).sqrt();
        rows.push(vec![weight, weight * of[0].1, weight * mean(&of.iter().map(|c| c.0 - centre).collect::<Vec<_>>())]);
        values.push(weight * mean(&of.iter().map(|c| c.3 - fit.found[3] * c.2).collect::<Vec<_>>()));
    }
    let visits = Fit::of(&rows, &values);
    assert_eq!(visits.dof, 2.0, "five visits");
    let u = |k: usize| (2.0 * fit.sigma(k)).max(T_VISITS * visits.sigma(k));
    let (own, apparent) = (fit.found[0], fit.found[1]);
    let horizontal = EARTH_DEG_H * latitude.cos();
    let azimuth = (-apparent / horizontal).acos();
    [
        ("own_drift_deg_h", own, u(0)),
        ("apparent_drift_deg_h", apparent, u(1)),
        ("azimuth_deg", azimuth.to_degrees(), (u(1) / (horizontal * azimuth.sin())).to_degrees()),
    ]
    .map(|(name, value, u)| (name.to_owned(), (value, u)))
    .into()
}
