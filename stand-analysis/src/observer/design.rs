//! Design of an observer: gains by Ackermann's formula, integral channel, observability.

use nalgebra::{Complex, DMatrix};

use super::exact::{Exact, Matrix, exact, gains, rounded};
use super::poles::{multiplied, polynomial, roots};
use super::request::augmented;
use super::{Discrete, Integral, Kind, ObserverError, Plant, Request};
use identification::statistics::Extremes;

/// Smallest ratio of a singular value to the largest that counts for the rank: no sensor resolves one part in 10¹³.
const MIN_RELATIVE_SINGULAR_VALUE: f64 = 1e-13;

/// A designed observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// The request.
    pub request: Request,
    /// Gains K, one per state.
    pub gains: Vec<f64>,
    /// Integral channel of an astatic observer.
    pub integral: Option<Integral>,
    /// All poles of the observer, slowest first, 1/s.
    pub poles: Vec<Complex<f64>>,
    /// Condition number of the observability matrix in scaled states, rows normalised to 1.
    pub condition: f64,
    /// Rank of the observability matrix.
    pub rank: usize,
    /// The exact discrete form.
    pub discrete: Option<Discrete>,
}

impl Request {
    /// Designs the observer.
    ///
    /// # Errors
    /// Unstable poles or a wrong number of them; a model that is not observable; an integral channel that is unstable or cannot remove the
    /// offset; a discrete form that the firmware rejects.
    pub fn design(self) -> Result<Design, ObserverError> {
        let n = self.plant.states().len();
        let count = n + usize::from(self.kind == Kind::Augmented);
        let placed = self.poles.list(count, self.kind.name())?;
        let (rank, condition) = observability(&self.plant, &placed);
        let singular = |plant: &Plant| ObserverError::Singular { rank, states: n, condition, hint: hint(plant) };
        if rank < n {
            return Err(singular(&self.plant));
        }
        let a = Matrix::of(&self.plant.a());
        let wanted = polynomial(&placed.iter().map(|z| (exact(z.re), exact(z.im))).collect::<Vec<_>>());
        let of = if self.kind == Kind::Augmented { &augmented(&self.plant) } else { &a };
        let all = gains(of, &wanted).ok_or_else(|| singular(&self.plant))?;
        let k: Vec<f64> = all[..n].iter().map(rounded).collect();
        if k.iter().any(|gain| !gain.is_finite()) {
            return Err(singular(&self.plant));
        }
        let (inertia, _) = self.plant.vertical_inertia_and_rotor();
        let (integral, poles) = match self.kind {
            Kind::Static => (None, placed.clone()),
            Kind::Augmented => {
                let moment = rounded(&all[n]);
                let channel = Integral { row: 2, gain: moment / inertia, moment_per_integral: moment, stable_below: None };
                (Some(channel), placed.clone())
            }
            Kind::Integral { row, gain } => {
                let channel = channel(&self.plant, &a, &all, &wanted, row, gain)?;
                (Some(channel.0), channel.1)
            }
        };
        let discrete = self.step_s.map(|step_s| Discrete::new(&self, &placed, integral, step_s)).transpose()?;
        Ok(Design { request: self, gains: k, integral, poles, condition, rank, discrete })
    }
}

impl Design {
    /// Matrix F and input L of x̂′ = F x̂ + L y, with the integral as the last state if there is one.
    pub(super) fn observer(&self) -> (Vec<Vec<f64>>, Vec<f64>) {
        let mut f = self.request.plant.a();
        let n = f.len();
        let mut input = self.gains.clone();
        for (row, k) in f.iter_mut().zip(&self.gains) {
            row[0] -= k;
        }
        if let Some(integral) = self.integral {
            for (i, row) in f.iter_mut().enumerate() {
                row.push(if i + 1 == integral.row { integral.gain } else { 0.0 });
            }
            let mut last = vec![0.0; n + 1];
            last[0] = -1.0;
            f.push(last);
            input.push(1.0);
        }
        (f, input)
    }
}

/// Rank and condition of C, C A/ω, C (A/ω)², …, ω the poles' mean size; rates over ω, the displacement over the arm, so that no unit
/// counts.
fn observability(plant: &Plant, poles: &[Complex<f64>]) -> (usize, f64) {
    let omega = poles.iter().map(|z| z.norm()).sum::<f64>() / poles.len().max(1) as f64;
    let (a, n) = (plant.a(), plant.states().len());
    let arm = match plant.element {
        super::Element::Six(p) => p.arm_m,
        super::Element::Four(_) => 1.0,
    };
    let unit = |k: usize| if k % 2 == 1 { omega } else { 1.0 } * if k >= 4 { arm } else { 1.0 };
    let scaled = DMatrix::from_fn(n, n, |i, j| a[i][j] / omega * unit(j) / unit(i));
    let mut row = DMatrix::from_fn(1, n, |_, j| if j == 0 { 1.0 } else { 0.0 });
    let mut all = DMatrix::zeros(n, n);
    for i in 0..n {
        // Each row by itself: how fast the powers grow says nothing.
        let norm = row.norm();
        all.set_row(i, &(row.row(0) / if norm > 0.0 { norm } else { 1.0 }));
        row = &row * &scaled;
    }
    if all.iter().any(|x: &f64| !x.is_finite()) {
        return (0, f64::INFINITY);
    }
    let values = all.singular_values();
    let (most, least) = (values.max(), values.min());
    (values.iter().filter(|v| **v > MIN_RELATIVE_SINGULAR_VALUE * most).count(), most / least)
}

fn hint(plant: &Plant) -> &'static str {
    match plant.element {
        super::Element::Six(_) => "look at rotor_N_m_s, arm_m and suspension_N_per_m",
        super::Element::Four(_) => "look at rotor_N_m_s and pendulum_N_m",
    }
}

/// The integral channel, and where all poles lie then.
fn channel(
    plant: &Plant,
    a: &Matrix,
    k: &[Exact],
    placed: &[Exact],
    row: usize,
    gain: Option<f64>,
) -> Result<(Integral, Vec<Complex<f64>>), ObserverError> {
    let n = plant.states().len();
    if row == 0 || row > n {
        return Err(ObserverError::RowRange { row, states: n });
    }
    let (_, adjoints) = a.characteristic();
    // det(pE − A + K C + κ e_r C/p) = P(p) + κ n_r(p)/p, n_r an entry of the adjoint (theory §1.5).
    let n_of = |row: usize| -> Vec<Exact> { adjoints.iter().map(|b| b.at(0, row - 1).clone()).collect() };
    let finds = |row: usize| {
        let n_r = n_of(row);
        let largest = n_r.iter().map(|c| rounded(c).abs()).max_or_zero();
        n_r.last().is_some_and(|c| rounded(c).abs() > 1e-30 * largest)
    };
    if !finds(row) {
        let rows: Vec<String> = (1..=n).filter(|row| finds(*row)).map(|row| row.to_string()).collect();
        return Err(ObserverError::Row(row, rows.join(", ")));
    }
    let gain = gain.unwrap_or_else(|| rounded(&k[row - 1]).abs());
    if !gain.is_finite() {
        return Err(ObserverError::Gain(gain));
    }
    let n_r = n_of(row);
    let base: Vec<f64> = multiplied(placed, &[exact(1.0), exact(0.0)]).iter().map(rounded).collect();
    let poles = |kappa: f64| {
        let mut sum = base.clone();
        for (place, coefficient) in n_r.iter().enumerate() {
            // n_r is one degree below P, p P one above.
            sum[place + 2] += kappa * rounded(coefficient);
        }
        roots(&sum)
    };
    let largest = |kappa: f64| poles(kappa).first().map_or(f64::NAN, |z| z.re);
    let most = stable_below(&largest, gain.abs());
    let found = poles(gain);
    let pole = found.first().map_or(f64::NAN, |z| z.re);
    if !(pole < 0.0 && gain != 0.0) {
        return Err(ObserverError::Unstable { gain, row, pole, most });
    }
    // Equilibrium under a moment of 1: e′ = (A − K C) e − e_r κ z + B M = 0, C e = 0.
    let b = plant.b();
    let rest = Matrix::new(n + 1, n + 1, |i, j| match (i == n, j == n) {
        (true, false) => exact(if j == 0 { 1.0 } else { 0.0 }),
        (true, true) => exact(0.0),
        (false, true) => exact(if i + 1 == row { -gain } else { 0.0 }),
        (false, false) if j == 0 => a.at(i, 0) - &k[i],
        (false, false) => a.at(i, j).clone(),
    });
    let right: Vec<Exact> = b.iter().map(|b| exact(-b)).chain([exact(0.0)]).collect();
    let z = rest.solve(&right).map_or(f64::NAN, |x| rounded(&x[n]));
    Ok((Integral { row, gain, moment_per_integral: 1.0 / z, stable_below: Some(most) }, found))
}

/// Smallest positive gain at which a pole becomes unstable, to one part in 10⁶; 0 if the smallest tried gain is unstable.
fn stable_below(largest: &impl Fn(f64) -> f64, near: f64) -> f64 {
    let near = if near > 0.0 { near } else { 1.0 };
    let mut stable = near * 1e-6;
    if largest(stable) >= 0.0 {
        return 0.0;
    }
    let mut unstable = stable;
    while unstable < near * 1e12 {
        unstable *= 1.3;
        if largest(unstable) >= 0.0 {
            break;
        }
        stable = unstable;
    }
    if stable >= unstable {
        return f64::INFINITY;
    }
    for _ in 0..40 {
        let middle = (stable * unstable).sqrt();
        if largest(middle) < 0.0 { stable = middle } else { unstable = middle }
    }
    stable
}
