//! Sine and exponential function of the laws, equal to the last bit on every machine.
//!
//! The standard library calls the C library of the system, whose results differ between systems and versions in the last digit. `libm` is
//! compiled from Rust source and uses only basic operations, which IEEE 754 defines exactly. A law that the simulated plant evaluates uses these functions.

use num_dual::DualSVec64 as Dual;

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
        (chain(sin, cos, &self), chain(cos, -sin, &self))
    }
    #[inline]
    fn portable_exp(self) -> Self {
        let exp = libm::exp(self.re);
        chain(exp, exp, &self)
    }
}

/// f(x) with the value and the slope of f at x.
#[inline]
fn chain<const N: usize>(value: f64, slope: f64, x: &Dual<N>) -> Dual<N> {
    Dual::new(value, x.eps * slope)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use num_dual::DualNum;

    #[test]
    fn values_and_derivatives_are_those_of_the_standard_functions() {
        for k in -40..=40 {
            let x: Dual<8> = Dual::from(0.37 * f64::from(k)).derivative(2) * 1.5;
            let (sin, cos) = x.portable_sin_cos();
            let pairs = [(sin, x.sin()), (x.portable_sin(), x.sin()), (cos, x.cos()), (x.portable_exp(), x.exp())];
            for (found, expected) in pairs {
                let close = |a: f64, b: f64| (a - b).abs() <= 4.0 * f64::EPSILON * b.abs().max(1e-3);
                assert!(close(found.re, expected.re), "{k}: {found} {expected}");
                let derivative = |d: Dual<8>| d.eps.0.unwrap()[2];
                assert!(close(derivative(found), derivative(expected)), "{k}: {found} {expected}");
            }
            assert_eq!(x.re.portable_sin(), sin.re);
        }
    }
}
