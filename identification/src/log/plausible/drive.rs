//! Signs of voltage, current and torque relative to the motion.
//!
//! Regressions on means over short windows, which are insensitive to conventions of half a row: u = R i + K ω for the winding, K i = J ω' +
//! friction for the rotor. Only signs are judged, and only significant ones. On a flexible shaft the motor's rate is ω + c ω'', and above
//! the resonance it opposes the measured one; the second derivative is therefore in both regressions. A log of one oscillation alone then
//! determines no sign.

use super::Defect;
use super::regress::{Regression, regress};
use super::windows::Windows;
use crate::log::Log;
use crate::statistics::Extremes;

/// Window lengths that are tried, s. Used is the valid regression with the most significant first coefficient.
const WINDOWS_S: [f64; 3] = [0.03, 0.1, 0.3];
/// Least partial correlation of a significant coefficient.
const MIN_PARTIAL_CORRELATION: f64 = 0.5;
/// Least ratio of a significant coefficient to its standard error.
const MIN_SIGMAS: f64 = 10.0;
/// Least explained fraction of the variance for a valid regression.
const MIN_EXPLAINED_FRACTION: f64 = 0.5;
/// Number of parts of the log; no sign may depend on one part alone.
const PARTS: usize = 4;

/// A defect of the drive's signs.
pub(super) fn check(log: &Log) -> Option<Defect> {
    let u = log.column("u_V");
    let i = log.column("i_A");
    let acceleration = |column: &str| log.column(column).and_then(|c| best(|length_s| mechanical(log, c, length_s)));
    if let (Some(u), Some(i)) = (u, i)
        && let Some(winding) = best(|length_s| electrical(log, u, i, length_s))
    {
        let (resistance, constant) = (sign(&winding, 0), sign(&winding, 1));
        let current = acceleration("i_A").map_or(0, |m| sign(&m, 0));
        match (resistance, constant, current) {
            (1, -1, -1) => return Some(Defect::ReversedDrive),
            (1, -1, _) => return Some(Defect::ExchangedVoltageAndCurrent),
            (-1, 1, _) => return Some(Defect::ReversedCurrent),
            (-1, -1, _) => return Some(Defect::ReversedVoltage),
            _ => {}
        }
    }
    for column in ["torque_N_m", "i_A"] {
        if acceleration(column).is_some_and(|m| sign(&m, 0) < 0) {
            return Some(Defect::ReversedAcceleration { column });
        }
    }
    if i.is_none() && u.is_some() {
        let voltage = acceleration("u_V")?;
        let (by_acceleration, by_rate) = (sign(&voltage, 0), sign(&voltage, 1));
        if by_acceleration.min(by_rate) < 0 && by_acceleration.max(by_rate) <= 0 {
            return Some(Defect::ReversedAcceleration { column: "u_V" });
        }
    }
    None
}

/// Sign of a coefficient: ±1 if significant, else 0.
fn sign<const K: usize>(fit: &Regression<K>, k: usize) -> i32 {
    let significant = fit.partial[k].abs() > MIN_PARTIAL_CORRELATION && fit.slope[k].abs() > MIN_SIGMAS * fit.sigma[k];
    if significant { fit.slope[k].signum() as i32 } else { 0 }
}

/// The valid regression with the most significant first coefficient.
fn best<const K: usize>(fit: impl Fn(f64) -> Option<Regression<K>>) -> Option<Regression<K>> {
    let significance = |f: &Regression<K>| f.slope[0].abs() / f.sigma[0].max(f64::MIN_POSITIVE);
    WINDOWS_S
        .into_iter()
        .filter_map(fit)
        .filter(|f| f.explained > MIN_EXPLAINED_FRACTION)
        .max_by(|a, b| significance(a).total_cmp(&significance(b)))
}

/// Regression over all rows. A column that is reversed is so in the whole log. A coefficient whose sign changes when one part of the log is
/// left out is therefore marked as not significant: a coupling that slips once can reverse the sign that the whole log gives.
fn throughout<const K: usize>(x: [&[f64]; K], y: &[f64]) -> Option<Regression<K>> {
    let mut all = regress(x, y)?;
    for part in 0..PARTS {
        let left_out = part * y.len() / PARTS..(part + 1) * y.len() / PARTS;
        let without = |column: &[f64]| [&column[..left_out.start], &column[left_out.end..]].concat();
        let columns = x.map(without);
        let Some(others) = regress::<K>(std::array::from_fn(|k| columns[k].as_slice()), &without(y)) else { continue };
        for k in (0..K).filter(|&k| others.slope[k] * all.slope[k] < 0.0) {
            all.partial[k] = 0.0;
        }
    }
    Some(all)
}

/// Regression of u on i, ω and ω''.
fn electrical(log: &Log, u: &[f64], i: &[f64], length_s: f64) -> Option<Regression<3>> {
    let windows = Windows::of_length(log, length_s);
    let omega = rates(log, &windows)?;
    let (u, i) = (windows.means(u), windows.means(i));
    let mut rows: [Vec<f64>; 4] = Default::default();
    for k in windows.centres(1) {
        let values = [i[k], omega[k], omega[k + 1] - 2.0 * omega[k] + omega[k - 1], u[k]];
        rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
    }
    let [i, rate, curvature, u] = rows;
    throughout([&i, &rate, &curvature], &u)
}

/// Regression of a drive column on ω', ω, sign ω, θ and ω'''.
fn mechanical(log: &Log, drive: &[f64], length_s: f64) -> Option<Regression<5>> {
    let windows = Windows::of_length(log, length_s);
    let omega = rates(log, &windows)?;
    let drive = windows.means(drive);
    let largest_rate = omega.iter().copied().max_abs();
    let theta = log.column("theta_rad").map(|theta| windows.means(theta));
    let mut rows: [Vec<f64>; 6] = Default::default();
    for k in windows.centres(2) {
        let values = [
            omega[k + 1] - omega[k - 1],
            omega[k],
            (omega[k] / (0.02 * largest_rate)).tanh(),
            theta.as_ref().map_or(0.0, |t| t[k]),
            omega[k + 2] - 2.0 * omega[k + 1] + 2.0 * omega[k - 1] - omega[k - 2],
            drive[k],
        ];
        rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
    }
    let [acceleration, rate, direction, angle, third, drive] = rows;
    throughout([&acceleration, &rate, &direction, &angle, &third], &drive)
}

/// Mean rate in each window: from the angle if it is measured, else from the rate.
fn rates(log: &Log, windows: &Windows) -> Option<Vec<f64>> {
    if let Some(theta) = log.column("theta_rad") {
        let t_s = windows.differences(log.t_s());
        return Some(windows.differences(theta).iter().zip(t_s).map(|(turned, t)| turned / t).collect());
    }
    Some(windows.means(log.column("omega_rad_s")?))
}
