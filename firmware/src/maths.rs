//! Functions of one real number, small: on the chip double precision is made of calls, and the general ones take a tenth of the flash that there is.
//!
//! Good to a few units of the last digit where the argument is what a stand has (no angles of thousands of turns, no powers of nothing).

use core::f64::consts::FRAC_PI_2;

/// What [`FRAC_PI_2`] lacks of π/2.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

/// Sine and cosine of an angle of at most some thousand radians.
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = libm::round(angle_rad / FRAC_PI_2);
    let rest = (angle_rad - quarters * FRAC_PI_2) - quarters * FRAC_PI_2_REST;
    // Taylor's series up to the 17th power; what is left out is below 1e-17 within an eighth of a turn.
    let (mut sine, mut cosine, mut term) = (0.0, 0.0, 1.0);
    for n in 1..=9_u8 {
        cosine += term;
        term *= rest / f64::from(2 * n - 1);
        sine += term;
        term *= -rest / f64::from(2 * n);
    }
    match quarters as i64 & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Sine, as [`sin_cos`].
pub fn sin(angle_rad: f64) -> f64 {
    sin_cos(angle_rad).0
}

/// `base` to the power of `exponent`; `base` above 0.
pub fn power(base: f64, exponent: f64) -> f64 {
    libm::exp(exponent * libm::log(base))
}

/// Third root of a number that is not negative.
pub fn cube_root(value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let root = power(value, 1.0 / 3.0);
    // One step of Newton's takes away what the logarithm has rounded.
    root - (root - value / (root * root)) / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_the_standard_librarys_to_a_few_last_digits() {
        for n in -200_000..200_000 {
            let angle = f64::from(n) * 1.234_567_8e-2;
            let (sine, cosine) = sin_cos(angle);
            assert!((sine - angle.sin()).abs() < 5e-16 + 2e-16 * angle.abs(), "{angle}: {sine} {}", angle.sin());
            assert!((cosine - angle.cos()).abs() < 5e-16 + 2e-16 * angle.abs(), "{angle}: {cosine} {}", angle.cos());
        }
    }

    #[test]
    fn powers_and_roots_are_too() {
        for n in 1..20_000 {
            let value = f64::from(n) * 0.37;
            for exponent in [-2.0, -0.3, 1e-4, 0.5, 1.0, 3.0] {
                assert!((power(value, exponent) / value.powf(exponent) - 1.0).abs() < 1e-14, "{value} {exponent}");
            }
            assert!((cube_root(value) / value.cbrt() - 1.0).abs() < 4e-16, "{value}");
        }
        assert_eq!(cube_root(0.0), 0.0);
    }
}
