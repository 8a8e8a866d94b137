//! Recursive least squares in constant memory, with standard errors for autocorrelated residuals.
//!
//! In: one vector z per window, of the dependent variable and the regressors; `None` for a window that is left out. Stored are the sums
//! Σ z_t z_{t−l}ᵀ for the lags l = 0 … L − 1; all windows have equal weight until a restart. Any regression among the elements of z can be
//! solved from the sums, and the autocovariance of its residuals follows exactly.
//!
//! Standard errors are those of Newey and West (1987): Cov = (XᵀX)⁻¹ Ω (XᵀX)⁻¹ with Ω = Σ_l w_l C_l Σ_t x_t x_{t−l}ᵀ, C_l the
//! autocovariance of the residuals and w_l Bartlett's weights. Overlapping windows and lasting misfits are thereby not counted as
//! independent.

use super::matrix::{Matrix, solve};

/// The sums. `N` elements in z, `L` lags including lag 0.
#[derive(Clone, Copy, Debug)]
pub struct LeastSquares<const N: usize, const L: usize> {
    sums: [Matrix<N, N>; L],
    /// The last vectors, newest first; zeros for windows left out.
    last: [[f64; N]; L],
    count: u32,
}

impl<const N: usize, const L: usize> Default for LeastSquares<N, L> {
    fn default() -> Self {
        Self { sums: [Matrix::zero(); L], last: [[0.0; N]; L], count: 0 }
    }
}

/// One element of z as a regressor, with a sign.
#[derive(Clone, Copy, Debug)]
pub struct Regressor {
    /// Index of the element.
    pub element: usize,
    /// Whether it enters with the opposite sign.
    pub is_negative: bool,
    /// Prior of its coefficient about 0, 1 σ; infinite: none.
    pub prior_sigma: f64,
}

impl Regressor {
    /// An element without a prior.
    pub const fn plus(element: usize) -> Self {
        Self { element, is_negative: false, prior_sigma: f64::INFINITY }
    }

    /// An element with the opposite sign, without a prior.
    pub const fn minus(element: usize) -> Self {
        Self { is_negative: true, ..Self::plus(element) }
    }

    /// A value with the regressor's sign; without a multiplication, which costs the chip 40 instructions in double precision.
    fn signed(&self, value: f64) -> f64 {
        if self.is_negative { -value } else { value }
    }
}

/// Solution of a regression.
#[derive(Clone, Copy, Debug)]
pub struct Solution<const N: usize, const P: usize> {
    /// The coefficients.
    pub coefficients: [f64; P],
    regressors: [Regressor; P],
    inverse: Matrix<P, P>,
    /// The residual as a combination of the elements of z.
    residual: [f64; N],
    variance: f64,
}

impl<const N: usize, const L: usize> LeastSquares<N, L> {
    /// Adds a window; `None`: a window left out.
    pub fn add(&mut self, z: Option<[f64; N]>) {
        self.last.rotate_right(1);
        if let Some(newest) = self.last.first_mut() {
            *newest = z.unwrap_or([0.0; N]);
        }
        let Some(z) = z else { return };
        self.count = self.count.saturating_add(1);
        for (sum, before) in self.sums.iter_mut().zip(&self.last) {
            sum.add_product(&z, before);
        }
    }

    /// Number of windows used.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Regression of element 0 of z on these regressors; `None` if they are collinear or the windows too few.
    #[inline(never)]
    pub fn solve<const P: usize>(&self, regressors: [Regressor; P]) -> Option<Solution<N, P>> {
        let freedom = f64::from(self.count) - P as f64;
        let sums = self.sums.first().filter(|_| freedom >= 1.0)?;
        let pick = |a: &Regressor, b: &Regressor| a.signed(b.signed(sums.at(a.element, b.element)));
        let normal = Matrix::<P, P>::from_fn(|a, b| regressors.get(a).zip(regressors.get(b)).map_or(0.0, |(a, b)| pick(a, b)));
        let right: [f64; P] = core::array::from_fn(|a| regressors.get(a).map_or(0.0, |a| a.signed(sums.at(a.element, 0))));
        // The weight of a prior depends on the noise, so both are found by iteration.
        let mut variance = 0.0;
        let mut solution = None;
        for _ in 0..4 {
            let mut weighted = normal;
            for (k, regressor) in regressors.iter().enumerate().filter(|(_, r)| r.prior_sigma.is_finite()) {
                // A small weight at first, so that a coefficient that only the prior determines does not make the matrix singular.
                let min_weight = f64::max(1e-9 * normal.at(k, k), 1e-30);
                weighted.add(k, k, f64::max(variance / (regressor.prior_sigma * regressor.prior_sigma), min_weight));
            }
            let (coefficients, inverse) = solve(&weighted, &right)?;
            let mut residual: [f64; N] = core::array::from_fn(|k| if k == 0 { 1.0 } else { 0.0 });
            for (coefficient, regressor) in coefficients.iter().zip(&regressors) {
                if let Some(weight) = residual.get_mut(regressor.element) {
                    *weight -= regressor.signed(*coefficient);
                }
            }
            let before = variance;
            variance = f64::max(sums.form(&residual, &residual), 0.0) / freedom;
            solution = Some(Solution { coefficients, regressors, inverse, residual, variance });
            if libm::fabs(variance - before) <= 1e-3 * variance {
                break;
            }
        }
        solution
    }

    /// Covariance of the coefficients of two solutions; `same`: of one solution.
    #[inline(never)]
    pub fn covariance<const P: usize, const Q: usize>(&self, a: &Solution<N, P>, b: &Solution<N, Q>, same: bool) -> Matrix<P, Q> {
        let mut omega = Matrix::<P, Q>::zero();
        let windows = f64::from(self.count.max(1));
        for (lag, sums) in self.sums.iter().enumerate() {
            let weight = 1.0 - lag as f64 / L as f64;
            let pick = |p: usize, q: usize, earlier: bool| {
                let (Some(p), Some(q)) = (a.regressors.get(p), b.regressors.get(q)) else { return 0.0 };
                p.signed(q.signed(if earlier { sums.at(q.element, p.element) } else { sums.at(p.element, q.element) }))
            };
            // Both (t, t − l) and (t − l, t).
            let later = weight * sums.form(&a.residual, &b.residual) / windows;
            omega.add_fn(|p, q| later * pick(p, q, false));
            if lag > 0 {
                let earlier = if same { later } else { weight * sums.form(&b.residual, &a.residual) / windows };
                omega.add_fn(|p, q| earlier * pick(p, q, true));
            }
        }
        if same {
            // A prior is one more observation with its own error.
            for (k, regressor) in a.regressors.iter().enumerate().filter(|(_, r)| r.prior_sigma.is_finite()) {
                omega.add(k, k, a.variance * a.variance / (regressor.prior_sigma * regressor.prior_sigma));
            }
        }
        a.inverse.times(&omega).times(&b.inverse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise from a small generator, uniform with the variance 1.
    fn noise(state: &mut u64) -> f64 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((*state >> 33) as f64 / f64::from(1_u32 << 31) - 0.5) * 12_f64.sqrt()
    }

    /// y = 2 a − 3 b + error, 400 windows; the error is the mean of `colour` neighbours.
    fn run(seed: u64, colour: usize) -> ([f64; 2], [f64; 2]) {
        let mut state = seed;
        let mut sums = LeastSquares::<3, 10>::default();
        let raw: Vec<f64> = (0..420).map(|_| noise(&mut state)).collect();
        let mut slow = 0.0;
        for t in 0..400 {
            // A regressor as autocorrelated as the error.
            slow = 0.8 * slow + noise(&mut state);
            let (a, b) = (slow, 1.0 + noise(&mut state));
            let error = raw[t..t + colour].iter().sum::<f64>() * 0.1;
            sums.add(Some([2.0 * a - 3.0 * b + error, a, b]));
            if t % 50 == 17 {
                sums.add(None);
            }
        }
        assert_eq!(sums.count(), 400);
        let solution = sums.solve([Regressor::plus(1), Regressor::minus(2)]).unwrap();
        let covariance = sums.covariance(&solution, &solution, true);
        (solution.coefficients, [covariance.at(0, 0).sqrt(), covariance.at(1, 1).sqrt()])
    }

    #[test]
    fn standard_errors_hold_for_white_and_for_coloured_noise() {
        for colour in [1, 5] {
            let mut squares = [0.0; 2];
            for seed in 1..=200 {
                let (found, sigma) = run(seed, colour);
                for (k, truth) in [2.0, 3.0].into_iter().enumerate() {
                    squares[k] += ((found[k] - truth) / sigma[k]).powi(2) / 200.0;
                }
            }
            // 200 draws give a variance to 10 %; Bartlett's weights leave out a tenth of the correlation.
            assert!(squares.iter().all(|s| (0.65..1.5).contains(s)), "colour {colour}: {squares:?}");
        }
    }

    #[test]
    fn a_prior_keeps_its_uncertainty_and_collinear_regressors_are_refused() {
        let mut sums = LeastSquares::<3, 4>::default();
        let mut state = 5;
        for _ in 0..300 {
            let a = 1.0 + 0.5 * noise(&mut state);
            // Both regressors are equal, as friction and offset are with rotation in one direction.
            sums.add(Some([2.0 * a + 0.01 * noise(&mut state), a, a]));
        }
        assert!(sums.solve([Regressor::plus(1), Regressor::plus(2)]).is_none());
        let offset = Regressor { prior_sigma: 0.1, ..Regressor::plus(2) };
        let solution = sums.solve([Regressor::plus(1), offset]).unwrap();
        let covariance = sums.covariance(&solution, &solution, true);
        assert!((solution.coefficients[0] - 2.0).abs() < 0.01 && solution.coefficients[1].abs() < 0.01, "{:?}", solution.coefficients);
        assert!((covariance.at(0, 0).sqrt() - 0.1).abs() < 0.01, "{}", covariance.at(0, 0).sqrt());
    }
}
