//! The scalars of the model: `f64`, and dual numbers that carry derivatives through the same equations.
//!
//! A [`Dual`] holds all its derivatives in an array, without a mark for absent ones, so that each operation is a short loop of fixed length
//! which the compiler vectorises. Forward differentiation: Griewank and Walther, Evaluating Derivatives, 2nd edition, 2008, chapter 3.

use crate::portable::Portable;
use std::cmp::Ordering;
use std::fmt::{Debug, Display};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

/// A scalar of the model. Comparisons and [`Scalar::re`] look at the value alone. Transcendental functions are those of `libm`, equal on
/// every machine ([`Portable`]).
pub trait Scalar:
    Portable
    + Copy
    + Debug
    + Display
    + Send
    + Sync
    + 'static
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + AddAssign<f64>
    + SubAssign<f64>
    + MulAssign<f64>
    + DivAssign<f64>
    + Sum
    + PartialEq
    + PartialOrd
    + PartialEq<f64>
    + PartialOrd<f64>
{
    /// The value, without derivatives.
    fn re(&self) -> f64;
    /// f(x) from the value and the slope of f at x = `self`.
    fn chain(self, value: f64, slope: f64) -> Self;
    /// 0.
    #[inline]
    fn zero() -> Self {
        Self::from(0.0)
    }
    /// 1.
    #[inline]
    fn one() -> Self {
        Self::from(1.0)
    }
    /// |x|; −x for −0.
    #[inline]
    fn abs(self) -> Self {
        if self.re().is_sign_positive() { self } else { -self }
    }
    /// ±1 with the sign of x, without derivatives.
    #[inline]
    fn signum(self) -> Self {
        Self::from(self.re().signum())
    }
    /// 1/x.
    #[inline]
    fn recip(self) -> Self {
        let inverse = self.re().recip();
        self.chain(inverse, -inverse * inverse)
    }
    /// √x.
    #[inline]
    fn sqrt(self) -> Self {
        let root = self.re().sqrt();
        self.chain(root, self.re().recip() * root * 0.5)
    }
    /// eˣ.
    #[inline]
    fn exp(self) -> Self {
        let exp = libm::exp(self.re());
        self.chain(exp, exp)
    }
    /// eˣ − 1.
    #[inline]
    fn exp_m1(self) -> Self {
        self.chain(libm::expm1(self.re()), libm::exp(self.re()))
    }
    /// ln x.
    #[inline]
    fn ln(self) -> Self {
        self.chain(libm::log(self.re()), self.re().recip())
    }
    /// log₁₀ x.
    #[inline]
    fn log10(self) -> Self {
        self.chain(libm::log10(self.re()), self.re().recip() / std::f64::consts::LN_10)
    }
    /// ln (1 + x).
    #[inline]
    fn ln_1p(self) -> Self {
        self.chain(libm::log1p(self.re()), (self.re() + 1.0).recip())
    }
    /// sin x.
    #[inline]
    fn sin(self) -> Self {
        let (sin, cos) = libm::sincos(self.re());
        self.chain(sin, cos)
    }
    /// cos x.
    #[inline]
    fn cos(self) -> Self {
        let (sin, cos) = libm::sincos(self.re());
        self.chain(cos, -sin)
    }
    /// tan x.
    #[inline]
    fn tan(self) -> Self {
        let tan = libm::tan(self.re());
        self.chain(tan, 1.0 + tan * tan)
    }
}

impl Scalar for f64 {
    #[inline]
    fn re(&self) -> f64 {
        *self
    }
    /// Without the slope, which costs an exponential.
    #[inline]
    fn exp_m1(self) -> Self {
        libm::expm1(self)
    }
    #[inline]
    fn chain(self, value: f64, _: f64) -> Self {
        value
    }
}

/// A value with `N` derivatives.
#[derive(Debug, Clone, Copy)]
pub struct Dual<const N: usize> {
    /// Value.
    pub re: f64,
    /// Derivatives by the unknowns, by index.
    pub slopes: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// `re` as unknown `index`: its derivative by itself is 1.
    pub fn unknown(re: f64, index: usize) -> Self {
        let mut slopes = [0.0; N];
        if let Some(slope) = slopes.get_mut(index) {
            *slope = 1.0;
        }
        Dual { re, slopes }
    }

    /// Each derivative from those of both operands.
    #[inline(always)]
    fn combined(re: f64, a: &Self, b: &Self, by: impl Fn(f64, f64) -> f64) -> Self {
        Dual { re, slopes: std::array::from_fn(|k| by(a.slopes[k], b.slopes[k])) }
    }

    /// The same value with each derivative changed.
    #[inline(always)]
    fn mapped(self, re: f64, by: impl Fn(f64) -> f64) -> Self {
        Dual { re, slopes: std::array::from_fn(|k| by(self.slopes[k])) }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    #[inline]
    fn re(&self) -> f64 {
        self.re
    }
    /// A derivative that is zero stays zero where the slope is infinite.
    #[inline]
    fn chain(self, value: f64, slope: f64) -> Self {
        if slope.is_finite() { self.mapped(value, |d| d * slope) } else { self.mapped(value, |d| if d == 0.0 { 0.0 } else { d * slope }) }
    }
}

impl<const N: usize> Portable for Dual<N> {
    #[inline]
    fn portable_sin_cos(self) -> (Self, Self) {
        let (sin, cos) = libm::sincos(self.re);
        (self.chain(sin, cos), self.chain(cos, -sin))
    }
    #[inline]
    fn portable_exp(self) -> Self {
        let exp = libm::exp(self.re);
        self.chain(exp, exp)
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline]
    fn from(re: f64) -> Self {
        Dual { re, slopes: [0.0; N] }
    }
}

impl<const N: usize> Display for Dual<N> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} + {:?} ε", self.re, self.slopes)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline]
    fn neg(self) -> Self {
        self.mapped(-self.re, |d| -d)
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, b: Self) -> Self {
        Self::combined(self.re + b.re, &self, &b, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, b: Self) -> Self {
        Self::combined(self.re - b.re, &self, &b, |a, b| a - b)
    }
}

#[allow(clippy::suspicious_arithmetic_impl, reason = "the rule of the product")]
impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, b: Self) -> Self {
        let (x, y) = (self.re, b.re);
        Self::combined(x * y, &self, &b, |a, b| a * y + b * x)
    }
}

#[allow(clippy::suspicious_arithmetic_impl, reason = "the rule of the quotient")]
impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, b: Self) -> Self {
        let (x, y, inverse) = (self.re, b.re, b.re.recip());
        Self::combined(x * inverse, &self, &b, |a, b| (a * y - b * x) * inverse * inverse)
    }
}

impl<const N: usize> Add<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn add(self, b: f64) -> Self {
        Dual { re: self.re + b, ..self }
    }
}

impl<const N: usize> Sub<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn sub(self, b: f64) -> Self {
        Dual { re: self.re - b, ..self }
    }
}

impl<const N: usize> Mul<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn mul(self, b: f64) -> Self {
        self.mapped(self.re * b, |d| d * b)
    }
}

impl<const N: usize> Div<f64> for Dual<N> {
    type Output = Self;
    #[inline]
    fn div(self, b: f64) -> Self {
        self.mapped(self.re / b, |d| d / b)
    }
}

macro_rules! assigning {
    ($($trait:ident::$method:ident by $operator:tt;)*) => {$(
        impl<const N: usize> $trait for Dual<N> {
            #[inline]
            fn $method(&mut self, b: Self) {
                *self = *self $operator b;
            }
        }
        impl<const N: usize> $trait<f64> for Dual<N> {
            #[inline]
            fn $method(&mut self, b: f64) {
                *self = *self $operator b;
            }
        }
    )*};
}
assigning! {
    AddAssign::add_assign by +;
    SubAssign::sub_assign by -;
    MulAssign::mul_assign by *;
    DivAssign::div_assign by /;
}

impl<const N: usize> Sum for Dual<N> {
    fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
        terms.fold(Self::zero(), |a, b| a + b)
    }
}

impl<const N: usize> PartialEq for Dual<N> {
    #[inline]
    fn eq(&self, b: &Self) -> bool {
        self.re == b.re
    }
}

impl<const N: usize> PartialEq<f64> for Dual<N> {
    #[inline]
    fn eq(&self, b: &f64) -> bool {
        self.re == *b
    }
}

impl<const N: usize> PartialOrd for Dual<N> {
    #[inline]
    fn partial_cmp(&self, b: &Self) -> Option<Ordering> {
        self.re.partial_cmp(&b.re)
    }
}

impl<const N: usize> PartialOrd<f64> for Dual<N> {
    #[inline]
    fn partial_cmp(&self, b: &f64) -> Option<Ordering> {
        self.re.partial_cmp(b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Value and derivatives by both unknowns of an expression, against central differences.
    fn agree(name: &str, dual: impl Fn(Dual<2>, Dual<2>) -> Dual<2>, plain: impl Fn(f64, f64) -> f64) {
        for (x, y) in [(0.7, 1.3), (0.2, -2.4), (1.9, 0.05)] {
            let found = dual(Dual::unknown(x, 0), Dual::unknown(y, 1));
            let h = 1e-6;
            let by = [(plain(x + h, y) - plain(x - h, y)) / (2.0 * h), (plain(x, y + h) - plain(x, y - h)) / (2.0 * h)];
            assert!((found.re - plain(x, y)).abs() < 1e-13 * found.re.abs().max(1.0), "{name}: {found}");
            for (slope, expected) in found.slopes.into_iter().zip(by) {
                assert!((slope - expected).abs() < 1e-6 * expected.abs().max(1.0), "{name} at {x}, {y}: {found}, {expected}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_finite_differences() {
        agree(
            "arithmetic",
            |x, y| (x * y - x) / (y * y + 1.0) + (-x) * 3.0 - y / 2.0,
            |x, y| (x * y - x) / (y * y + 1.0) - x * 3.0 - y / 2.0,
        );
        agree(
            "roots and logarithms",
            |x, y| x.sqrt() * x.ln() + (y * y).ln_1p() + x.log10(),
            |x, y| x.sqrt() * x.ln() + (y * y).ln_1p() + x.log10(),
        );
        agree("exponentials", |x, y| (x * y).exp() + y.exp_m1() * x.recip(), |x, y| (x * y).exp() + y.exp_m1() / x);
        agree("circular", |x, y| x.sin() * y.cos() + (x * 0.3).tan(), |x, y| x.sin() * y.cos() + (x * 0.3).tan());
        agree("absolute value", |x, y| y.abs() * x + y.signum(), |x, y| y.abs() * x + y.signum());
    }

    #[test]
    fn derivative_of_zero_stays_zero_at_an_infinite_slope() {
        let root = Dual::<2>::unknown(0.0, 0).chain(0.0, f64::INFINITY);
        assert_eq!(root.slopes, [f64::INFINITY, 0.0]);
    }

    #[test]
    fn portable_functions_are_those_of_the_scalar() {
        for k in -40..=40 {
            let x: Dual<8> = Dual::unknown(0.37 * f64::from(k), 2) * 1.5;
            let (sin, cos) = x.portable_sin_cos();
            let pairs = [(sin, x.sin()), (x.portable_sin(), x.sin()), (cos, x.cos()), (x.portable_exp(), x.exp())];
            for (found, expected) in pairs {
                let close = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs().max(1e-3);
                assert!(close(found.re, expected.re), "{k}: {found} {expected}");
                let derivative = |d: Dual<8>| d.slopes[2];
                assert!(close(derivative(found), derivative(expected)), "{k}: {found} {expected}");
            }
            assert_eq!(x.re.portable_sin(), sin.re);
        }
    }
}
