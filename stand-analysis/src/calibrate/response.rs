//! Transfer function fitted to measured responses: scale, lags, and a transport delay separate from them.
//!
//! H(jω) = s e^(−jωτ) · 1/(1 + jω/ω₁) · 1/(1 + 2ζ jω/ω₀ − ω²/ω₀²); the BIC decides which lags are present. A known first-order low-pass,
//! such as the one inside a chip, is a fixed factor: such responses do not separate two or three neighbouring lags from a delay. A
//! bandwidth beyond three times the highest measured frequency is not reported.

use super::lock_in::Response;
use identification::statistics::Extremes;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

/// Lags of a transfer function beside the delay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Structure {
    /// No lag.
    DelayOnly,
    /// One real pole.
    FirstOrder,
    /// A pair of poles.
    SecondOrder,
    /// A real pole and a pair of poles.
    ThirdOrder,
}

impl Structure {
    fn parameters(self) -> usize {
        match self {
            Structure::DelayOnly => 2,
            Structure::FirstOrder => 3,
            Structure::SecondOrder => 4,
            Structure::ThirdOrder => 5,
        }
    }
}

/// A fitted transfer function.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    /// Scale, delay in s, then ln ω₁ and ln ω₀, ln ζ as far as the structure has them.
    parameters: Vec<f64>,
    covariance: DMatrix<f64>,
    /// Degrees of freedom: real and imaginary parts minus parameters.
    pub dof: f64,
    /// Scatter over the scatter predicted by the uncertainties of the responses.
    pub ratio: f64,
    highest_Hz: f64,
    form: Form,
}

/// The form to fit.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Form {
    structure: Structure,
    /// Cutoff of the known low-pass, Hz; infinite without one.
    known_Hz: f64,
}

fn value(form: Form, p: &[f64], frequency_Hz: f64) -> Complex<f64> {
    let w = TAU * frequency_Hz;
    let mut h = Complex::from_polar(p[0], -w * p[1]) / Complex::new(1.0, frequency_Hz / form.known_Hz);
    let first = |h: Complex<f64>, corner: f64| h / Complex::new(1.0, w / corner);
    let second = |h: Complex<f64>, natural: f64, zeta: f64| h / Complex::new(1.0 - (w / natural).powi(2), 2.0 * zeta * w / natural);
    match form.structure {
        Structure::DelayOnly => {}
        Structure::FirstOrder => h = first(h, p[2].exp()),
        Structure::SecondOrder => h = second(h, p[2].exp(), p[3].exp()),
        Structure::ThirdOrder => h = second(first(h, p[2].exp()), p[3].exp(), p[4].exp()),
    }
    h
}

impl Transfer {
    /// Structure, without the known low-pass.
    pub fn structure(&self) -> Structure {
        self.form.structure
    }

    /// H at a frequency.
    pub fn at(&self, frequency_Hz: f64) -> Complex<f64> {
        value(self.form, &self.parameters, frequency_Hz)
    }

    /// Transport delay, s, and its standard uncertainty, s.
    pub fn delay_s(&self) -> (f64, f64) {
        (self.parameters[1], self.covariance[(1, 1)].max(0.0).sqrt())
    }

    /// Scale at frequency zero and its standard uncertainty.
    pub fn scale(&self) -> (f64, f64) {
        (self.parameters[0], self.covariance[(0, 0)].max(0.0).sqrt())
    }

    /// Damping ratio of the pair of poles and its standard uncertainty.
    pub fn damping(&self) -> Option<(f64, f64)> {
        let at = match self.form.structure {
            Structure::SecondOrder => 3,
            Structure::ThirdOrder => 4,
            _ => return None,
        };
        let zeta = self.parameters[at].exp();
        Some((zeta, zeta * self.covariance[(at, at)].max(0.0).sqrt()))
    }

    /// −3 dB frequency (gain 1/√2 of the scale), Hz, and its standard uncertainty; `None` beyond three times the highest measured
    /// frequency.
    pub fn bandwidth_Hz(&self) -> Option<(f64, f64)> {
        let found = bandwidth(self.form, &self.parameters, 3.0 * self.highest_Hz)?;
        let sigma = self.sigma_of(|p| bandwidth(self.form, p, 10.0 * self.highest_Hz).unwrap_or(found));
        Some((found, sigma))
    }

    /// Phase at a frequency, rad, and its standard uncertainty, rad.
    pub fn phase_rad(&self, frequency_Hz: f64) -> (f64, f64) {
        let phase = |p: &[f64]| value(self.form, p, frequency_Hz).arg();
        (phase(&self.parameters), self.sigma_of(phase))
    }

    fn sigma_of(&self, of: impl Fn(&[f64]) -> f64) -> f64 {
        let n = self.parameters.len();
        let gradient = DVector::from_fn(n, |k, _| {
            let step = (1e-3 * self.covariance[(k, k)].max(0.0).sqrt()).max(1e-12);
            let mut p = self.parameters.clone();
            p[k] += step;
            let above = of(&p);
            p[k] -= 2.0 * step;
            (above - of(&p)) / (2.0 * step)
        });
        (gradient.transpose() * &self.covariance * gradient)[(0, 0)].max(0.0).sqrt()
    }
}

fn bandwidth(form: Form, p: &[f64], most_Hz: f64) -> Option<f64> {
    let below = |f: f64| value(form, p, f).norm() < p[0].abs() / 2_f64.sqrt();
    // First crossing to a hundredth of a decade, then bisection.
    let mut low = 1e-2;
    while !below(low) {
        if low > most_Hz {
            return None;
        }
        low *= 1.023;
    }
    let mut high = low;
    low /= 1.023;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle) { high = middle } else { low = middle }
    }
    Some(0.5 * (low + high))
}

/// ΔBIC below which two structures are not distinguishable ("strong" evidence begins at 6: Kass, Raftery, *Bayes Factors*, 1995).
const DISTINGUISHABLE_BIC: f64 = 6.0;

/// The simplest transfer function whose BIC is within [`DISTINGUISHABLE_BIC`] of the lowest, in series with a known first-order low-pass at
/// `known_Hz`; `None` for fewer than three responses.
///
/// The lowest BIC alone would take one more lag for a χ² that is lower by ln(rows): 2.6 for seven frequencies, which chance exceeds in one
/// session of ten, and the lag would take its part of the delay.
pub fn transfer(responses: &[Response], known_Hz: Option<f64>) -> Option<Transfer> {
    let known_Hz = known_Hz.filter(|f| *f > 0.0).unwrap_or(f64::INFINITY);
    if responses.len() < 3 {
        return None;
    }
    let rows = 2.0 * responses.len() as f64;
    // Ordered by the number of parameters.
    let structures = [Structure::DelayOnly, Structure::FirstOrder, Structure::SecondOrder, Structure::ThirdOrder];
    let fits = structures
        .into_iter()
        .filter(|structure| rows > structure.parameters() as f64 + 1.0)
        .filter_map(|structure| fit(Form { structure, known_Hz }, responses));
    // χ² by the uncertainties of the responses; a factor common to all fits cancels.
    let fits: Vec<(f64, Transfer)> = fits.collect();
    let least_ratio = fits.iter().map(|(chi2, t)| chi2 / t.dof).min_or_infinity().max(1.0);
    let bic = |(chi2, t): &(f64, Transfer)| chi2 / least_ratio + t.parameters.len() as f64 * rows.ln();
    let lowest = fits.iter().map(bic).min_or_infinity();
    fits.into_iter().find(|fit| bic(fit) <= lowest + DISTINGUISHABLE_BIC).map(|(_, t)| t)
}

fn fit(form: Form, responses: &[Response]) -> Option<(f64, Transfer)> {
    let highest_Hz = responses.iter().map(|r| r.frequency_Hz).max_or_zero();
    let lowest = responses.iter().min_by(|a, b| a.frequency_Hz.total_cmp(&b.frequency_Hz))?;
    let scale = lowest.gain() * if lowest.re < 0.0 { -1.0 } else { 1.0 };
    let mut best: Option<(f64, Vec<f64>, DMatrix<f64>)> = None;
    for corner in [0.3, 1.0, 3.0].map(|part| part * highest_Hz) {
        let ln = (TAU * corner).ln();
        let start = match form.structure {
            Structure::DelayOnly => vec![scale, 0.0],
            Structure::FirstOrder => vec![scale, 0.0, ln],
            Structure::SecondOrder => vec![scale, 0.0, ln, 0.7_f64.ln()],
            Structure::ThirdOrder => vec![scale, 0.0, ln + 1.0, ln, 0.7_f64.ln()],
        };
        let (p, chi2, information) = descend(form, responses, start);
        if chi2.is_finite() && best.as_ref().is_none_or(|(least, ..)| chi2 < *least) {
            best = Some((chi2, p, information));
        }
    }
    let (chi2, parameters, information) = best?;
    let dof = 2.0 * responses.len() as f64 - parameters.len() as f64;
    let ratio = chi2 / dof;
    let covariance = information.try_inverse()? * ratio.max(1.0);
    Some((chi2, Transfer { parameters, covariance, dof, ratio: ratio.sqrt(), highest_Hz, form }))
}

/// Deviations along and across each response, over their standard uncertainties: an error of the time of the samples turns a response.
fn residuals(form: Form, responses: &[Response], p: &[f64]) -> DVector<f64> {
    let each = responses.iter().flat_map(|r| {
        let off = (Complex::new(r.re, r.im) - value(form, p, r.frequency_Hz)) * Complex::from_polar(1.0, -r.phase_rad());
        [off.re / r.sigma.max(1e-12), off.im / r.sigma_across().max(1e-12)]
    });
    DVector::from_iterator(2 * responses.len(), each)
}

/// Levenberg–Marquardt: parameters, χ², information matrix.
fn descend(form: Form, responses: &[Response], mut p: Vec<f64>) -> (Vec<f64>, f64, DMatrix<f64>) {
    let n = p.len();
    let mut damping = 1e-3;
    let mut r = residuals(form, responses, &p);
    let mut information = DMatrix::identity(n, n);
    for _ in 0..200 {
        let jacobian = DMatrix::from_columns(
            &(0..n)
                .map(|k| {
                    let step = if k == 1 { 1e-8 } else { 1e-6 * p[k].abs().max(1e-3) };
                    let mut q = p.clone();
                    q[k] += step;
                    (residuals(form, responses, &q) - &r) / step
                })
                .collect::<Vec<_>>(),
        );
        information = jacobian.transpose() * &jacobian;
        let gradient = jacobian.transpose() * &r;
        let mut improved = false;
        while damping < 1e12 {
            let mut damped = information.clone();
            for k in 0..n {
                damped[(k, k)] *= 1.0 + damping;
            }
            if let Some(step) = damped.lu().solve(&(-&gradient)) {
                let q: Vec<f64> = p.iter().zip(step.iter()).map(|(p, s)| p + s).collect();
                let next = residuals(form, responses, &q);
                if next.norm_squared() < r.norm_squared() {
                    improved = r.norm_squared() - next.norm_squared() > 1e-9 * r.norm_squared().max(1e-12);
                    (p, r) = (q, next);
                    damping = (damping * 0.3).max(1e-12);
                    break;
                }
            }
            damping *= 4.0;
        }
        if !improved {
            break;
        }
    }
    (p, r.norm_squared(), information)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(truth: impl Fn(f64) -> Complex<f64>, sigma: f64) -> Vec<Response> {
        [1.0, 2.0, 5.0, 10.0, 20.0, 30.0, 50.0, 70.0, 90.0]
            .iter()
            .enumerate()
            .map(|(k, &frequency_Hz)| {
                let h = truth(frequency_Hz);
                // Two irrational steps replace noise of variance 1.
                let noise = |k: f64| sigma * 12_f64.sqrt() * ((k * 0.618_034).fract() - 0.5);
                let k = k as f64;
                Response {
                    frequency_Hz,
                    re: h.re + noise(k + 1.0),
                    im: h.im + noise(k + 20.5),
                    sigma,
                    timing_s: 0.0,
                    coherence: 1.0,
                    rate_rad_s: 1.0,
                    mean_rad_s: 0.0,
                }
            })
            .collect()
    }

    /// docs/theory.md §4, test vector of a rate gyro: second order, 80 Hz, ζ = 0.7.
    #[test]
    fn second_order_with_delay_is_found() {
        let truth = |f: f64| {
            let x = f / 80.0;
            Complex::from_polar(1.02, -TAU * f * 7e-4) / Complex::new(1.0 - x * x, 1.4 * x)
        };
        assert!((truth(50.0).norm() / 1.02 - 0.937_835_904).abs() < 1e-8);
        let found = transfer(&of(truth, 1e-4), None).unwrap();
        assert_eq!(found.structure(), Structure::SecondOrder);
        let (delay, u) = found.delay_s();
        assert!((delay - 7e-4).abs() < 4.0 * u && u < 1e-5, "{delay} {u}");
        let (zeta, u) = found.damping().unwrap();
        assert!((zeta - 0.7).abs() < 4.0 * u && u < 3e-3, "{zeta} {u}");
        // |H|² = ½: x⁴ + (4ζ² − 2) x² − 1 = 0.
        let b: f64 = 4.0 * 0.49 - 2.0;
        let exact = 80.0 * ((-b + (b * b + 4.0).sqrt()) / 2.0).sqrt();
        let (bandwidth, u) = found.bandwidth_Hz().unwrap();
        assert!((bandwidth - exact).abs() < 4.0 * u && u < 0.2, "{bandwidth} {exact} {u}");
    }

    #[test]
    fn delay_and_lag_are_separated() {
        let late = transfer(&of(|f| Complex::from_polar(0.9, -TAU * f * 2e-3), 1e-4), None).unwrap();
        assert_eq!((late.structure(), late.bandwidth_Hz()), (Structure::DelayOnly, None));
        let lag = transfer(&of(|f| Complex::new(1.0, 0.0) / Complex::new(1.0, f / 60.0), 1e-4), None).unwrap();
        assert_eq!(lag.structure(), Structure::FirstOrder);
        assert!(lag.delay_s().0.abs() < 4.0 * lag.delay_s().1);
        assert!((lag.bandwidth_Hz().unwrap().0 - 60.0).abs() < 0.2);
        assert!(transfer(&[], None).is_none());
    }

    #[test]
    fn known_low_pass_is_not_a_delay() {
        let truth = |f: f64| {
            let x = f / 60.0;
            Complex::new(1.0, 0.0) / Complex::new(1.0 - x * x, 1.2 * x) / Complex::new(1.0, f / 300.0)
        };
        let responses = of(truth, 1e-4);
        let (blind, found) = (transfer(&responses, None).unwrap(), transfer(&responses, Some(300.0)).unwrap());
        // 1/(2π 300 Hz) is 0.53 ms.
        assert!(blind.structure() == Structure::ThirdOrder || (blind.delay_s().0 - 5.3e-4).abs() < 5e-5, "{blind:?}");
        assert_eq!(found.structure(), Structure::SecondOrder);
        assert!(found.delay_s().0.abs() < 4.0 * found.delay_s().1, "{:?}", found.delay_s());
        let (zeta, u) = found.damping().unwrap();
        assert!((zeta - 0.6).abs() < 4.0 * u && u < 3e-3, "{zeta} {u}");
    }

    /// In each response the samples are late by another part of a time stamp of 25 µs: the scatter is what the uncertainties predict, and
    /// the damping is covered.
    #[test]
    fn times_of_the_samples_are_covered() {
        let truth = |f: f64| {
            let x = f / 60.0;
            Complex::new(1.0, 0.0) / Complex::new(1.0 - x * x, 1.4 * x)
        };
        for trial in 0..40 {
            let mut responses = of(truth, 1e-5);
            for (k, r) in responses.iter_mut().enumerate() {
                let late_s = 25e-6 * ((f64::from(9 * trial) + k as f64) * 0.618_034).fract();
                let turned = Complex::new(r.re, r.im) * Complex::from_polar(1.0, -TAU * r.frequency_Hz * late_s);
                *r = Response { re: turned.re, im: turned.im, timing_s: 25e-6 / 12_f64.sqrt(), ..*r };
            }
            let found = transfer(&responses, None).unwrap();
            let (zeta, u) = found.damping().unwrap();
            assert!((zeta - 0.7).abs() < 2.0 * u && found.ratio < 1.3, "{zeta} ± {u}, scatter {}", found.ratio);
        }
    }
}
