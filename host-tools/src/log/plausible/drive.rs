//! Do voltage, current and torque drive the rotor the way it turns?
//!
//! Means over short windows, so that conventions of half a row do not matter: u = R i + K ω of the winding, and of the rotor
//! K i = J ω' + friction. Only signs are judged, and only where they are beyond doubt.

use super::regress::{Regression, regress};
use super::windows::Windows;
use super::{Code, Finding};
use crate::log::Log;
use crate::statistics::Extremes;

/// Window lengths that are tried, s; of those whose equation holds the one that is surest of its first coefficient is believed.
const WINDOWS_S: [f64; 3] = [0.03, 0.1, 0.3];
/// A sign is believed from this partial correlation and ratio to its standard error on.
const PARTIAL: f64 = 0.5;
const SIGMAS: f64 = 10.0;
/// An equation is believed where it explains this much.
const HOLDS: f64 = 0.5;

/// Findings about the drive's signs.
pub(super) fn check(log: &Log) -> Option<Finding> {
    let u = log.column("u_V");
    let i = log.column("i_A");
    let accelerates = |column: &str| log.column(column).and_then(|c| best(|length_s| mechanical(log, c, length_s)));
    if let (Some(u), Some(i)) = (u, i)
        && let Some(winding) = best(|length_s| electrical(log, u, i, length_s))
    {
        let (resistance, constant) = (sign(&winding, 0), sign(&winding, 1));
        let current = accelerates("i_A").map_or(0, |m| sign(&m, 0));
        let finding = match (resistance, constant, current) {
            (1, -1, -1) => Some((
                Code::NegativeMotorConstant,
                vec!["u_V", "omega_rad_s"],
                "positive voltage and current turn the drive backwards (a negative motor constant): exchange the motor leads in the log's signs, or turn the sign of the motion",
            )),
            (1, -1, _) => Some((
                Code::Swapped,
                vec!["u_V", "i_A"],
                "u_V falls with the rate at the same i_A, as a current does: are the columns u_V and i_A exchanged?",
            )),
            (-1, 1, _) => Some((
                Code::WrongSign,
                vec!["i_A", "u_V"],
                "u_V and i_A have opposite signs while the voltage drives the right way: the current has the wrong sign",
            )),
            (-1, -1, _) => Some((
                Code::WrongSign,
                vec!["u_V", "i_A"],
                "u_V is opposite to the current and to the rate: the voltage has the wrong sign",
            )),
            _ => None,
        };
        if let Some((code, columns, says)) = finding {
            return Some(Finding::new(code, &columns, says));
        }
    }
    for (column, word) in [("torque_N_m", "torque"), ("i_A", "current")] {
        if accelerates(column).is_some_and(|m| sign(&m, 0) < 0) {
            let says =
                format!("positive {word} accelerates backwards: {column} or the motion has the wrong sign (a negative motor constant)");
            return Some(Finding::new(Code::NegativeMotorConstant, &[if word == "torque" { "torque_N_m" } else { "i_A" }], says));
        }
    }
    if i.is_none() && u.is_some() {
        let voltage = accelerates("u_V")?;
        let (by_acceleration, by_rate) = (sign(&voltage, 0), sign(&voltage, 1));
        if by_acceleration.min(by_rate) < 0 && by_acceleration.max(by_rate) <= 0 {
            let says = "positive voltage drives backwards: u_V or the motion has the wrong sign (a negative motor constant)";
            return Some(Finding::new(Code::NegativeMotorConstant, &["u_V"], says));
        }
    }
    None
}

/// The sign of a coefficient: 1 or −1 where it is beyond doubt, else 0.
fn sign<const K: usize>(fit: &Regression<K>, k: usize) -> i32 {
    let sure = fit.partial[k].abs() > PARTIAL && fit.slope[k].abs() > SIGMAS * fit.sigma[k];
    if sure { fit.slope[k].signum() as i32 } else { 0 }
}

/// The window length whose equation holds and is surest of its first coefficient.
fn best<const K: usize>(fit: impl Fn(f64) -> Option<Regression<K>>) -> Option<Regression<K>> {
    let sureness = |f: &Regression<K>| f.slope[0].abs() / f.sigma[0].max(f64::MIN_POSITIVE);
    WINDOWS_S.into_iter().filter_map(fit).filter(|f| f.explained > HOLDS).max_by(|a, b| sureness(a).total_cmp(&sureness(b)))
}

/// u on i and ω.
fn electrical(log: &Log, u: &[f64], i: &[f64], length_s: f64) -> Option<Regression<2>> {
    let windows = Windows::of_length(log, length_s);
    let omega = rates(log, &windows)?;
    regress([&windows.means(i), &omega], &windows.means(u))
}

/// A drive column on ω', ω, its direction, and θ.
fn mechanical(log: &Log, drive: &[f64], length_s: f64) -> Option<Regression<4>> {
    let windows = Windows::of_length(log, length_s);
    let omega = rates(log, &windows)?;
    let drive = windows.means(drive);
    let fast = omega.iter().copied().max_abs();
    let theta = log.column("theta_rad").map(|theta| windows.means(theta));
    let mut rows: [Vec<f64>; 5] = Default::default();
    for k in 1..omega.len().saturating_sub(1) {
        // Neighbours of one segment only.
        if windows.rows[k - 1].end != windows.rows[k].start || windows.rows[k].end != windows.rows[k + 1].start {
            continue;
        }
        let values =
            [omega[k + 1] - omega[k - 1], omega[k], (omega[k] / (0.02 * fast)).tanh(), theta.as_ref().map_or(0.0, |t| t[k]), drive[k]];
        rows.iter_mut().zip(values).for_each(|(row, value)| row.push(value));
    }
    let [acceleration, rate, direction, angle, drive] = rows;
    regress([&acceleration, &rate, &direction, &angle], &drive)
}

/// Mean rate in each window: by the angle turned where there is an angle, else by the rate.
fn rates(log: &Log, windows: &Windows) -> Option<Vec<f64>> {
    if let Some(theta) = log.column("theta_rad") {
        let t_s = windows.differences(log.t_s());
        return Some(windows.differences(theta).iter().zip(t_s).map(|(turned, t)| turned / t).collect());
    }
    Some(windows.means(log.column("omega_rad_s")?))
}
