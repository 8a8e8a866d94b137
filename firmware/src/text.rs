//! Numbers as text, in the form of the console: shortest within the given digits, exponents with `E`.
//!
//! `core::fmt` prints a float to its full precision or to a fixed number of decimals; replies want a number of significant digits.

use core::fmt::{self, Display, Formatter, Write};

/// A number with at most so many significant digits (1 … 17), without zeros at the end; with an exponent where it is very small or large.
/// NaN and the infinities are printed as SCPI-99 has them (volume 1, §7.2.1): 9.91E37, 9.9E37 and -9.9E37.
#[derive(Clone, Copy, Debug)]
pub struct Significant(pub f64, pub u32);

impl Display for Significant {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self(value, significant) = *self;
        if value.is_nan() {
            return f.write_str("9.91E37");
        }
        if value < 0.0 {
            f.write_char('-')?;
        }
        let value = value.abs();
        if value.is_infinite() {
            return f.write_str("9.9E37");
        }
        if value == 0.0 {
            return f.write_char('0');
        }
        let significant = significant.clamp(1, 17) as i32;
        let mut exponent = exponent_of(value);
        let mut digits = libm::round(scaled(value, significant - 1 - exponent)) as u64;
        // Rounding may add a digit: 9.999 becomes 10.00.
        if digits >= 10_u64.saturating_pow(significant as u32) {
            exponent += 1;
            digits = digits.checked_div(10).unwrap_or(0);
        }
        let mut decimals = significant - 1;
        while decimals > 0 && digits.checked_rem(10) == Some(0) {
            digits = digits.checked_div(10).unwrap_or(0);
            decimals -= 1;
        }
        // The value is `digits` × 10^(exponent − decimals).
        if (-5..significant.max(7)).contains(&exponent) {
            let after_point = decimals - exponent;
            if after_point <= 0 {
                write!(f, "{}", digits.saturating_mul(10_u64.saturating_pow(after_point.unsigned_abs())))
            } else {
                decimal(f, digits, after_point as u32)
            }
        } else {
            decimal(f, digits, decimals as u32)?;
            write!(f, "E{exponent}")
        }
    }
}

/// A number with a fixed number of decimals, for columns; as [`Significant`] with 9 digits where it is 10¹⁸ and more in its last place.
#[derive(Clone, Copy, Debug)]
pub struct Fixed(pub f64, pub u32);

impl Display for Fixed {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self(value, decimals) = *self;
        let digits = libm::round(scaled(value.abs(), decimals as i32));
        if value.is_nan() || digits >= 1e18 {
            return Significant(value, 9).fmt(f);
        }
        if value < 0.0 && digits > 0.0 {
            f.write_char('-')?;
        }
        decimal(f, digits as u64, decimals)
    }
}

/// A number with 9 significant digits and its unit; no unit where the text is empty.
#[derive(Clone, Copy, Debug)]
pub struct WithUnit<'a>(pub f64, pub &'a str);

impl Display for WithUnit<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        Significant(self.0, 9).fmt(f)?;
        if self.1.is_empty() { Ok(()) } else { write!(f, " {}", self.1) }
    }
}

/// Bytes of a command line as text; bytes that are not printable ASCII are left out.
#[derive(Clone, Copy, Debug)]
pub struct Ascii<'a>(pub &'a [u8]);

impl Display for Ascii<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.0.iter().filter(|byte| (b' '..=b'~').contains(*byte)).try_for_each(|byte| f.write_char(char::from(*byte)))
    }
}

/// Names with a comma between them, `none` where there are none.
pub fn write_list<'a>(out: &mut dyn Write, names: impl IntoIterator<Item = &'a str>) -> fmt::Result {
    let mut separator = "";
    for name in names {
        write!(out, "{separator}{name}")?;
        separator = ",";
    }
    out.write_str(if separator.is_empty() { "none" } else { "" })
}

/// Text of at most `N` bytes; the rest is dropped without an error.
#[derive(Clone, Debug, Default)]
pub struct Truncated<const N: usize>(pub heapless::String<N, u8>);

impl<const N: usize> Write for Truncated<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        text.chars().for_each(|character| _ = self.0.push(character));
        Ok(())
    }
}

/// `digits` × 10^−decimals.
fn decimal(f: &mut Formatter<'_>, digits: u64, decimals: u32) -> fmt::Result {
    let unit = 10_u64.saturating_pow(decimals);
    write!(f, "{}", digits.checked_div(unit).unwrap_or(0))?;
    if decimals > 0 {
        let width = decimals as usize;
        write!(f, ".{:0width$}", digits.checked_rem(unit).unwrap_or(0))?;
    }
    Ok(())
}

/// e with 10^e ≤ value < 10^(e+1), for a finite value above 0.
fn exponent_of(value: f64) -> i32 {
    let mut exponent = libm::floor(libm::log(value) * core::f64::consts::LOG10_E) as i32;
    // The logarithm may be off by its last bit at a power of ten.
    if scaled(value, -exponent) >= 10.0 {
        exponent += 1;
    } else if scaled(value, -exponent) < 1.0 {
        exponent -= 1;
    }
    exponent
}

/// value × 10^exponent. Powers of ten are exact up to 10²², so that values of ordinary size are rounded once.
pub(crate) fn scaled(mut value: f64, mut exponent: i32) -> f64 {
    while exponent != 0 {
        let step = exponent.clamp(-22, 22);
        let mut power = 1.0_f64;
        for _ in 0..step.unsigned_abs() {
            power *= 10.0;
        }
        value = if step > 0 { value * power } else { value / power };
        exponent -= step;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_right() {
        for (value, significant, expected) in [
            (0.0, 6, "0"),
            (100.0, 6, "100"),
            (-34.906_585, 6, "-34.9066"),
            (0.1, 9, "0.1"),
            (2.5e-4, 9, "0.00025"),
            (2.5e-9, 9, "2.5E-9"),
            (999_999.5, 6, "1000000"),
            (1e9, 6, "1E9"),
            (123_456_789.0, 9, "123456789"),
            (9.999_999_9, 3, "10"),
            (1.0 / 3.0, 6, "0.333333"),
            (f64::NAN, 6, "9.91E37"),
            (-f64::INFINITY, 6, "-9.9E37"),
        ] {
            assert_eq!(Significant(value, significant).to_string(), expected, "{value}");
        }
    }

    #[test]
    fn nine_digits_read_back_to_nine_digits() {
        let mut value = 1.234_567_891e-30;
        while value < 1e30 {
            let back: f64 = Significant(value, 9).to_string().parse().unwrap();
            assert!((back / value - 1.0).abs() < 5.1e-9, "{value} {back}");
            value *= -7.3;
            value = value.abs();
        }
    }

    #[test]
    fn columns_have_their_decimals() {
        assert_eq!(format!("{},{}", Fixed(-0.04, 1), Fixed(-1.25, 3)), "0.0,-1.250");
        assert_eq!(format!("{},{}", Fixed(f64::NAN, 1), Fixed(1e20, 3)), "9.91E37,1E20");
    }

    #[test]
    fn text_is_cut_where_it_does_not_fit() {
        let mut text = Truncated::<5>::default();
        write!(text, "abc {}", 12_345).unwrap();
        assert_eq!(text.0.as_str(), "abc 1");
    }
}
