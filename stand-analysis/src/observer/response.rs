//! Response of a discrete observer's rates at one frequency, and its inverse for the correction of vibration (docs/theory.md §2.2, §2.3).
//!
//! Input: the discrete form of an observer of a four-state element, and a frequency. Output: α̂′/α′ and β̂′/β′, for the estimates that are
//! predicted for a row before its angle is used, as the firmware uses them. α̂ follows from the measured angle alone: x̂(z) = (z E − Φ + K
//! C)⁻¹ K α. β′ follows from the balance of moments about the vertical, β′ = −(α″ + r α′ + a α)/b, whatever moves the element along the
//! rotor.

use hal_sim::element::FourState;
use nalgebra::{Complex, DMatrix, DVector};
use std::f64::consts::TAU;

use super::Discrete;

/// Responses of both estimated rates at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateResponse {
    /// α̂′/α′.
    pub rate: Complex<f64>,
    /// β̂′/β′.
    pub tilt_rate: Complex<f64>,
    /// Angular frequency, rad/s.
    rad_s: f64,
}

impl RateResponse {
    /// The responses at `vibration_Hz`; `None` for an observer of another element, or where a response vanishes.
    pub fn new(discrete: &Discrete, element: &FourState, vibration_Hz: f64) -> Option<Self> {
        let rad_s = TAU * vibration_Hz;
        let n = discrete.gains.len();
        if discrete.phi.len() != n || n < 4 {
            return None;
        }
        let z = Complex::from_polar(1.0, rad_s * discrete.step_s);
        let matrix = DMatrix::from_fn(n, n, |i, j| {
            let phi = discrete.phi[i][j] - if j == 0 { discrete.gains[i] } else { 0.0 };
            (if i == j { z } else { Complex::new(0.0, 0.0) }) - phi
        });
        let gains = DVector::from_fn(n, |i, _| Complex::new(discrete.gains[i], 0.0));
        let of_angle = matrix.lu().solve(&gains)?;
        let s = Complex::new(0.0, rad_s);
        let r = (element.link_damping_N_m_s + element.alpha_damping_N_m_s) / element.inertia_y_kg_m2;
        let a = element.azimuth_stiffness_N_m_rad() / element.inertia_y_kg_m2;
        let b = element.rotor_N_m_s / element.inertia_y_kg_m2;
        let tilt_rate_of_angle = -(s * s + s * r + a) / b;
        let (rate, tilt_rate) = (of_angle[1] / s, of_angle[3] / tilt_rate_of_angle);
        let is_usable = |response: Complex<f64>| response.norm().is_finite() && response.norm() > 1e-9;
        (is_usable(rate) && is_usable(tilt_rate)).then_some(Self { rate, tilt_rate, rad_s })
    }

    /// Numbers of the firmware's correction: 1/R of both rates as real part, and imaginary part over the angular frequency, s.
    pub fn console_numbers(&self) -> [f64; 4] {
        let (rate, tilt) = (self.rate.inv(), self.tilt_rate.inv());
        [rate.re, rate.im / self.rad_s, tilt.re, tilt.im / self.rad_s]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observer::{Element, Kind, Plant, Poles, Request};

    /// An independent calculation in docs/theory.md's notation (set B, poles at −100 1/s, 1 ms, 2 Hz): R = 0.978870 − 0.041856j, R_β =
    /// 0.513210 + 0.200105j.
    #[test]
    fn responses_of_set_b() {
        let plant = Plant::new("b", Element::Four(FourState::SET_B)).unwrap();
        let request = Request { plant, poles: Poles::Binomial(100.0), kind: Kind::Static, step_s: Some(1e-3), vibration_Hz: None };
        let design = request.design().unwrap();
        let found = RateResponse::new(design.discrete.as_ref().unwrap(), &FourState::SET_B, 2.0).unwrap();
        assert!((found.rate - Complex::new(0.978_870, -0.041_856)).norm() < 1e-5, "{found:?}");
        assert!((found.tilt_rate - Complex::new(0.513_210, 0.200_105)).norm() < 1e-5, "{found:?}");
        let [re, im_s, ..] = found.console_numbers();
        assert!((Complex::new(re, im_s * TAU * 2.0) * found.rate - 1.0).norm() < 1e-12);
    }
}
