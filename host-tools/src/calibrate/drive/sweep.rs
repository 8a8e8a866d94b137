//! Frequency response from voltage to rate along a chirp that never turns back; its corner is the mechanical time constant seen another way.
//!
//! While the sign of the rate stays, dry friction is a constant and the drive is linear: Ω′ = α u − β Ω − γ, integrated Ω = Ω₀ + α∫u − β θ − γ t (theory.md §4).
//! The corner is β/2π: it lies below the frequencies of which a chirp has whole periods enough for a lock-in, and those stand beside it in the picture.

use crate::calibrate::gyro::along_chirp;
use crate::calibrate::lock_in::Response;
use crate::calibrate::session::Session;
use crate::calibrate::{Curve, Findings, Step};
use crate::log::Log;
use crate::statistics::Extremes;
use crate::statistics::least_squares;
use crate::statistics::uncertainty::{Part, Quantity};
use nalgebra::Complex;
use std::f64::consts::TAU;

/// A rate is the slope of the angle over so many rows before and behind.
const BESIDE: usize = 25;
/// From one rate to the next, rows: no row is in two slopes.
const EVERY: usize = 2 * BESIDE + 1;
/// Slower than this part of the greatest rate, dry friction is no constant.
const SLOW: f64 = 0.05;
/// Fewer rates are no response.
const LEAST: usize = 100;

/// Ω = Ω₀ + α∫u − β θ − γ t.
struct Linear {
    rate_per_voltage: f64,
    /// 1/s, and its standard uncertainty.
    beta: (f64, f64),
    dof: f64,
    rates: usize,
}

impl Linear {
    fn at(&self, frequency_Hz: f64) -> Complex<f64> {
        self.rate_per_voltage / Complex::new(1.0, TAU * frequency_Hz / self.beta.0)
    }
}

fn linear(log: &Log, u_V: &[f64], theta: &[f64]) -> Result<Linear, &'static str> {
    let t_s = log.t_s();
    let slope = |k: usize| {
        let (mut cross, mut square) = (0.0, 0.0);
        for row in k - BESIDE..=k + BESIDE {
            let from = t_s[row] - t_s[k];
            (cross, square) = (cross + from * (theta[row] - theta[k]), square + from * from);
        }
        cross / square
    };
    let Some(longest) = log.segments().into_iter().max_by_key(ExactSizeIterator::len) else { return Err("there are no rows") };
    let mut given = 0.0;
    let mut held = Vec::new();
    for k in longest.clone() {
        if (k - longest.start) % EVERY == BESIDE && k + BESIDE < longest.end {
            held.push((t_s[k], slope(k), given, theta[k]));
        }
        if k + 1 < longest.end {
            given += u_V[k] * (t_s[k + 1] - t_s[k]);
        }
    }
    let greatest = held.iter().map(|(_, rate, ..)| rate.abs()).max_or_zero();
    let used: Vec<_> = held.into_iter().skip_while(|(_, rate, ..)| rate.abs() < SLOW * greatest).collect();
    let Some(first) = used.first() else { return Err("the platform did not turn") };
    if used.iter().any(|(_, rate, ..)| rate * first.1.signum() < SLOW * greatest) {
        return Err("the platform turned back or stopped, so that dry friction was no constant: make the offset larger than the amplitude");
    }
    if used.len() < LEAST {
        return Err("the chirp is too short: let it last longer");
    }
    let rows: Vec<Vec<f64>> = used.iter().map(|(t, _, given, angle)| vec![1.0, given - first.2, first.3 - angle, first.0 - t]).collect();
    let y: Vec<f64> = used.iter().map(|(_, rate, ..)| *rate).collect();
    let fit = least_squares(&rows, &y).ok_or("voltage and angle do not tell its parameters apart")?;
    let beta = fit.coefficients[2];
    if beta.is_nan() || beta <= 0.0 {
        return Err("no fall of the gain is in sight: begin the chirp at a lower frequency");
    }
    // What is left is white where it is the encoder's noise; a torque that comes and goes leaves more than that says.
    let r = &fit.residuals;
    let square: f64 = r.iter().map(|r| r * r).sum();
    let next = (r.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / square).clamp(0.0, 0.99);
    let colour = (1.0 + next) / (1.0 - next);
    let dof = (fit.dof / colour).max(1.0);
    Ok(Linear { rate_per_voltage: fit.coefficients[1] / beta, beta: (beta, fit.sigma(2) * colour.sqrt()), dof, rates: used.len() })
}

/// Adds what the sweep shows.
pub(super) fn add(steps: &[Step], session: &Session, findings: &mut Findings) {
    let name = "drive_bandwidth_Hz";
    let chirp = steps.iter().find(|s| s.log.note("profile") == Some("chirp") && s.log.note("mode") == Some("voltage"));
    let Some(step) = chirp else { return findings.lacks(name, "it takes a chirp in voltage mode") };
    let (Some(u_V), Some(theta)) = (step.log.column("u_V"), step.log.column("theta_rad")) else { return };
    let h = match linear(&step.log, u_V, theta) {
        Ok(found) => found,
        Err(why) => return findings.lacks(name, why),
    };
    let value = h.beta.0 / TAU;
    let parts = vec![
        Part::measured(
            "noise",
            h.beta.1 / TAU,
            h.dof,
            format!("scatter of {} rates about the integrated law; colour taken into account", h.rates),
        ),
        Part::within("clock", session.known.crystal_ppm * 1e-6, "1", value, format!("crystal, ± {} ppm", session.known.crystal_ppm)),
    ];
    findings.quantities.push(
        Quantity::new(name, "Hz", value, parts)
            .saying("voltage to rate, where the gain has fallen by 3 dB; first order, turning one way: (K²/R + b)/(2π J)"),
    );
    // Voltage over rate; turned over, rate over voltage. The voltage is held over its row: half a row late.
    let half_s: Vec<f64> = vec![-0.5 * step.log.median_dt_s(); step.log.len()];
    let found: Vec<Response> = along_chirp(&step.log, theta, u_V, Some(&half_s)).into_iter().map(inverse).collect();
    let low = 0.1 * value;
    let high = found.last().map_or(10.0 * value, |r| r.frequency_Hz);
    let grid: Vec<f64> = (0..=100).map(|k| low * (high / low).powf(f64::from(k) / 100.0)).collect();
    let dB = |x: f64| 20.0 * x.max(1e-12).log10();
    findings.curves.push(Curve::over_frequency(
        "Frequency response, voltage to rate: gain",
        "gain, dB re 1 rad/s/V",
        found.iter().map(|r| (r.frequency_Hz, dB(r.gain()))).collect(),
        grid.iter().map(|f| (*f, dB(h.at(*f).norm()))).collect(),
    ));
    findings.curves.push(Curve::over_frequency(
        "Frequency response, voltage to rate: phase",
        "phase, °",
        found.iter().map(|r| (r.frequency_Hz, r.phase_rad().to_degrees())).collect(),
        grid.iter().map(|f| (*f, h.at(*f).arg().to_degrees())).collect(),
    ));
}

fn inverse(r: Response) -> Response {
    let size = r.re * r.re + r.im * r.im;
    Response { re: r.re / size, im: -r.im / size, sigma: r.sigma / size, ..r }
}
