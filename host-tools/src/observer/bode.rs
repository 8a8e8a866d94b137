//! Where an observer's rate is the object's, over frequency (theory §2.2).
//!
//! R(jω) = α̂′/α′, whatever moved the element: 1 is no distortion. It is left at the first frequency at which |R| is off by more than 1 dB or its phase
//! by more than 5°. Transfer functions are polynomials worked out in 77 digits; rounded matrices lose them where gains are 10⁸.

use nalgebra::Complex;

use super::exact::{Exact, Matrix, exact, rounded};
use super::{Design, Element, Kind, ObserverError, Plant, Poles, Request};

/// Off by more than this, dB.
pub const MOST_DB: f64 = 1.0;
/// Or by more than this, degrees.
pub const MOST_DEG: f64 = 5.0;
/// Grid of the search, rad/s: from, to, points.
const GRID: (f64, f64, usize) = (0.01, 1e4, 24_001);

/// Where distortion begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// Frequency, rad/s; `None` if nowhere below 10⁴.
    pub rad_s: Option<f64>,
    /// It is so from the least frequency on.
    pub from_the_start: bool,
}

/// One observer over frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Bode {
    /// Where its poles lie, 1/s.
    pub omega_rad_s: f64,
    /// Its gains.
    pub gains: Vec<f64>,
    /// Numerator of α̂′ over the angle, highest power first.
    pub numerator: Vec<f64>,
    /// Denominator.
    denominator: Vec<f64>,
    /// Where distortion begins.
    pub limit: Limit,
    /// Greatest |α̂′/y|, 1/s, and where, rad/s: what becomes of noise.
    pub noise: (f64, f64),
}

impl Bode {
    /// Observers of one element for several ω₀.
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

    /// A designed observer over frequency.
    pub fn new(design: &Design, omega_rad_s: f64) -> Self {
        let (f, input) = design.observer();
        let (numerator, denominator) = transfer(&f, &input, 1);
        let mut bode = Self {
            omega_rad_s,
            gains: design.gains.clone(),
            numerator,
            denominator,
            limit: Limit { rad_s: None, from_the_start: false },
            noise: (0.0, 0.0),
        };
        let (from, to, points) = GRID;
        let grid: Vec<f64> = (0..points).map(|k| from * (to / from).powf(k as f64 / (points - 1) as f64)).collect();
        if let Some(k) = grid.iter().position(|w| bode.is_distorted(*w)) {
            let at = if k == 0 { grid[0] } else { bisect(grid[k - 1], grid[k], |w| bode.is_distorted(w)) };
            bode.limit = Limit { rad_s: Some(at), from_the_start: k == 0 };
        }
        bode.noise =
            grid.iter().map(|w| (bode.from_angle(*w).norm(), *w)).fold((0.0, 0.0), |most, next| if next.0 > most.0 { next } else { most });
        bode
    }

    /// α̂′ over the measured angle at a frequency.
    pub fn from_angle(&self, rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, rad_s);
        value(&self.numerator, s) / value(&self.denominator, s)
    }

    /// R = α̂′/α′ at a frequency.
    pub fn ratio(&self, rad_s: f64) -> Complex<f64> {
        self.from_angle(rad_s) / Complex::new(0.0, rad_s)
    }

    fn is_distorted(&self, rad_s: f64) -> bool {
        let r = self.ratio(rad_s);
        (20.0 * r.norm().log10()).abs() > MOST_DB || r.arg().to_degrees().abs() > MOST_DEG
    }
}

/// What moves the element, and how α′ answers: an overload along the rotor of the four-state model (n_X → α′), a moment about the vertical
/// of the other.
pub fn object(plant: &Plant) -> (&'static str, Vec<f64>, Vec<f64>) {
    let (says, input) = match plant.element {
        Element::Four(p) => ("overload along the rotor, in g", vec![0.0, 0.0, 0.0, p.pendulum_N_m / p.inertia_z_kg_m2]),
        Element::Six(_) => ("moment about the vertical, in N m", plant.b()),
    };
    let (numerator, denominator) = transfer(&plant.a(), &input, 1);
    (says, numerator, denominator)
}

/// Numerator and denominator from an input to a state, highest power first.
fn transfer(matrix: &[Vec<f64>], input: &[f64], state: usize) -> (Vec<f64>, Vec<f64>) {
    let (polynomial, adjoints) = Matrix::of(matrix).characteristic();
    let numerator: Vec<Exact> =
        adjoints.iter().map(|b| input.iter().enumerate().fold(exact(0.0), |sum, (j, x)| sum + b.at(state, j) * exact(*x))).collect();
    (numerator.iter().map(rounded).collect(), polynomial.iter().map(rounded).collect())
}

/// A polynomial's value.
pub(crate) fn value(polynomial: &[f64], s: Complex<f64>) -> Complex<f64> {
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
