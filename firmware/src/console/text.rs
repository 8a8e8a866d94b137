//! Text of a fixed size, and numbers in it, without `core::fmt`: its floats alone are 20 KiB of the image.
//!
//! What does not fit is cut and remembered ([`Text::is_cut`]); nothing panics. Numbers are written shortest: as many digits as asked for,
//! zeros at the end left away.

use crate::words::Words;

/// At most `N` bytes of ASCII.
#[derive(Clone, Copy, Debug)]
pub struct Text<const N: usize> {
    bytes: [u8; N],
    length: usize,
    cut: bool,
}

impl<const N: usize> Default for Text<N> {
    fn default() -> Self {
        Self { bytes: [0; N], length: 0, cut: false }
    }
}

impl<const N: usize> Text<N> {
    /// As bytes.
    pub fn as_bytes(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or_default()
    }

    /// As a string; what is not printable ASCII was not taken in.
    pub fn as_str(&self) -> &str {
        core::str::from_utf8(self.as_bytes()).unwrap_or_default()
    }

    /// Whether nothing is in it.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Whether something did not fit.
    pub fn is_cut(&self) -> bool {
        self.cut
    }

    /// Empties it.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// For writing.
    pub fn writer(&mut self) -> Writer<'_> {
        Writer { bytes: &mut self.bytes, length: &mut self.length, cut: &mut self.cut }
    }
}

/// Writes into a [`Text`] of any size, so that the code is there once.
pub struct Writer<'a> {
    bytes: &'a mut [u8],
    length: &'a mut usize,
    cut: &'a mut bool,
}

impl Writer<'_> {
    /// The same, for a callee.
    pub fn by_ref(&mut self) -> Writer<'_> {
        Writer { bytes: self.bytes, length: self.length, cut: self.cut }
    }

    /// Bytes that are in it.
    pub fn length(&self) -> usize {
        *self.length
    }

    /// One byte; what is not printable is left out.
    pub fn byte(&mut self, byte: u8) -> &mut Self {
        match self.bytes.get_mut(*self.length) {
            Some(place) if (b' '..=b'~').contains(&byte) => {
                *place = byte;
                *self.length += 1;
            }
            Some(_) => {}
            None => *self.cut = true,
        }
        self
    }

    /// Text.
    pub fn text(&mut self, text: &str) -> &mut Self {
        self.bytes(text.as_bytes())
    }

    /// Words.
    pub fn words(&mut self, words: Words) -> &mut Self {
        words.letters(&mut |letter| _ = self.byte(letter));
        self
    }

    /// Text as bytes.
    pub fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        for byte in bytes {
            self.byte(*byte);
        }
        self
    }

    /// A whole number, at least `least_digits` of it.
    pub fn whole(&mut self, mut value: u64, least_digits: usize) -> &mut Self {
        let mut digits = [b'0'; 20];
        let mut used = 0;
        for digit in digits.iter_mut().rev() {
            if value == 0 && used >= least_digits.max(1) {
                break;
            }
            *digit = b'0' + value.checked_rem(10).unwrap_or(0) as u8;
            value = value.checked_div(10).unwrap_or(0);
            used += 1;
        }
        self.bytes(digits.get(digits.len().saturating_sub(used)..).unwrap_or_default())
    }

    /// A whole number with its sign.
    pub fn signed(&mut self, value: i64) -> &mut Self {
        if value < 0 {
            self.byte(b'-');
        }
        self.whole(value.unsigned_abs(), 1)
    }

    /// Four bytes as hex digits.
    pub fn hex(&mut self, value: u32) -> &mut Self {
        for byte in value.to_be_bytes() {
            for nibble in [byte >> 4, byte & 15] {
                self.byte(if nibble < 10 { b'0' + nibble } else { b'A' - 10 + nibble });
            }
        }
        self
    }

    /// A number to so many significant digits (1 … 17), with an exponent where it is very small or large; what is no number is `NAN`,
    /// 9.91E37 to SCPI, and said in words here.
    pub fn number(&mut self, value: f64, significant: u32) -> &mut Self {
        if value.is_nan() {
            return self.text("NAN");
        }
        if value < 0.0 {
            self.byte(b'-');
        }
        let value = value.abs();
        if value.is_infinite() {
            return self.text("INF");
        }
        if value == 0.0 {
            return self.byte(b'0');
        }
        let significant = significant.clamp(1, 17) as i32;
        let mut exponent = exponent_of(value);
        let mut digits = crate::maths::to_u64(crate::maths::round(scaled(value, significant - 1 - exponent)));
        // Rounded up to one digit more.
        if digits >= 10_u64.saturating_pow(significant as u32) {
            exponent += 1;
            digits = digits.checked_div(10).unwrap_or(0);
        }
        let mut decimals = significant - 1;
        while decimals > 0 && digits.checked_rem(10) == Some(0) {
            digits = digits.checked_div(10).unwrap_or(0);
            decimals -= 1;
        }
        // `digits` × 10^(exponent − decimals).
        if (-5..significant.max(7)).contains(&exponent) {
            let after = decimals - exponent;
            if after <= 0 {
                self.whole(digits.saturating_mul(10_u64.saturating_pow(after.unsigned_abs())), 1)
            } else {
                self.point(digits, after as u32)
            }
        } else {
            self.point(digits, decimals as u32).byte(b'E').signed(i64::from(exponent))
        }
    }

    /// A number with so many decimals, for columns; as [`Writer::number`] where it is too large for that.
    pub fn fixed(&mut self, value: f64, decimals: u32) -> &mut Self {
        let whole = crate::maths::round(scaled(value.abs(), decimals as i32));
        if value.is_nan() || whole >= 1e18 {
            return self.number(value, 9);
        }
        if value < 0.0 && whole > 0.0 {
            self.byte(b'-');
        }
        self.point(crate::maths::to_u64(whole), decimals)
    }

    /// `digits` × 10^−decimals.
    fn point(&mut self, digits: u64, decimals: u32) -> &mut Self {
        let unit = 10_u64.saturating_pow(decimals);
        self.whole(digits.checked_div(unit).unwrap_or(0), 1);
        if decimals > 0 {
            self.byte(b'.').whole(digits.checked_rem(unit).unwrap_or(0), decimals as usize);
        }
        self
    }
}

/// e with 10^e ≤ value < 10^(e+1), for a finite value above 0.
fn exponent_of(value: f64) -> i32 {
    let mut exponent = crate::maths::to_i32(crate::maths::floor(crate::maths::log(value) * core::f64::consts::LOG10_E));
    // The logarithm may be off by its last bit at a power of ten.
    if scaled(value, -exponent) >= 10.0 {
        exponent += 1;
    } else if scaled(value, -exponent) < 1.0 {
        exponent -= 1;
    }
    exponent
}

/// value × 10^exponent. Exact powers as far as they are (10²²): one rounding within everything that a stand measures.
pub(super) fn scaled(mut value: f64, mut exponent: i32) -> f64 {
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

    fn number(value: f64, significant: u32) -> String {
        let mut text = Text::<40>::default();
        text.writer().number(value, significant);
        text.as_str().to_string()
    }

    #[test]
    fn numbers_are_short_and_right() {
        for (value, significant, says) in [
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
            (f64::NAN, 6, "NAN"),
            (-f64::INFINITY, 6, "-INF"),
        ] {
            assert_eq!(number(value, significant), says, "{value}");
        }
    }

    #[test]
    fn what_is_written_to_nine_digits_reads_back_to_nine_digits() {
        let mut value = 1.234_567_891e-30;
        while value < 1e30 {
            let back: f64 = number(value, 9).parse().unwrap();
            assert!((back / value - 1.0).abs() < 5.1e-9, "{value} {back}");
            value *= -7.3;
            value = value.abs();
        }
    }

    #[test]
    fn columns_have_their_decimals_and_what_does_not_fit_is_told() {
        let mut text = Text::<12>::default();
        text.writer().fixed(-0.04, 1).byte(b',').fixed(-1.25, 3).byte(b',').hex(0xDEAD_BEEF);
        assert_eq!(text.as_str(), "0.0,-1.250,D");
        assert!(text.is_cut());
    }
}
