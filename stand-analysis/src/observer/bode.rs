//! Frequency response of the estimated rate (docs/theory.md §2.2).
//!
//! R(jω) = α̂′/α′ does not depend on the input that moves the element; R = 1 means no distortion. Distortion begins at the lowest frequency
//! at which |R| deviates by more than 1 dB or its phase by more than 5°. Transfer functions are computed as polynomials with 77 digits:
//! with gains of 10⁸, matrices in double precision lose them.

use nalgebra::Complex;

use super::exact::{Exact, Matrix, exact, rounded};
use super::{Design, Element, Kind, ObserverError, Plant, Poles, Request};

/// Largest undistorted deviation of the gain, dB.
pub const MAX_GAIN_ERROR_DB: f64 = 1.0;
/// Largest undistorted deviation of the phase, degrees.
pub const MAX_PHASE_ERROR_DEG: f64 = 5.0;
/// Search grid: lowest and highest frequency, rad/s, and number of points.
const GRID: (f64, f64, usize) = (0.01, 1e4, 24_001);

/// The frequency at which distortion begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Frequency, rad/s; `None`: no distortion below 10⁴ rad/s.
    pub rad_s: Option<f64>,
    /// The response is distorted at the lowest frequency of the grid already.
    pub at_lowest_frequency: bool,
}

/// Frequency response of one observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Bode {
    /// Magnitude of its poles, 1/s.
    pub omega_rad_s: f64,
    /// Observer gains.
    pub gains: Vec<f64>,
    /// Numerator of α̂′/angle, highest power first.
    pub numerator: Vec<f64>,
    /// Denominator.
    denominator: Vec<f64>,
    /// Start of distortion.
    pub limit: Limit,
    /// Largest |α̂′/y|, 1/s, and its frequency, rad/s: amplification of measurement noise.
    pub noise: (f64, f64),
}

impl Bode {
    /// The values of ω₀ that are compared by default, 1/s: 0.1, 1 and 10 times the default of a design.
    pub fn default_omegas_1_s(plant: &Plant) -> Vec<f64> {
        [0.1, 1.0, 10.0].map(|factor| factor * plant.default_omega_1_s()).to_vec()
    }

    /// Frequency responses of observers of one element for several ω₀.
    ///
    /// # Errors
    /// As [`Request::design`].
    pub fn of(plant: &Plant, kind: Kind, omegas_rad_s: &[f64]) -> Result<Vec<Self>, ObserverError> {
        let one = |omega: &f64| {
            let poles = Poles::Binomial(*omega);
            let request = Request { plant: plant.clone(), poles, kind, step_s: None, vibration_Hz: None };
            Ok(Self::new(&request.design()?, *omega))
        };
        omegas_rad_s.iter().map(one).collect()
    }

    /// Frequency response of a designed observer.
    pub fn new(design: &Design, omega_rad_s: f64) -> Self {
        let (f, input) = design.observer();
        let (numerator, denominator) = transfer(&f, &input, 1);
        let mut bode = Self {
            omega_rad_s,
            gains: design.gains.clone(),
            numerator,
            denominator,
            limit: Limit { rad_s: None, at_lowest_frequency: false },
            noise: (0.0, 0.0),
        };
        let (from, to, points) = GRID;
        let grid: Vec<f64> = (0..points).map(|k| from * (to / from).powf(k as f64 / (points - 1) as f64)).collect();
        if let Some(k) = grid.iter().position(|w| bode.is_distorted(*w)) {
            let at = if k == 0 { grid[0] } else { bisect(grid[k - 1], grid[k], |w| bode.is_distorted(w)) };
            bode.limit = Limit { rad_s: Some(at), at_lowest_frequency: k == 0 };
        }
        bode.noise =
            grid.iter().map(|w| (bode.from_angle(*w).norm(), *w)).fold((0.0, 0.0), |most, next| if next.0 > most.0 { next } else { most });
        bode
    }

    /// α̂′/measured angle at a frequency.
    pub fn from_angle(&self, rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, rad_s);
        evaluate(&self.numerator, s) / evaluate(&self.denominator, s)
    }

    /// R = α̂′/α′ at a frequency.
    pub fn ratio(&self, rad_s: f64) -> Complex<f64> {
        self.from_angle(rad_s) / Complex::new(0.0, rad_s)
    }

    fn is_distorted(&self, rad_s: f64) -> bool {
        let r = self.ratio(rad_s);
        (20.0 * r.norm().log10()).abs() > MAX_GAIN_ERROR_DB || r.arg().to_degrees().abs() > MAX_PHASE_ERROR_DEG
    }
}

/// Input of the object's frequency response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Excitation {
    /// Overload n_X along the rotor, in g (four-state element).
    OverloadAlongRotor,
    /// Moment about the vertical, N m (six-state element).
    VerticalMoment,
}

/// Response of α′ to the element's excitation: excitation, numerator, denominator (highest power first).
pub fn object_response(plant: &Plant) -> (Excitation, Vec<f64>, Vec<f64>) {
    let (excitation, input) = match plant.element {
        Element::Four(p) => (Excitation::OverloadAlongRotor, vec![0.0, 0.0, 0.0, p.pendulum_N_m / p.inertia_z_kg_m2]),
        Element::Six(_) => (Excitation::VerticalMoment, plant.b()),
    };
    let (numerator, denominator) = transfer(&plant.a(), &input, 1);
    (excitation, numerator, denominator)
}

/// Transfer function from an input to a state: numerator and denominator, highest power first.
fn transfer(matrix: &[Vec<f64>], input: &[f64], state: usize) -> (Vec<f64>, Vec<f64>) {
    let (polynomial, adjoints) = Matrix::of(matrix).characteristic();
    let numerator: Vec<Exact> =
        adjoints.iter().map(|b| input.iter().enumerate().fold(exact(0.0), |sum, (j, x)| sum + b.at(state, j) * exact(*x))).collect();
    (numerator.iter().map(rounded).collect(), polynomial.iter().map(rounded).collect())
}

/// Value of a polynomial at s.
pub fn evaluate(polynomial: &[f64], s: Complex<f64>) -> Complex<f64> {
    polynomial.iter().fold(Complex::new(0.0, 0.0), |sum, c| sum * s + c)
}

fn bisect(good: f64, bad: f64, is_bad: impl Fn(f64) -> bool) -> f64 {
    let (mut good, mut bad) = (good, bad);
    for _ in 0..50 {
        let middle = (good * bad).sqrt();
        if is_bad(middle) { bad = middle } else { good = middle }
    }
    bad
}
