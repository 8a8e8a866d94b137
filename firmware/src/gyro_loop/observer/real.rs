//! What an observer counts in: single precision where it holds, else double (docs/observers.md measures which).

use core::ops::{Add, Mul, Sub};

/// `f32` or `f64`.
pub trait Real: Copy + PartialEq + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// Nothing.
    const ZERO: Self;
    /// The nearest to a number.
    fn of(value: f64) -> Self;
    /// The same number.
    fn f64(self) -> f64;
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    fn of(value: f64) -> Self {
        value
    }
    fn f64(self) -> f64 {
        self
    }
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    fn of(value: f64) -> Self {
        value as f32
    }
    fn f64(self) -> f64 {
        f64::from(self)
    }
}
