//! Small matrices with 77 decimal digits.
//!
//! The observability matrix of six or seven states at a step of 1 ms loses about 17 digits, and Ackermann's formula amplifies the error
//! (docs/theory.md §1.6 requires 30 digits). Polynomials, exponentials and gains are computed here and rounded once, at the end.

use dashu_float::FBig;
use dashu_float::round::mode::HalfEven;
use identification::statistics::Extremes;

/// Binary digits.
const DIGITS: usize = 256;
/// Largest entry of the last term of the exponential's Taylor series.
const TAYLOR_REMAINDER: f64 = 1e-85;

/// A number with 256 binary digits.
pub(super) type Exact = FBig<HalfEven, 2>;

/// Converts a double; NaN becomes 0.
pub(super) fn exact(value: f64) -> Exact {
    let number = Exact::try_from(value).unwrap_or(Exact::ZERO);
    number.with_precision(DIGITS).value()
}

/// The nearest double.
pub(super) fn rounded(value: &Exact) -> f64 {
    value.to_f64().value()
}

/// A matrix, stored by rows.
#[derive(Clone, Debug)]
pub(super) struct Matrix {
    rows: usize,
    columns: usize,
    entries: Vec<Exact>,
}

impl Matrix {
    pub(super) fn new(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> Exact) -> Self {
        let entries = (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect();
        Self { rows, columns, entries }
    }

    pub(super) fn of(rows: &[Vec<f64>]) -> Self {
        Self::new(rows.len(), rows.first().map_or(0, Vec::len), |i, j| exact(rows[i][j]))
    }

    pub(super) fn identity(size: usize) -> Self {
        Self::new(size, size, |i, j| exact(if i == j { 1.0 } else { 0.0 }))
    }

    pub(super) fn at(&self, i: usize, j: usize) -> &Exact {
        &self.entries[i * self.columns + j]
    }

    pub(super) fn times(&self, other: &Self) -> Self {
        Self::new(self.rows, other.columns, |i, j| {
            (0..self.columns).fold(exact(0.0), |sum, k| {
                let (a, b) = (self.at(i, k), other.at(k, j));
                // Most entries of a model are zero.
                if *a == Exact::ZERO || *b == Exact::ZERO { sum } else { sum + a * b }
            })
        })
    }

    /// `self` + `factor` · `other`.
    pub(super) fn plus(&self, factor: &Exact, other: &Self) -> Self {
        Self::new(self.rows, self.columns, |i, j| self.at(i, j) + factor * other.at(i, j))
    }

    pub(super) fn scaled(&self, factor: &Exact) -> Self {
        Self::new(self.rows, self.columns, |i, j| factor * self.at(i, j))
    }

    pub(super) fn trace(&self) -> Exact {
        (0..self.rows).fold(exact(0.0), |sum, k| sum + self.at(k, k))
    }

    pub(super) fn rounded(&self) -> Vec<Vec<f64>> {
        (0..self.rows).map(|i| (0..self.columns).map(|j| rounded(self.at(i, j))).collect()).collect()
    }

    fn largest(&self) -> f64 {
        self.entries.iter().map(|x| rounded(x).abs()).max_or_zero()
    }

    /// Matrix exponential by scaling and squaring with a Taylor series.
    pub(super) fn exp(&self) -> Self {
        let squarings = (self.largest() * self.rows as f64).max(1.0).log2().ceil() as i32 + 4;
        let part = self.scaled(&exact(0.5f64.powi(squarings)));
        let (mut sum, mut term) = (Self::identity(self.rows), Self::identity(self.rows));
        for k in 1..200 {
            term = term.times(&part).scaled(&(exact(1.0) / exact(f64::from(k))));
            sum = sum.plus(&exact(1.0), &term);
            if term.largest() < TAYLOR_REMAINDER {
                break;
            }
        }
        (0..squarings).fold(sum, |power, _| power.times(&power))
    }

    /// Solution x of `self` x = `right`; `None` if the matrix is singular.
    pub(super) fn solve(&self, right: &[Exact]) -> Option<Vec<Exact>> {
        let n = self.rows;
        let mut rows: Vec<Vec<Exact>> = (0..n).map(|i| (0..n).map(|j| self.at(i, j).clone()).chain([right[i].clone()]).collect()).collect();
        for k in 0..n {
            let size = |row: &Vec<Exact>| rounded(&row[k]).abs();
            let pivot = (k..n).max_by(|a, b| size(&rows[*a]).total_cmp(&size(&rows[*b])))?;
            rows.swap(k, pivot);
            if rows[k][k] == Exact::ZERO {
                return None;
            }
            let lead = rows[k].clone();
            for row in rows.iter_mut().skip(k + 1) {
                let factor = &row[k] / &lead[k];
                for j in k..=n {
                    row[j] = &row[j] - &factor * &lead[j];
                }
            }
        }
        let mut x = vec![exact(0.0); n];
        for k in (0..n).rev() {
            let known = (k + 1..n).fold(rows[k][n].clone(), |sum, j| sum - &rows[k][j] * &x[j]);
            x[k] = known / &rows[k][k];
        }
        Some(x)
    }

    /// The characteristic polynomial det(pE − A), highest power first, and the matrices of adj(pE − A) = Σ Bₖ p^(n−1−k) (Faddeev and
    /// LeVerrier).
    pub(super) fn characteristic(&self) -> (Vec<Exact>, Vec<Matrix>) {
        let n = self.rows;
        let mut polynomial = vec![exact(1.0)];
        let mut adjoints = vec![Self::identity(n)];
        for k in 1..=n {
            let product = self.times(&adjoints[k - 1]);
            let coefficient = -product.trace() / exact(k as f64);
            if k < n {
                adjoints.push(product.plus(&coefficient, &Self::identity(n)));
            }
            polynomial.push(coefficient);
        }
        (polynomial, adjoints)
    }
}

/// Observer gains K for which A − K C has the given characteristic polynomial (highest power first), by Ackermann's formula. C selects the
/// first state. `None` if the plant is not observable.
pub(super) fn gains(a: &Matrix, polynomial: &[Exact]) -> Option<Vec<Exact>> {
    let n = a.rows;
    let mut row = Matrix::new(1, n, |_, j| exact(if j == 0 { 1.0 } else { 0.0 }));
    let mut rows = Vec::new();
    for _ in 0..n {
        rows.push(row.clone());
        row = row.times(a);
    }
    let observability = Matrix::new(n, n, |i, j| rows[i].at(0, j).clone());
    let last: Vec<Exact> = (0..n).map(|k| exact(if k + 1 == n { 1.0 } else { 0.0 })).collect();
    let column = observability.solve(&last)?;
    // P(A) · column, by Horner's rule on vectors.
    let column = Matrix::new(n, 1, |i, _| column[i].clone());
    let mut sum = column.scaled(&polynomial[0]);
    for coefficient in &polynomial[1..] {
        sum = a.times(&sum).plus(coefficient, &column);
    }
    Some((0..n).map(|i| sum.at(i, 0).clone()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_of_a_rotation_is_a_rotation() {
        let turn = Matrix::of(&[vec![0.0, -30.0], vec![30.0, 0.0]]).exp().rounded();
        assert!((turn[0][0] - 30f64.cos()).abs() < 1e-15 && (turn[1][0] - 30f64.sin()).abs() < 1e-15, "{turn:?}");
    }

    #[test]
    fn seven_equal_poles_are_placed_exactly() {
        // A chain of integrators: the gains are binomial coefficients.
        let chain = Matrix::new(7, 7, |i, j| exact(if j == i + 1 { 1.0 } else { 0.0 }));
        let binomial: Vec<Exact> = [1.0, 7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0].map(exact).to_vec();
        let found: Vec<f64> = gains(&chain, &binomial).unwrap_or_default().iter().map(rounded).collect();
        assert_eq!(found, [7.0, 21.0, 35.0, 35.0, 21.0, 7.0, 1.0]);
    }
}
