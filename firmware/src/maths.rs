//! Functions of one real number, small: on the chip double precision is made of calls, and the general ones take a tenth of the flash that there is.
//!
//! None is written out where it is called, for the same reason.
//!
//! Good to a few units of the last digit where the argument is what a stand has (no angles of thousands of turns, no powers of nothing).

use core::f64::consts::{FRAC_PI_2, LN_2, PI};

/// What [`FRAC_PI_2`] lacks of π/2.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

/// ln 2 in two parts; the first has zeros at its end, so that its multiples are exact.
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// √½, as its bits.
const SQRT_HALF_BITS: u64 = 0x3fe6_a09e_667f_3bcd;

/// Sine and cosine of an angle of at most some thousand radians.
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    let quarters = round(angle_rad / FRAC_PI_2);
    let rest = (angle_rad - quarters * FRAC_PI_2) - quarters * FRAC_PI_2_REST;
    // Taylor's series up to the 17th power; what is left out is below 1e-17 within an eighth of a turn.
    let (mut sine, mut cosine, mut term) = (0.0, 0.0, 1.0);
    for n in 1..=9_u8 {
        cosine += term;
        term *= rest / f64::from(2 * n - 1);
        sine += term;
        term *= -rest / f64::from(2 * n);
    }
    match to_i64(quarters) & 3 {
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

/// The greatest whole number that is not above; of numbers within ±2⁶².
#[inline(never)]
pub fn floor(value: f64) -> f64 {
    let whole = trunc(value);
    if whole > value { whole - 1.0 } else { whole }
}

/// The least whole number that is not below; of numbers within ±2⁶².
#[inline(never)]
pub fn ceil(value: f64) -> f64 {
    -floor(-value)
}

/// The whole number towards zero; of numbers within ±2⁶².
#[inline(never)]
pub fn trunc(value: f64) -> f64 {
    to_i64(value) as f64
}

/// The nearest whole number, halves away from zero; of numbers within ±2⁶².
#[inline(never)]
pub fn round(value: f64) -> f64 {
    let whole = trunc(value);
    // Exact: both are within a factor of two, or `whole` is zero.
    let rest = value - whole;
    whole + trunc(rest + rest)
}

/// As a whole number, cut towards zero, as the language's `as` does it: 0 of what is no number, the nearest there is where it is too large. Each `as`
/// of a double is three comparisons, all of them calls.
#[inline(never)]
pub fn to_i64(value: f64) -> i64 {
    value as i64
}

/// The same without a sign: 0 of what is below.
#[inline(never)]
pub fn to_u64(value: f64) -> u64 {
    value as u64
}

/// The same, shorter.
pub fn to_u32(value: f64) -> u32 {
    u32::try_from(to_u64(value)).unwrap_or(u32::MAX)
}

/// The same with a sign, shorter.
pub fn to_i32(value: f64) -> i32 {
    to_i64(value).clamp(i64::from(i32::MIN), i64::from(i32::MAX)) as i32
}

/// The greater of two numbers; the other of one that is not a number.
#[inline(never)]
pub fn greater(a: f64, b: f64) -> f64 {
    a.max(b)
}

/// The lesser of two numbers; the other of one that is not a number.
#[inline(never)]
pub fn lesser(a: f64, b: f64) -> f64 {
    a.min(b)
}

/// Square root of a number that is not negative; not a number of one that is.
#[inline(never)]
pub fn sqrt(value: f64) -> f64 {
    if value < 0.0 || value.is_nan() {
        return f64::NAN;
    }
    if value < f64::MIN_POSITIVE || value.is_infinite() {
        return value;
    }
    // Half the exponent is within 4 %; each step of Heron's doubles the digits.
    let mut root = f64::from_bits((value.to_bits() >> 1) + 0x1ff7_8000_0000_0000);
    for _ in 0..5 {
        root = 0.5 * (root + value / root);
    }
    root
}

/// e to the power of a number within ±700.
pub fn exp(value: f64) -> f64 {
    let twos = round(value / LN_2);
    let rest = (value - twos * LN_2_HIGH) - twos * LN_2_LOW;
    let (mut sum, mut term) = (1.0, 1.0);
    for n in 1..=17_u8 {
        term *= rest / f64::from(n);
        sum += term;
    }
    sum * f64::from_bits((to_i64(twos).wrapping_add(1023) as u64) << 52)
}

/// Natural logarithm of a number above 0.
pub fn log(value: f64) -> f64 {
    let bits = value.to_bits();
    // The mantissa between √½ and √2, and the power of two that is taken out.
    let shifted = bits.wrapping_sub(SQRT_HALF_BITS);
    let twos = (shifted as i64 >> 52) as f64;
    let mantissa = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff) + SQRT_HALF_BITS);
    // ln m = 2 artanh((m − 1)/(m + 1)).
    let ratio = (mantissa - 1.0) / (mantissa + 1.0);
    let square = ratio * ratio;
    let mut sum = 0.0;
    for n in (0..=11_u8).rev() {
        sum = sum * square + 1.0 / f64::from(2 * n + 1);
    }
    twos * LN_2_HIGH + (twos * LN_2_LOW + 2.0 * ratio * sum)
}

/// Angle of a point from the first axis, rad, −π … π; 0 at the origin.
pub fn atan2(y: f64, x: f64) -> f64 {
    let length = sqrt(x * x + y * y);
    if length == 0.0 {
        return 0.0;
    }
    // A start to 4 %, then what is left of the angle: turned back, the point is on the axis but for a sine.
    let mut angle_rad = if x.abs() >= y.abs() { y / length } else { (FRAC_PI_2 - (x / length).abs()).copysign(y) };
    if x < 0.0 {
        angle_rad = PI.copysign(y) - angle_rad;
    }
    for _ in 0..3 {
        let (sine, cosine) = sin_cos(angle_rad);
        let across = (y * cosine - x * sine) / length;
        angle_rad += across + across * across * across / 6.0;
    }
    angle_rad
}

/// `base` to the power of `exponent`; `base` above 0.
pub fn power(base: f64, exponent: f64) -> f64 {
    exp(exponent * log(base))
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

    #[test]
    fn whole_numbers_are_the_standard_librarys() {
        let ends = [0.0, 0.5, 1.5, 2.5, 0.499_999_999_999_999_94, 4_503_599_627_370_495.5, 4_503_599_627_370_497.0, 1e17];
        for value in (0..40_000).map(|n| f64::from(n) * 0.125 - 2500.0).chain(ends).chain(ends.map(|end| -end)) {
            let ours = (floor(value), ceil(value), trunc(value), round(value));
            assert_eq!(ours, (value.floor(), value.ceil(), value.trunc(), value.round()), "{value}");
        }
    }

    #[test]
    fn roots_exponentials_logarithms_and_angles_are_the_standard_librarys_to_a_few_last_digits() {
        for n in 1..200_000 {
            let value = f64::from(n) * 0.013;
            for value in [value, 1.0 / value, value * 1e90, 1e-200 * value] {
                assert!((sqrt(value) / value.sqrt() - 1.0).abs() < 3e-16, "√{value}");
                assert!((log(value) - value.ln()).abs() <= 3e-16 * (1.0 + value.ln().abs()), "ln {value}: {} {}", log(value), value.ln());
            }
            let exponent = f64::from(n - 100_000) * 0.006_9;
            assert!((exp(exponent) / exponent.exp() - 1.0).abs() < 1e-15, "exp {exponent}: {} {}", exp(exponent), exponent.exp());
            let (sine, cosine) = exponent.sin_cos();
            assert!((atan2(2.5 * sine, 2.5 * cosine) - sine.atan2(cosine)).abs() < 2e-15, "{exponent}");
        }
        assert_eq!((sqrt(0.0), sqrt(f64::INFINITY), sqrt(-1.0).is_nan(), sqrt(f64::NAN).is_nan()), (0.0, f64::INFINITY, true, true));
        assert_eq!((atan2(0.0, 0.0), atan2(0.0, 1.0)), (0.0, 0.0));
    }
}
