//! Mean azimuth error under vibration and its correction by the estimated rates (docs/theory.md §2.3).
//!
//! Vibration adds \[H⟨α′ sin γ⟩ − (Jx−Jz)⟨β′ γ′⟩\]/k_α to the true azimuth. Input: azimuth and roll over time, and exact rates if the log
//! has them. Output: the mean azimuth over whole periods and the correction by exact and by estimated rates, each with and without the
//! inertia term; the estimated rates also with the inverse of the observer's response at the vibration frequency ([`RateResponse`]). The
//! estimates come from the firmware's observer at the step of the log; the firmware's own code computes the means.
//!
//! Uncertainty: errors of the roll channel act on the correction. Its gain scales it; a delay adds the product with γ′; a rotation of the
//! roll sensor about the vertical adds the product ⟨α′ β⟩, which does not vanish; an offset multiplies ⟨α′⟩, which is nearly 0. The
//! sensitivities are computed from the record.

use hal_sim::element::{BaseVibration, FourState};
use nalgebra::Complex;
use stand_firmware::gyro_loop::observer::{Motion, Observer, Vibration};

use super::{Bode, Design, Discrete, ObserverError, RateResponse};
use crate::drift::session_fit::{FitRow, SessionFit};
use identification::statistics::fourier::transform;
use identification::statistics::uncertainty::{Contribution, Quantity, Uncertainty};

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

/// Standard uncertainties of the roll channel and of the element; half-widths are none of them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VibrationUncertainties {
    /// Gain of the roll channel, relative.
    pub gamma_gain: f64,
    /// Delay of the roll channel against the azimuth, s.
    pub gamma_delay_s: f64,
    /// Rotation of the roll sensor about the vertical, rad: it shows a part of the tilt β.
    pub gamma_misalignment_rad: f64,
    /// Offset of the roll channel, rad.
    pub gamma_offset_rad: f64,
    /// Parameters of the element, H/k_α and (Jx − Jz)/k_α, relative.
    pub element: f64,
}

impl Default for VibrationUncertainties {
    fn default() -> Self {
        Self { gamma_gain: 0.01, gamma_delay_s: 5e-4, gamma_misalignment_rad: 5e-3, gamma_offset_rad: 1e-3, element: 0.01 }
    }
}

impl VibrationUncertainties {
    /// Checks the values.
    ///
    /// # Errors
    /// A value that is negative or not finite.
    pub fn checked(self) -> Result<Self, ObserverError> {
        let all = [
            ("gamma_gain", self.gamma_gain),
            ("gamma_delay_s", self.gamma_delay_s),
            ("gamma_misalignment_rad", self.gamma_misalignment_rad),
            ("gamma_offset_rad", self.gamma_offset_rad),
            ("element", self.element),
        ];
        match all.into_iter().find(|(_, u)| !(u.is_finite() && *u >= 0.0)) {
            Some((name, value)) => Err(ObserverError::Uncertainty { name, value }),
            None => Ok(self),
        }
    }
}

/// Source of an uncertainty of the correction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VibrationSource {
    /// Scatter and movement of the means of the periods.
    Periods,
    /// Gain of the roll channel.
    GammaGain,
    /// Delay of the roll channel.
    GammaDelay,
    /// Rotation of the roll sensor about the vertical.
    GammaMisalignment,
    /// Offset of the roll channel.
    GammaOffset,
    /// Parameters of the element.
    Element,
}

/// A quantity with its budget, rad.
pub type VibrationQuantity = Quantity<VibrationSource, ()>;

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
    /// Correction by the estimated rates as they are.
    pub estimated: Correction,
    /// Correction by the estimated rates with the inverse response of the observer at the vibration frequency.
    pub response_corrected: Correction,
    /// Correction by the exact rates.
    pub exact: Option<Correction>,
    /// Part of the mean azimuth that vibration causes, with its budget; `None` with too few periods.
    pub part: Option<VibrationQuantity>,
    /// Mean azimuth without that part, with its budget.
    pub corrected: Option<VibrationQuantity>,
    /// Part of the tilt vibration in the product ⟨α′ β⟩ H/k_α, rad per rad of rotation of the roll sensor.
    pub misalignment_gain: f64,
    /// Means of each period after the observer has settled.
    pub by_period: Vec<Period>,
    /// Duration of a precession, s, which the means must contain to be free of it.
    pub precession_s: f64,
}

/// Estimates for each row, before the angle of that row is used.
#[derive(Debug, Clone, Copy, Default)]
struct Estimated {
    alpha_rate_rad_s: f64,
    beta_rad: f64,
    beta_rate_rad_s: f64,
}

/// Corrects a record by the rates that an observer estimates. `design` is an observer of a four-state element with a discrete form at the
/// step of the record. The true azimuth need not be 0: the correction is the part that vibration causes.
///
/// # Errors
/// The record has too few rows or periods; γ shows no vibration; the design has no discrete form of this element.
pub fn compensate(
    measured: &Measured<'_>,
    element: &FourState,
    design: &Design,
    vibration_Hz: Option<f64>,
    uncertainties: &VibrationUncertainties,
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
    let stiffness = element.azimuth_stiffness_N_m_rad();
    let record = Record {
        measured,
        step_s,
        // Means over the end of the record, where the observer has settled best.
        first: rows - 1 - (periods / vibration_Hz / step_s).ceil() as usize,
        rows,
        window_s: periods / vibration_Hz,
        rate_gain_s: element.rotor_N_m_s / stiffness,
        inertia_gain_s2: (element.inertia_x_kg_m2 - element.inertia_z_kg_m2) / stiffness,
    };
    let response = RateResponse::new(discrete, element, vibration_Hz).map_or([0.0; 4], |response| response.console_numbers());
    let of_estimates = |k: usize| (estimates[k].alpha_rate_rad_s, estimates[k].beta_rate_rad_s);
    let (alpha_rad, estimated) = record.correction(&of_estimates, [0.0; 4])?;
    let (_, response_corrected) = record.correction(&of_estimates, response)?;
    let exact = measured.exact.map(|(alpha, beta)| record.correction(&|k| (alpha[k], beta[k]), [0.0; 4])).transpose()?;
    let mut by_period = record.by_period(settling, 1.0 / vibration_Hz, &of_estimates, response)?;
    if let Some((alpha, beta)) = measured.exact {
        let exact = record.by_period(settling, 1.0 / vibration_Hz, &|k| (alpha[k], beta[k]), [0.0; 4])?;
        for (period, exact) in by_period.iter_mut().zip(exact) {
            period.exact_rad = Some(exact.estimated_rad);
        }
    }
    let part_rad = response_corrected.with_inertia_rad;
    let delayed_rad = record.mean(&of_estimates, response, record.inertia_gain_s2, 1)?.1;
    let whole = || record.first..rows;
    let mean = |of: &dyn Fn(usize) -> f64| whole().map(of).sum::<f64>() / whole().len() as f64;
    let mean_beta_rad = mean(&|k| estimates[k].beta_rad);
    let misalignment_gain = record.rate_gain_s * mean(&|k| estimates[k].alpha_rate_rad_s * (estimates[k].beta_rad - mean_beta_rad));
    let offset_gain = record.rate_gain_s * mean(&|k| estimates[k].alpha_rate_rad_s);
    let u = uncertainties;
    // A sine in phase with the rate is changed in the second order only: 1 − cos ωδ.
    let delay_rad = std::f64::consts::TAU * vibration_Hz * u.gamma_delay_s;
    let of_delay = ((delayed_rad - part_rad) / step_s * u.gamma_delay_s).hypot(part_rad * (1.0 - delay_rad.cos()));
    let systematic = [
        (VibrationSource::GammaGain, part_rad * u.gamma_gain),
        (VibrationSource::GammaDelay, of_delay),
        (VibrationSource::GammaMisalignment, misalignment_gain * u.gamma_misalignment_rad),
        (VibrationSource::GammaOffset, offset_gain * u.gamma_offset_rad),
        (VibrationSource::Element, part_rad * u.element),
    ];
    let quantity = |name: &str, value: f64, of: &dyn Fn(&Period) -> f64| {
        let scatter = scatter(&by_period, of)?;
        let lines = std::iter::once(Contribution::type_a("", scatter.u, scatter.dof, VibrationSource::Periods));
        let lines = lines.chain(systematic.iter().map(|(source, u)| Contribution::type_b("", u.abs(), "", 1.0, *source)));
        Some(Quantity::new(name, "rad", value, lines.collect()))
    };
    let part = quantity("vibration_part", part_rad, &|period| period.alpha_rad - period.estimated_rad);
    let corrected = quantity("azimuth", alpha_rad - part_rad, &|period| period.estimated_rad);
    let slowest_rad_s = design.request.plant.slowest_rad_s();
    Ok(Compensated {
        vibration_Hz,
        periods,
        alpha_rad,
        estimated,
        response_corrected,
        exact: exact.map(|(_, correction)| correction),
        part,
        corrected,
        misalignment_gain,
        by_period,
        precession_s: std::f64::consts::TAU / slowest_rad_s,
    })
}

/// Uncertainty of the mean of the periods, which may move.
fn scatter(periods: &[Period], of: &dyn Fn(&Period) -> f64) -> Option<Uncertainty> {
    let row = |period: &Period| FitRow {
        time_s: period.t_s,
        reading: of(period),
        sign: 1,
        amplitude_rad_s: 1.0,
        regressors: vec![1.0],
        visit: 0,
        weight: 1.0,
    };
    SessionFit::new(&periods.iter().map(row).collect::<Vec<_>>())?.estimate(&[1.0]).uncertainty
}

/// A record with the windows and gains of its correction.
struct Record<'a> {
    measured: &'a Measured<'a>,
    step_s: f64,
    first: usize,
    rows: usize,
    window_s: f64,
    rate_gain_s: f64,
    inertia_gain_s2: f64,
}

/// α′ and β′ at a row.
type Rates<'a> = &'a dyn Fn(usize) -> (f64, f64);

impl Record<'_> {
    fn motion(&self, k: usize, rates: Rates<'_>, delay: usize) -> Motion {
        let (alpha_rate_rad_s, beta_rate_rad_s) = rates(k);
        let (alpha_rad, gamma_rad) = (self.measured.alpha_rad[k], self.measured.gamma_rad[k - delay]);
        Motion { alpha_rad, alpha_rate_rad_s, beta_rate_rad_s, gamma_rad }
    }

    /// Mean azimuth and its part by vibration, with the roll delayed by `delay` rows.
    fn mean(&self, rates: Rates<'_>, response: [f64; 4], inertia_gain_s2: f64, delay: usize) -> Result<(f64, f64), ObserverError> {
        let mut vibration =
            Vibration::new(self.window_s, self.step_s, self.rate_gain_s, inertia_gain_s2)?.with_response(response, self.step_s)?;
        let mut last = Default::default();
        for k in self.first.max(delay)..self.rows {
            last = vibration.update(self.motion(k, rates, delay));
        }
        Ok((last.alpha_rad, last.vibration_rad))
    }

    fn correction(&self, rates: Rates<'_>, response: [f64; 4]) -> Result<(f64, Correction), ObserverError> {
        let (alpha_rad, rate_rad) = self.mean(rates, response, 0.0, 0)?;
        let with_inertia_rad = self.mean(rates, response, self.inertia_gain_s2, 0)?.1;
        Ok((alpha_rad, Correction { rate_rad, with_inertia_rad }))
    }

    /// Means of each period from row `from` on.
    fn by_period(&self, from: usize, period_s: f64, rates: Rates<'_>, response: [f64; 4]) -> Result<Vec<Period>, ObserverError> {
        let mut vibration =
            Vibration::new(period_s, self.step_s, self.rate_gain_s, self.inertia_gain_s2)?.with_response(response, self.step_s)?;
        let (mut by_period, mut means) = (Vec::new(), 0);
        for k in from..self.rows {
            let last = vibration.update(self.motion(k, rates, 0));
            if last.means > means {
                means = last.means;
                let t_s = k as f64 * self.step_s - 0.5 * period_s;
                let estimated_rad = last.alpha_rad - last.vibration_rad;
                by_period.push(Period { t_s, alpha_rad: last.alpha_rad, estimated_rad, exact_rad: None });
            }
        }
        Ok(by_period)
    }
}

fn estimate(discrete: &Discrete, alpha_rad: &[f64]) -> Result<Vec<Estimated>, ObserverError> {
    match discrete.gains.len() {
        4 => estimated::<4>(discrete, alpha_rad),
        5 => estimated::<5>(discrete, alpha_rad),
        _ => Err(ObserverError::NotFourState),
    }
}

fn estimated<const N: usize>(discrete: &Discrete, alpha_rad: &[f64]) -> Result<Vec<Estimated>, ObserverError> {
    let law = discrete.law::<N>()?;
    let mut observer = Observer::<f64, N>::at(alpha_rad.first().copied().unwrap_or(0.0));
    let rates = alpha_rad.iter().map(|angle| {
        let estimate = *observer.estimate();
        observer.step(&law, *angle, 0.0);
        Estimated { alpha_rate_rad_s: estimate[1], beta_rad: estimate[2], beta_rate_rad_s: estimate[3] }
    });
    Ok(rates.collect())
}

/// Frequency of the largest spectral line, Hz, refined to the best fit of a sine; `None` without a line.
fn frequency_Hz(values: &[f64], step_s: f64) -> Option<f64> {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let spectrum = transform(values.iter().map(|v| v - mean).collect());
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
    /// depend on where averaging begins: 2e-4; what a correction takes off is a ratio of means over the same rows: 0.1 % where it is
    /// near 100. Theory's observers are continuous: ours run at 0.1 ms here.
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
                let found = compensate(&measured, &element, &design, None, &VibrationUncertainties::default()).unwrap();
                near(found.vibration_Hz, vibration.rate_rad_s / (2.0 * PI), 1e-5);
                near(found.alpha_rad, mean, 2e-4 * mean.abs());
                let percent = |rad: f64| 100.0 * rad / found.alpha_rad;
                let by_exact = found.exact.unwrap();
                near(percent(by_exact.rate_rad), exact, 0.05);
                near(percent(by_exact.with_inertia_rad), exact_with_inertia, 0.05);
                // At 10 1/s the poles have just settled, and the share is large: 1 %; else what a step of 0.01 of the poles moves.
                let tolerance = if omega < 50.0 { 0.01 * by_rate } else { 0.2 };
                near(percent(found.estimated.rate_rad), by_rate, tolerance);
                // The printed 100.2774 of V2 comes of an observer that is fed the angle each millisecond and a straight line between: 0.23
                // above ours.
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
