//! Sine and exponential function of the laws, equal to the last bit on every machine.
//!
//! The standard library calls the C library of the system, whose results differ between systems and versions in the last digit. `libm` is
//! compiled from Rust source and uses only basic operations, which IEEE 754 defines exactly. A law that the simulated plant evaluates uses these functions.

use crate::scalar::{Dual, Scalar};

/// Transcendental functions by `libm`; those of dual numbers have the derivatives by the chain rule.
pub trait Portable: Sized {
    /// sin x.
    fn portable_sin(self) -> Self {
        self.portable_sin_cos().0
    }
    /// sin x and cos x.
    fn portable_sin_cos(self) -> (Self, Self);
    /// eˣ.
    fn portable_exp(self) -> Self;
}

impl Portable for f64 {
    #[inline]
    fn portable_sin(self) -> Self {
        libm::sin(self)
    }
    #[inline]
    fn portable_sin_cos(self) -> (Self, Self) {
        libm::sincos(self)
    }
    #[inline]
    fn portable_exp(self) -> Self {
        libm::exp(self)
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

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn values_and_derivatives_are_those_of_the_standard_functions() {
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
