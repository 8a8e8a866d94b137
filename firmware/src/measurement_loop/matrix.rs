//! Small matrices of fixed size; no operation can panic.

/// A matrix of `P` rows and `Q` columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matrix<const P: usize, const Q: usize>([[f64; Q]; P]);

impl<const P: usize, const Q: usize> Matrix<P, Q> {
    /// All zeros.
    pub const fn zero() -> Self {
        Self([[0.0; Q]; P])
    }

    /// The matrix of `f(row, column)`.
    pub fn from_fn(f: impl Fn(usize, usize) -> f64) -> Self {
        Self(core::array::from_fn(|p| core::array::from_fn(|q| f(p, q))))
    }

    /// The element; 0 outside.
    pub fn at(&self, p: usize, q: usize) -> f64 {
        self.0.get(p).and_then(|row| row.get(q)).copied().unwrap_or(0.0)
    }

    /// Adds to an element.
    pub fn add(&mut self, p: usize, q: usize, value: f64) {
        if let Some(element) = self.0.get_mut(p).and_then(|row| row.get_mut(q)) {
            *element += value;
        }
    }

    /// Adds `f(row, column)` to each element.
    pub fn add_fn(&mut self, f: impl Fn(usize, usize) -> f64) {
        for (p, row) in self.0.iter_mut().enumerate() {
            for (q, element) in row.iter_mut().enumerate() {
                *element += f(p, q);
            }
        }
    }

    /// Adds a bᵀ.
    pub fn add_product(&mut self, a: &[f64; P], b: &[f64; Q]) {
        for (row, a) in self.0.iter_mut().zip(a) {
            for (element, b) in row.iter_mut().zip(b) {
                *element += a * b;
            }
        }
    }

    /// aᵀ M b; rows with a zero in a are left out.
    #[inline(never)]
    pub fn form(&self, a: &[f64; P], b: &[f64; Q]) -> f64 {
        self.0.iter().zip(a).filter(|(_, a)| **a != 0.0).map(|(row, a)| a * row.iter().zip(b).map(|(m, b)| m * b).sum::<f64>()).sum()
    }

    /// The product.
    pub fn times<const R: usize>(&self, other: &Matrix<Q, R>) -> Matrix<P, R> {
        let mut product = Matrix::zero();
        for (row, to) in self.0.iter().zip(&mut product.0) {
            for (m, from) in row.iter().zip(&other.0) {
                for (element, value) in to.iter_mut().zip(from) {
                    *element += m * value;
                }
            }
        }
        product
    }
}

/// Solves M x = b for a symmetric positive M by Gauss-Jordan elimination with scaled columns; also returns the inverse. `None` if two
/// columns agree to ten digits.
#[inline(never)]
pub fn solve<const P: usize>(m: &Matrix<P, P>, b: &[f64; P]) -> Option<([f64; P], Matrix<P, P>)> {
    /// Smallest pivot of the scaled matrix.
    const MIN_PIVOT: f64 = 1e-10;
    let scale: [f64; P] = core::array::from_fn(|k| 1.0 / libm::sqrt(m.at(k, k)));
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let scaled = |k: usize| scale.get(k).copied().unwrap_or(0.0);
    let mut left = Matrix::<P, P>::from_fn(|p, q| m.at(p, q) * scaled(p) * scaled(q));
    let mut inverse = Matrix::<P, P>::from_fn(|p, q| if p == q { 1.0 } else { 0.0 });
    for k in 0..P {
        let pivot = left.at(k, k);
        if pivot.is_nan() || pivot < MIN_PIVOT {
            return None;
        }
        let factors: [f64; P] = core::array::from_fn(|p| left.at(p, k));
        for matrix in [&mut left, &mut inverse] {
            let from = matrix.0.get(k)?.map(|v| v / pivot);
            for (p, (row, factor)) in matrix.0.iter_mut().zip(&factors).enumerate() {
                if p == k {
                    *row = from;
                } else {
                    row.iter_mut().zip(&from).for_each(|(v, f)| *v -= factor * f);
                }
            }
        }
    }
    let inverse = Matrix::from_fn(|p, q| inverse.at(p, q) * scaled(p) * scaled(q));
    let x = core::array::from_fn(|p| b.iter().enumerate().map(|(q, b)| inverse.at(p, q) * b).sum());
    Some((x, inverse))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solutions_satisfy_the_equation_and_collinear_columns_have_none() {
        let m = Matrix([[4e6, 1e3, 0.0], [1e3, 3.0, 0.5], [0.0, 0.5, 2.0]]);
        let (x, inverse) = solve(&m, &[1e3, 2.0, 3.0]).unwrap();
        for (p, b) in [1e3, 2.0, 3.0].into_iter().enumerate() {
            let back: f64 = (0..3).map(|q| m.at(p, q) * x[q]).sum();
            assert!((back - b).abs() < 1e-9 * b, "{back}");
        }
        let unit = m.times(&inverse);
        assert!((0..3).all(|p| (0..3).all(|q| (unit.at(p, q) - if p == q { 1.0 } else { 0.0 }).abs() < 1e-9)), "{unit:?}");
        assert_eq!(solve(&Matrix([[1.0, 2.0], [2.0, 4.0]]), &[1.0, 2.0]), None);
        assert_eq!(solve(&Matrix([[0.0]]), &[1.0]), None);
    }
}
