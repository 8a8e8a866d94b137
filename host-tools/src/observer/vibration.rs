//! Mean azimuth error under vibration and its correction by the estimated rates (docs/theory.md §2.3).
//!
//! ⟨α⟩ = \[H⟨α′ sin γ⟩ − (Jx−Jz)⟨β′ γ′⟩\]/k_α. Input: azimuth and roll over time, and exact rates if the log has them. Output: the mean azimuth over whole
//! periods and the correction by exact and by estimated rates, each with and without the inertia term. The estimates come from the
//! firmware's observer at the step of the log; the firmware's own code computes the means.

use hal_sim::element::{BaseVibration, FourState};
use nalgebra::Complex;
use stand_firmware::gyro_loop::observer::{Motion, Observer, Vibration};

use super::{Bode, Design, Discrete, ObserverError};

/// Time for settling before the means, in time constants of the slowest pole.
const SETTLING_TIME_CONSTANTS: f64 = 20.0;
/// Minimum number of periods for a mean.
const MIN_PERIODS: f64 = 3.0;

/// A measured record.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Sampling interval, s.
    pub step_s: f64,
    /// α, rad.
    pub alpha_rad: &'a [f64],
    /// γ, rad.
    pub gamma_rad: &'a [f64],
    /// Exact α′ and β′, rad/s, if known.
    pub exact: Option<(&'a [f64], &'a [f64])>,
}

/// A correction of the mean azimuth, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correction {
    /// By the term α′ sin γ alone, rad.
    pub rate_rad: f64,
    /// With the term of Jx − Jz as well, rad.
    pub with_inertia_rad: f64,
}

/// Means over one period of the vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// Middle of the period, s since the first row.
    pub t_s: f64,
    /// Uncorrected azimuth, rad.
    pub alpha_rad: f64,
    /// Azimuth corrected by the estimated rates, rad.
    pub estimated_rad: f64,
    /// Azimuth corrected by the exact rates, rad.
    pub exact_rad: Option<f64>,
}

/// A corrected record.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// Frequency of the vibration, Hz.
    pub vibration_Hz: f64,
    /// Number of whole periods in the means.
    pub periods: f64,
    /// Mean azimuth, rad.
    pub alpha_rad: f64,
    /// Correction by the estimated rates.
    pub estimated: Correction,
    /// Correction by the exact rates.
    pub exact: Option<Correction>,
    /// Means of each period after the observer has settled.
    pub by_period: Vec<Period>,
}

/// Corrects a record by the rates that an observer estimates. `design` is an observer of a four-state element with a discrete form at the step of the record.
///
/// # Errors
/// The record has too few rows or periods; γ shows no vibration; the design has no discrete form of this element.
pub fn compensate(
    measured: &Measured<'_>,
    element: &FourState,
    design: &Design,
    vibration_Hz: Option<f64>,
) -> Result<Compensated, ObserverError> {
    let discrete = design.discrete.as_ref().ok_or(ObserverError::NoDiscreteForm)?;
    let rows = measured.alpha_rad.len().min(measured.gamma_rad.len());
    let step_s = measured.step_s;
    let settling = (SETTLING_TIME_CONSTANTS / design.request.slowest_placed_pole_1_s() / step_s).ceil() as usize;
    let estimates = estimate(discrete, measured.alpha_rad)?;
    if rows < settling + 16 {
        return Err(ObserverError::TooFewRows { rows, settling });
    }
    let vibration_Hz = match vibration_Hz {
        Some(given) => given,
        None => frequency_Hz(&measured.gamma_rad[settling..rows], step_s).ok_or(ObserverError::NoVibration)?,
    };
    if !(vibration_Hz.is_finite() && vibration_Hz > 0.0 && vibration_Hz < 0.5 / step_s) {
        return Err(ObserverError::VibrationRange { vibration_Hz, nyquist_Hz: 0.5 / step_s });
    }
    let periods = ((rows - settling - 1) as f64 * step_s * vibration_Hz).floor();
    if periods < MIN_PERIODS {
        return Err(ObserverError::TooFewPeriods { periods, vibration_Hz, needed: MIN_PERIODS });
    }
    let window_s = periods / vibration_Hz;
    let stiffness = element.azimuth_stiffness_N_m_rad();
    let rate_gain_s = element.rotor_N_m_s / stiffness;
    let inertia_gain_s2 = (element.inertia_x_kg_m2 - element.inertia_z_kg_m2) / stiffness;
    // Means over the end of the record, where the observer has settled best.
    let first = rows - 1 - (window_s / step_s).ceil() as usize;
    let mean = |rates: &dyn Fn(usize) -> (f64, f64), inertia_gain_s2: f64| -> Result<(f64, f64), ObserverError> {
        let mut vibration = Vibration::new(window_s, step_s, rate_gain_s, inertia_gain_s2)?;
        let mut last = Default::default();
        for k in first..rows {
            let (alpha_rate_rad_s, beta_rate_rad_s) = rates(k);
            let (alpha_rad, gamma_rad) = (measured.alpha_rad[k], measured.gamma_rad[k]);
            last = vibration.update(Motion { alpha_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rad });
        }
        Ok((last.alpha_rad, last.vibration_rad))
    };
    let both = |rates: &dyn Fn(usize) -> (f64, f64)| -> Result<(f64, Correction), ObserverError> {
        let (alpha_rad, rate_rad) = mean(rates, 0.0)?;
        Ok((alpha_rad, Correction { rate_rad, with_inertia_rad: mean(rates, inertia_gain_s2)?.1 }))
    };
    let (alpha_rad, estimated) = both(&|k| estimates[k])?;
    let exact = measured.exact.map(|(alpha, beta)| both(&|k| (alpha[k], beta[k]))).transpose()?.map(|(_, correction)| correction);
    let each = |rates: &dyn Fn(usize) -> (f64, f64)| -> Result<Vec<Period>, ObserverError> {
        let mut vibration = Vibration::new(1.0 / vibration_Hz, step_s, rate_gain_s, inertia_gain_s2)?;
        let (mut by_period, mut means) = (Vec::new(), 0);
        for k in settling..rows {
            let (alpha_rate_rad_s, beta_rate_rad_s) = rates(k);
            let (alpha_rad, gamma_rad) = (measured.alpha_rad[k], measured.gamma_rad[k]);
            let last = vibration.update(Motion { alpha_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rad });
            if last.means > means {
                means = last.means;
                let corrected_rad = last.alpha_rad - last.vibration_rad;
                let t_s = k as f64 * step_s - 0.5 / vibration_Hz;
                by_period.push(Period { t_s, alpha_rad: last.alpha_rad, estimated_rad: corrected_rad, exact_rad: None });
            }
        }
        Ok(by_period)
    };
    let mut by_period = each(&|k| estimates[k])?;
    if let Some((alpha, beta)) = measured.exact {
        for (period, exact) in by_period.iter_mut().zip(each(&|k| (alpha[k], beta[k]))?) {
            period.exact_rad = Some(exact.estimated_rad);
        }
    }
    Ok(Compensated { vibration_Hz, periods, alpha_rad, estimated, exact, by_period })
}

/// α̂′ and β̂′ predicted for each row, before the angle of that row is used.
fn estimate(discrete: &Discrete, alpha_rad: &[f64]) -> Result<Vec<(f64, f64)>, ObserverError> {
    match discrete.gains.len() {
        4 => estimated::<4>(discrete, alpha_rad),
        5 => estimated::<5>(discrete, alpha_rad),
        _ => Err(ObserverError::NotFourState),
    }
}

fn estimated<const N: usize>(discrete: &Discrete, alpha_rad: &[f64]) -> Result<Vec<(f64, f64)>, ObserverError> {
    let law = discrete.law::<N>()?;
    let mut observer = Observer::<f64, N>::at(alpha_rad.first().copied().unwrap_or(0.0));
    let rates = alpha_rad.iter().map(|angle| {
        let estimate = *observer.estimate();
        observer.step(&law, *angle, 0.0);
        (estimate[1], estimate[3])
    });
    Ok(rates.collect())
}

/// Frequency of the largest spectral line, Hz, refined to the best fit of a sine; `None` without a line.
fn frequency_Hz(values: &[f64], step_s: f64) -> Option<f64> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let mut centred: Vec<f64> = values.iter().map(|v| v - mean).collect();
    let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(n);
    let mut spectrum = fft.make_output_vec();
    let powers = |rad_s: f64| {
        let sum: Complex<f64> = values
            .iter()
            .enumerate()
            .map(|(k, v)| {
                // Hann window: neighbouring lines do not shift the maximum.
                let window = 1.0 - (std::f64::consts::TAU * k as f64 / n as f64).cos();
                Complex::from_polar(window * (v - mean), -rad_s * step_s * k as f64)
            })
            .sum();
        sum.norm()
    };
    fft.process(&mut centred, &mut spectrum).ok()?;
    let (bin, top) = spectrum.iter().enumerate().skip(1).map(|(k, x)| (k, x.norm())).fold((0, 0.0), |m, x| if x.1 > m.1 { x } else { m });
    if bin == 0 || !(top.is_finite() && top > 0.0) {
        return None;
    }
    let bin_rad_s = std::f64::consts::TAU / (n as f64 * step_s);
    let (mut low, mut high) = ((bin as f64 - 1.0) * bin_rad_s, (bin as f64 + 1.0) * bin_rad_s);
    let golden = 0.5 * (5f64.sqrt() - 1.0);
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if powers(a) > powers(b) { high = b } else { low = a }
    }
    Some(0.5 * (low + high) / std::f64::consts::TAU)
}

/// Complex amplitudes of α′, β′, γ, γ′ under vibration by linear theory.
fn amplitudes(element: &FourState, vibration: &BaseVibration) -> [Complex<f64>; 4] {
    let s = Complex::new(0.0, vibration.rate_rad_s);
    let r = (element.link_damping_N_m_s + element.alpha_damping_N_m_s) / element.inertia_y_kg_m2;
    let (q, d) = (element.beta_damping_N_m_s / element.inertia_z_kg_m2, element.pendulum_N_m / element.inertia_z_kg_m2);
    let a = element.azimuth_stiffness_N_m_rad() / element.inertia_y_kg_m2;
    let (b, c) = (element.rotor_N_m_s / element.inertia_y_kg_m2, element.rotor_N_m_s / element.inertia_z_kg_m2);
    let along = -d * vibration.overload_g * vibration.direction_rad.cos();
    let across = element.pendulum_N_m * vibration.overload_g * vibration.direction_rad.sin();
    let det = super::bode::evaluate(&[1.0, r + q, r * q + d + a + b * c, r * d + a * q, a * d], s);
    let alpha = -s * b * along / det;
    let beta = (s * s + s * r + a) * along / det;
    let gamma = Complex::from_polar(across, vibration.phase_rad)
        / (s * s * element.inertia_x_kg_m2 + s * element.gamma_damping_N_m_s + element.pendulum_N_m);
    [s * alpha, s * beta, gamma, s * gamma]
}

/// Mean azimuth error under vibration by linear theory, rad.
pub fn predicted_rad(element: &FourState, vibration: &BaseVibration) -> f64 {
    let [alpha_rate, beta_rate, gamma, gamma_rate] = amplitudes(element, vibration);
    let mean = |x: Complex<f64>, y: Complex<f64>| 0.5 * (x * y.conj()).re;
    let (jx, jz) = (element.inertia_x_kg_m2, element.inertia_z_kg_m2);
    (element.rotor_N_m_s * mean(alpha_rate, gamma) - (jx - jz) * mean(beta_rate, gamma_rate)) / element.azimuth_stiffness_N_m_rad()
}

/// Correction by the estimated α′ divided by the correction by the exact α′, by linear theory.
pub fn share(element: &FourState, vibration: &BaseVibration, bode: &Bode) -> f64 {
    let [alpha_rate, _, gamma, _] = amplitudes(element, vibration);
    (bode.ratio(vibration.rate_rad_s) * alpha_rate * gamma.conj()).re / (alpha_rate * gamma.conj()).re
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::{Kind, Plant, Poles, Request};
    use hal_sim::element::RigidBody;
    use std::f64::consts::PI;

    fn v1() -> (FourState, BaseVibration) {
        (FourState::SET_B, BaseVibration { overload_g: 1e-3, direction_rad: PI / 4.0, rate_rad_s: 4.0 * PI, phase_rad: 0.0 })
    }

    fn v2() -> (FourState, BaseVibration) {
        let element = FourState { inertia_x_kg_m2: 1.2e-2, link_rad_s: 2e-4, link_damping_N_m_s: 6e-3, ..FourState::SET_B };
        (element, BaseVibration { overload_g: 1e-3, direction_rad: PI / 6.0, rate_rad_s: 6.0 * PI, phase_rad: PI / 3.0 })
    }

    #[track_caller]
    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found:e} is not {expected:e} ± {tolerance:e}");
    }

    fn request(element: FourState, omega: f64) -> Request {
        let plant = Plant::new("vibration", super::super::Element::Four(element)).unwrap();
        Request { plant, poles: Poles::Binomial(omega), kind: Kind::Static, step_s: Some(1e-3), vibration_Hz: None }
    }

    /// §2.3, columns "predicted" and the linear ratios.
    #[test]
    fn linear_theory_predicts_the_mean_azimuth() {
        near(predicted_rad(&v1().0, &v1().1), -6.9239652e-3, 1e-9);
        near(predicted_rad(&v2().0, &v2().1), -3.9746694e-4, 1e-10);
        let element = FourState::SET_B;
        #[rustfmt::skip]
        let table = [
            (10.0, [-10.78, 2.10, 1.08, 0.176, 0.0335, 0.0048], 5e-3),
            (100.0, [0.995593, 0.979927, 0.993846, 1.328826, 0.826682, -0.249625], 1e-6),
            (1000.0, [1.000001, 0.999997, 0.999999, 1.000170, 1.003250, 1.092619], 1e-6),
        ];
        for (omega, shares, tolerance) in table {
            let bode = Bode::new(&request(element, omega).design().unwrap(), omega);
            for (vibration_Hz, expected) in [1.0, 2.0, 5.0, 10.0, 20.0, 50.0].into_iter().zip(shares) {
                let vibration = BaseVibration { rate_rad_s: 2.0 * PI * vibration_Hz, ..v1().1 };
                near(share(&element, &vibration, &bode), expected, tolerance * f64::max(1.0, f64::abs(expected)));
            }
        }
    }

    /// §2.3, the table of the rigid body. Its mean settles with the precession's slow damping, so that the last digits of the printed means
    /// depend on where averaging begins: 2e-4; what a correction takes off is a ratio of means over the same rows: 0.1 % where it is near 100. Theory's
    /// observers are continuous: ours run at 0.1 ms here.
    #[test]
    fn what_the_correction_takes_off_is_what_theory_says() {
        #[rustfmt::skip]
        let cases = [
            (v1(), 1500.0, -6.9231912e-3, 100.0113, 100.0113, [(10.0, 210.09, 210.09), (100.0, 98.0026, 98.0026), (1000.0, 100.0095, 100.0095)]),
            (v2(), 1000.0, -3.9708743e-4, 115.1700, 100.0185, [(10.0, 766.3, 624.0), (100.0, 103.4914, 86.944), (1000.0, 115.0541, 100.2774)]),
        ];
        for ((element, vibration), seconds, mean, exact, exact_with_inertia, estimates) in cases {
            let (alpha, gamma, rates) = simulated(&element, &vibration, seconds);
            let (alpha_rates, beta_rates): (Vec<f64>, Vec<f64>) = rates.into_iter().unzip();
            for (omega, by_rate, with_inertia) in estimates {
                let measured = Measured { step_s: FINE_S, alpha_rad: &alpha, gamma_rad: &gamma, exact: Some((&alpha_rates, &beta_rates)) };
                let design = Request { step_s: Some(FINE_S), ..request(element, omega) }.design().unwrap();
                let found = compensate(&measured, &element, &design, None).unwrap();
                near(found.vibration_Hz, vibration.rate_rad_s / (2.0 * PI), 1e-5);
                near(found.alpha_rad, mean, 2e-4 * mean.abs());
                let percent = |rad: f64| 100.0 * rad / found.alpha_rad;
                let by_exact = found.exact.unwrap();
                near(percent(by_exact.rate_rad), exact, 0.05);
                near(percent(by_exact.with_inertia_rad), exact_with_inertia, 0.05);
                // At 10 1/s the poles have just settled, and the share is large: 1 %; else what a step of 0.01 of the poles moves.
                let tolerance = if omega < 50.0 { 0.01 * by_rate } else { 0.2 };
                near(percent(found.estimated.rate_rad), by_rate, tolerance);
                // The printed 100.2774 of V2 comes of an observer that is fed the angle each millisecond and a straight line between: 0.23 above ours.
                near(percent(found.estimated.with_inertia_rad), with_inertia, f64::max(tolerance, 0.25));
                if omega >= 1000.0 {
                    // Poles that fast show the rates as they are.
                    near(percent(found.estimated.rate_rad), percent(by_exact.rate_rad), 0.2);
                    near(percent(found.estimated.with_inertia_rad), percent(by_exact.with_inertia_rad), 0.1);
                }
            }
        }
    }

    const FINE_S: f64 = 1e-4;

    /// The last 20 s of a run of the rigid body: α, γ, exact α′ and β′, in fine steps.
    #[allow(clippy::type_complexity)]
    fn simulated(element: &FourState, vibration: &BaseVibration, seconds: f64) -> (Vec<f64>, Vec<f64>, Vec<(f64, f64)>) {
        let mut body = RigidBody::new(*element, *vibration, predicted_rad(element, vibration));
        let (mut alpha, mut gamma, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        // At 31 rad/s a step of a millisecond is off by 10⁻⁹ of the amplitude.
        while body.t_s() < seconds - 20.0 {
            body.advance(0.0, 1e-3);
        }
        while body.t_s() < seconds {
            let attitude = body.attitude();
            alpha.push(attitude.alpha_rad);
            gamma.push(attitude.gamma_rad);
            rates.push((attitude.alpha_rate_rad_s, attitude.beta_rate_rad_s));
            body.advance(0.0, FINE_S);
        }
        (alpha, gamma, rates)
    }
}
