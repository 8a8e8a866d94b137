//! Sine and exponential function of the laws, equal to the last bit on every machine.
//!
//! The standard library calls the C library of the system, whose results differ between systems and versions in the last digit. `libm` is
//! compiled from Rust source and uses only basic operations, which IEEE 754 defines exactly. A law that the simulated plant evaluates uses
//! these functions.

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
