//! Frequency response from voltage to rate along a chirp without reversal. Its corner is an independent measure of the mechanical time
//! constant.
//!
//! While the sign of the rate is constant, Coulomb friction is constant and the drive is linear: Ω′ = α u − β Ω − γ, integrated Ω = Ω₀ +
//! α∫u − β θ − γ t (docs/theory.md §4). The corner β/2π lies below the frequencies at which a chirp has enough periods for a lock-in; the
//! lock-in responses are shown with the curve.

use super::clock;
use crate::calibrate::chirp::along_chirp;
use crate::calibrate::lock_in::Response;
use crate::calibrate::{AbsenceReason, Basis, Curve, CurveKind, Findings, Meaning, Step};
use crate::calibrate::{Contribution, Quantity};
use identification::log::Log;
use identification::statistics::Extremes;
use identification::statistics::least_squares;
use nalgebra::Complex;
use stand_acquire::calibration_session::Session;
use std::f64::consts::TAU;

/// Rows before and after a row over which the rate is the slope of the angle.
const HALF_WINDOW: usize = 25;
/// Rows from one rate to the next: no row is in two slopes.
const STRIDE: usize = 2 * HALF_WINDOW + 1;
/// Fraction of the greatest rate below which Coulomb friction is not constant.
const MIN_RATE_FRACTION: f64 = 0.05;
/// Fewest rates of a response.
const MIN_RATES: usize = 100;

/// Ω = Ω₀ + α∫u − β θ − γ t.
struct Linear {
    rate_per_voltage: f64,
    /// β with its standard uncertainty, 1/s.
    beta: (f64, f64),
    dof: f64,
    rates: usize,
}

impl Linear {
    fn at(&self, frequency_Hz: f64) -> Complex<f64> {
        self.rate_per_voltage / Complex::new(1.0, TAU * frequency_Hz / self.beta.0)
    }
}

fn linear(log: &Log, u_V: &[f64], theta: &[f64]) -> Result<Linear, AbsenceReason> {
    let t_s = log.t_s();
    let slope = |k: usize| {
        let (mut cross, mut square) = (0.0, 0.0);
        for row in k - HALF_WINDOW..=k + HALF_WINDOW {
            let from = t_s[row] - t_s[k];
            (cross, square) = (cross + from * (theta[row] - theta[k]), square + from * from);
        }
        cross / square
    };
    let Some(longest) = log.segments().into_iter().max_by_key(ExactSizeIterator::len) else { return Err(AbsenceReason::NoRows) };
    let mut integrals = vec![0.0; t_s.len()];
    for k in longest.clone().skip(1) {
        integrals[k] = integrals[k - 1] + u_V[k - 1] * (t_s[k] - t_s[k - 1]);
    }
    // The slope is a mean of the rate with parabolic weights; angle and integral are averaged in the same way, or the equation would not
    // hold for them.
    let half = HALF_WINDOW as f64;
    let weights: Vec<f64> = (-(HALF_WINDOW as i32)..=HALF_WINDOW as i32).map(|r| half * (half + 1.0) - f64::from(r).powi(2)).collect();
    let total: f64 = weights.iter().sum();
    let mean = |column: &[f64], k: usize| {
        let rows = &column[k - HALF_WINDOW..=k + HALF_WINDOW];
        rows.iter().zip(&weights).map(|(value, weight)| weight * value).sum::<f64>() / total
    };
    let middles = longest.clone().skip(HALF_WINDOW).step_by(STRIDE).filter(|k| k + HALF_WINDOW < longest.end);
    let rates: Vec<(f64, f64, f64, f64)> = middles.map(|k| (t_s[k], slope(k), mean(&integrals, k), mean(theta, k))).collect();
    let greatest = rates.iter().map(|(_, rate, ..)| rate.abs()).max_or_zero();
    let used: Vec<_> = rates.into_iter().skip_while(|(_, rate, ..)| rate.abs() < MIN_RATE_FRACTION * greatest).collect();
    let Some(first) = used.first() else { return Err(AbsenceReason::DidNotTurn) };
    if used.iter().any(|(_, rate, ..)| rate * first.1.signum() < MIN_RATE_FRACTION * greatest) {
        return Err(AbsenceReason::Reversed);
    }
    if used.len() < MIN_RATES {
        return Err(AbsenceReason::ChirpTooShort);
    }
    let rows: Vec<Vec<f64>> =
        used.iter().map(|(t, _, integral, angle)| vec![1.0, integral - first.2, first.3 - angle, first.0 - t]).collect();
    let y: Vec<f64> = used.iter().map(|(_, rate, ..)| *rate).collect();
    let fit = least_squares(&rows, &y).ok_or(AbsenceReason::SweepNotSeparable)?;
    let beta = fit.coefficients[2];
    if beta.is_nan() || beta <= 0.0 {
        return Err(AbsenceReason::NoCorner);
    }
    // Residuals are white where they are encoder noise; a varying torque leaves autocorrelated ones, which reduce the degrees of freedom.
    let r = &fit.residuals;
    let square: f64 = r.iter().map(|r| r * r).sum();
    let next = (r.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square).clamp(0.0, 0.99);
    let inflation = (1.0 + next) / (1.0 - next);
    let dof = (fit.dof / inflation).max(1.0);
    Ok(Linear { rate_per_voltage: fit.coefficients[1] / beta, beta: (beta, fit.sigma(2) * inflation.sqrt()), dof, rates: used.len() })
}

/// Adds the bandwidth of the drive.
pub(super) fn add(steps: &[Step], session: &Session, findings: &mut Findings) {
    let name = "drive_bandwidth_Hz";
    let chirp = steps.iter().find(|s| s.log.note("profile") == Some("chirp") && s.log.note("mode") == Some("voltage"));
    let Some(step) = chirp else { return findings.add_absent(name, AbsenceReason::NeedsVoltageChirp) };
    let (Some(u_V), Some(theta)) = (step.log.column("u_V"), step.log.column("theta_rad")) else { return };
    let h = match linear(&step.log, u_V, theta) {
        Ok(found) => found,
        Err(reason) => return findings.add_absent(name, reason),
    };
    let value = h.beta.0 / TAU;
    let contributions = vec![
        Contribution::type_a("noise", h.beta.1 / TAU, h.dof, Basis::RatesAboutIntegratedLaw { count: h.rates }),
        clock(session, value),
    ];
    findings.quantities.push(Quantity::new(name, "Hz", value, contributions).meaning(Meaning::DriveBandwidth));
    // Lock-in of voltage over rate, inverted. The voltage is constant over its row, so its mean time is half a row later.
    let half_s: Vec<f64> = vec![-0.5 * step.log.median_dt_s(); step.log.len()];
    let found: Vec<Response> = along_chirp(&step.log, theta, u_V, Some(&half_s)).into_iter().map(inverse).collect();
    let low = 0.1 * value;
    let high = found.last().map_or(10.0 * value, |r| r.frequency_Hz);
    let grid: Vec<f64> = (0..=100).map(|k| low * (high / low).powf(f64::from(k) / 100.0)).collect();
    let dB = |x: f64| 20.0 * x.max(1e-12).log10();
    findings.curves.push(Curve::new(
        CurveKind::DriveGain,
        found.iter().map(|r| (r.frequency_Hz, dB(r.gain()))).collect(),
        grid.iter().map(|f| (*f, dB(h.at(*f).norm()))).collect(),
    ));
    findings.curves.push(Curve::new(
        CurveKind::DrivePhase,
        found.iter().map(|r| (r.frequency_Hz, r.phase_rad().to_degrees())).collect(),
        grid.iter().map(|f| (*f, h.at(*f).arg().to_degrees())).collect(),
    ));
}

fn inverse(r: Response) -> Response {
    let size = r.re * r.re + r.im * r.im;
    Response { re: r.re / size, im: -r.im / size, sigma: r.sigma / size, ..r }
}
