//! The exact discrete form, designed in z (docs/theory.md §1.6). The firmware runs this form.

use nalgebra::Complex;
use stand_firmware::config::ConfigError;
use stand_firmware::gyro_loop::observer::Design as Law;

use super::exact::{Matrix, exact, gains, rounded};
use super::poles::polynomial;
use super::request::{Integral, Kind, Request, augmented};
use super::{ObserverError, Plant};

/// x̂\[n+1\] = Φ x̂\[n\] + Γ M_K\[n\] + K (y\[n\] − x̂₁\[n\]); the last state of an astatic observer is the estimated moment, N m.
#[derive(Debug, Clone, PartialEq)]
pub struct Discrete {
    /// Step, s.
    pub step_s: f64,
    /// Φ.
    pub phi: Vec<Vec<f64>>,
    /// Γ, per N m.
    pub gamma: Vec<f64>,
    /// K.
    pub gains: Vec<f64>,
    /// The last state is the estimated moment.
    pub has_disturbance: bool,
}

impl Discrete {
    /// The discrete form of a request whose continuous poles are `placed`.
    ///
    /// # Errors
    /// The step is out of range; the plant is not observable at this step; the firmware rejects the design.
    pub(super) fn new(request: &Request, placed: &[Complex<f64>], integral: Option<Integral>, step_s: f64) -> Result<Self, ObserverError> {
        if !(step_s.is_finite() && step_s > 0.0 && step_s <= 10.0) {
            return Err(ObserverError::StepRange(step_s));
        }
        let at_step = |why: &str| ObserverError::Step { step_s, why: why.to_owned() };
        let plant = &request.plant;
        let n = plant.states().len();
        let b = plant.b();
        let of_augmented = request.kind == Kind::Augmented;
        let model = if of_augmented { augmented(plant) } else { Matrix::of(&plant.a()) };
        let input: Vec<f64> = b.iter().copied().chain(of_augmented.then_some(0.0)).collect();
        let (phi, gamma) = held(&model, &input, step_s);
        // Rounding the poles is harmless as long as equal poles stay equal.
        let in_z = placed.iter().map(|pole| {
            let z = (pole * step_s).exp();
            (exact(z.re), exact(if pole.im == 0.0 { 0.0 } else { z.im }))
        });
        let wanted = polynomial(&in_z.collect::<Vec<_>>());
        let found = gains(&phi, &wanted).ok_or_else(|| at_step("the angle does not make all states observable"))?;
        let mut discrete =
            Self { step_s, phi: phi.rounded(), gamma, gains: found.iter().map(rounded).collect(), has_disturbance: of_augmented };
        if let (Kind::Integral { .. }, Some(channel)) = (request.kind, integral) {
            discrete.add_channel(plant, channel, n);
        }
        discrete.check().map_err(|wrong| at_step(&wrong.to_string()))?;
        Ok(discrete)
    }

    /// Appends the integral as a state in N m. The moment of the channel acts during the whole step, as in the plant.
    fn add_channel(&mut self, plant: &Plant, channel: Integral, n: usize) {
        let mut into = vec![0.0; n];
        into[channel.row - 1] = channel.gain / channel.moment_per_integral;
        let (_, column) = held(&Matrix::of(&plant.a()), &into, self.step_s);
        for (row, entry) in self.phi.iter_mut().zip(column) {
            row.push(entry);
        }
        let mut last = vec![0.0; n + 1];
        last[n] = 1.0;
        self.phi.push(last);
        self.gamma.push(0.0);
        self.gains.push(channel.moment_per_integral * self.step_s);
        self.has_disturbance = true;
    }

    /// Checks the design with the firmware's own code.
    ///
    /// # Errors
    /// The firmware rejects it.
    pub fn check(&self) -> Result<(), ConfigError> {
        match self.gains.len() {
            4 => self.law::<4>().map(drop),
            5 => self.law::<5>().map(drop),
            6 => self.law::<6>().map(drop),
            7 => self.law::<7>().map(drop),
            _ => Err(ConfigError::Unfit("states", "must be 4 to 7")),
        }
    }

    /// The firmware's observer law in double precision.
    ///
    /// # Errors
    /// The firmware rejects it.
    pub fn law<const N: usize>(&self) -> Result<Law<f64, N>, ConfigError> {
        let (phi, gamma, gains) = self.numbers();
        Law::new(&phi, &gamma, &gains)
    }

    /// Φ, Γ, K as arrays of `N`.
    pub(super) fn numbers<const N: usize>(&self) -> ([[f64; N]; N], [f64; N], [f64; N]) {
        let get = |list: &[f64], i: usize| list.get(i).copied().unwrap_or(0.0);
        (
            std::array::from_fn(|i| std::array::from_fn(|j| self.phi.get(i).map_or(0.0, |row| get(row, j)))),
            std::array::from_fn(|i| get(&self.gamma, i)),
            std::array::from_fn(|i| get(&self.gains, i)),
        )
    }
}

/// Φ = e^(A h) and Γ = ∫ e^(A s) ds b: zero-order hold of the input.
pub(super) fn held(a: &Matrix, b: &[f64], step_s: f64) -> (Matrix, Vec<f64>) {
    let n = b.len();
    let both = Matrix::new(n + 1, n + 1, |i, j| match (i == n, j == n) {
        (true, _) => exact(0.0),
        (false, true) => exact(b[i]) * exact(step_s),
        (false, false) => a.at(i, j) * exact(step_s),
    });
    let power = both.exp();
    let phi = Matrix::new(n, n, |i, j| power.at(i, j).clone());
    (phi, (0..n).map(|i| rounded(power.at(i, n))).collect())
}
