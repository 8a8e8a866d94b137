//! An observer: its gains by Ackermann, its integral channel, whether it can see all states.

use nalgebra::{Complex, DMatrix};

use super::exact::{Exact, Matrix, exact, gains, rounded};
use super::poles::{multiplied, polynomial, roots};
use super::{Discrete, ObserverError, Plant, Poles};
use crate::statistics::Extremes;

/// Singular values below this share of the greatest are none: of a number in 10¹³ no sensor tells anything.
const LEAST_SINGULAR: f64 = 1e-13;

/// Which observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Without an integral channel: a constant disturbance leaves an offset (theory §1.4).
    Static,
    /// The static gains and an integral of the error that feeds one row, counted from 1; its gain is that row's own, without sign, where none is
    /// given (theory §1.5).
    Integral {
        /// Row of the channel, 1 … states.
        row: usize,
        /// Its gain κ.
        gain: Option<f64>,
    },
    /// The disturbance is one state more, and all poles are placed (theory §1.5, P7).
    Augmented,
}

impl Kind {
    /// In a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Static => "static",
            Self::Integral { .. } => "integral",
            Self::Augmented => "augmented",
        }
    }
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The element.
    pub plant: Plant,
    /// Where the poles shall lie.
    pub poles: Poles,
    /// Which observer.
    pub kind: Kind,
    /// Step of the discrete form, s.
    pub step_s: Option<f64>,
    /// Highest frequency of vibration, Hz, for the warnings.
    pub vibration_Hz: Option<f64>,
}

/// The integral channel: x̂′ = … + e_row κ z, z′ = y − x̂₁.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integral {
    /// Row that it feeds, from 1.
    pub row: usize,
    /// κ.
    pub gain: f64,
    /// Estimated moment per integral, N m/(rad s): M̂ = this · z.
    pub moment_per_integral: f64,
    /// Up to which gain the channel is stable with these gains; of an augmented observer nobody asks.
    pub stable_below: Option<f64>,
}

/// An observer.
#[derive(Debug, Clone, PartialEq)]
pub struct Design {
    /// What was asked for.
    pub request: Request,
    /// The gains K, a row for each state.
    pub gains: Vec<f64>,
    /// The integral channel of an astatic one.
    pub integral: Option<Integral>,
    /// All poles of the observer, the slowest first, 1/s.
    pub poles: Vec<Complex<f64>>,
    /// How well the angle tells the states apart: condition of the observability matrix, without units, rows of norm 1.
    pub condition: f64,
    /// Its rank.
    pub rank: usize,
    /// The exact discrete form.
    pub discrete: Option<Discrete>,
}

impl Request {
    /// Designs it.
    ///
    /// # Errors
    /// Poles that are not stable or too many; a model that the angle does not show; an integral channel that is unstable or useless; a step at
    /// which it is not stable.
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
        let (inertia, _) = self.plant.inertia_and_rotor();
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
    /// The observer's own matrix F and its input from the angle: x̂′ = F x̂ + L y, the integral as a last state if there is one.
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

/// The plant with a constant moment as one state more.
pub(super) fn augmented(plant: &Plant) -> Matrix {
    let (a, b) = (plant.a(), plant.b());
    let n = a.len();
    Matrix::new(n + 1, n + 1, |i, j| {
        exact(if i == n {
            0.0
        } else if j == n {
            b[i]
        } else {
            a[i][j]
        })
    })
}

/// Rank and condition of C, C A/ω, C (A/ω)², …, ω the poles' mean size; rates over ω, the displacement over the arm, so that no unit counts.
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
    (values.iter().filter(|v| **v > LEAST_SINGULAR * most).count(), most / least)
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
        return Err(ObserverError::Words(format!("row {row}: the integral channel feeds one of the rows 1 to {n}")));
    }
    let (_, adjoints) = a.characteristic();
    // det(pE − A + K C + κ e_r C/p) = P(p) + κ n_r(p)/p, n_r an entry of the adjoint (theory §1.5).
    let n_of = |row: usize| -> Vec<Exact> { adjoints.iter().map(|b| b.at(0, row - 1).clone()).collect() };
    let finds = |row: usize| {
        let n_r = n_of(row);
        let greatest = n_r.iter().map(|c| rounded(c).abs()).max_or_zero();
        n_r.last().is_some_and(|c| rounded(c).abs() > 1e-30 * greatest)
    };
    if !finds(row) {
        let rows: Vec<String> = (1..=n).filter(|row| finds(*row)).map(|row| row.to_string()).collect();
        return Err(ObserverError::Row(row, rows.join(", ")));
    }
    let gain = gain.unwrap_or_else(|| rounded(&k[row - 1]).abs());
    if !gain.is_finite() {
        return Err(ObserverError::Words(format!("integral gain {gain} is not a finite number")));
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
    let greatest = |kappa: f64| poles(kappa).first().map_or(f64::NAN, |z| z.re);
    let most = stable_below(&greatest, gain.abs());
    let found = poles(gain);
    let pole = found.first().map_or(f64::NAN, |z| z.re);
    if !(pole < 0.0 && gain != 0.0) {
        return Err(ObserverError::Unstable { gain, row, pole, most });
    }
    // Where all comes to rest under a moment of 1: e′ = (A − K C) e − e_r κ z + B M = 0, C e = 0.
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

/// The least gain above 0 at which a pole leaves, to a part in 10⁶; 0 where the smallest does.
fn stable_below(greatest: &impl Fn(f64) -> f64, near: f64) -> f64 {
    let near = if near > 0.0 { near } else { 1.0 };
    let mut stable = near * 1e-6;
    if greatest(stable) >= 0.0 {
        return 0.0;
    }
    let mut unstable = stable;
    while unstable < near * 1e12 {
        unstable *= 1.3;
        if greatest(unstable) >= 0.0 {
            break;
        }
        stable = unstable;
    }
    if stable >= unstable {
        return f64::INFINITY;
    }
    for _ in 0..40 {
        let middle = (stable * unstable).sqrt();
        if greatest(middle) < 0.0 { stable = middle } else { unstable = middle }
    }
    stable
}
