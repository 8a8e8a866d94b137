//! Numbers for people: significant digits, values with their uncertainty, p-values.

/// What precedes the standard errors of a fit: where it leaves more than noise, what the model lacks may have shifted the parameters by
/// more than they say.
pub fn at_least(sigma_is_lower_bound: bool) -> &'static str {
    if sigma_is_lower_bound { "at least " } else { "" }
}

/// A number with `digits` significant digits; with a power of ten only where it is very large or small; a dash where it is not finite.
pub fn significant(x: f64, digits: u32) -> String {
    if !x.is_finite() {
        return "–".to_owned();
    }
    if x == 0.0 {
        return "0".to_owned();
    }
    // Rounded first: 0.09996 with three digits is 0.100.
    let rounded = format!("{:.*e}", digits.saturating_sub(1) as usize, x);
    let exponent = exponent(&rounded);
    if (-4..6).contains(&exponent) {
        let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
        return typographic(&format!("{x:.decimals$}"));
    }
    powered(&rounded)
}

/// A number with at most `digits` significant digits and no trailing zeros: for settings and counts, not for measured values.
pub fn plain(x: f64, digits: u32) -> String {
    let text = significant(x, digits);
    let (number, power) = text.split_once(" × ").map_or((text.as_str(), None), |(n, p)| (n, Some(p)));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    power.map_or(number.to_owned(), |power| format!("{number} × {power}"))
}

/// Most decimals of a value that is far below its uncertainty; a smaller one is given with a power of ten.
const MAX_DECIMALS: i32 = 5;

/// A value and its standard uncertainty, rounded to two digits of the uncertainty: `0.02340 ± 0.00012`, `(2.512 ± 0.031) × 10⁻⁴`.
///
/// Only the value where the uncertainty is 0 or not finite. The caller labels the ± (1σ) once for each table or page.
pub fn with_sigma(value: f64, sigma: f64) -> String {
    if !(value.is_finite() && sigma.is_finite()) || sigma <= 0.0 {
        return plain(value, 6);
    }
    let size = exponent(&format!("{:.1e}", value.abs().max(sigma)));
    let last = exponent(&format!("{sigma:.1e}")) - 1;
    let decimals = |power: i32| (power - last).clamp(0, 12) as usize;
    // Rounded to the digits of the uncertainty, a value far below it would be zero: then both are given to the first digit of the value, or
    // each with its own power of ten.
    if value != 0.0 && value.abs() < 0.5 * 10f64.powi(last) {
        let first = -exponent(&format!("{value:.0e}"));
        let decimals = first.unsigned_abs() as usize;
        return if (0..=MAX_DECIMALS).contains(&first) {
            typographic(&format!("{value:.decimals$} ± {sigma:.decimals$}"))
        } else {
            format!("{} ± {}", powered(&format!("{value:.0e}")), powered(&format!("{sigma:.1e}")))
        };
    }
    if (-3..6).contains(&size) {
        let decimals = decimals(0);
        return typographic(&format!("{value:.decimals$} ± {sigma:.decimals$}"));
    }
    let scale = 10f64.powi(size);
    let decimals = decimals(size);
    typographic(&format!("({:.decimals$} ± {:.decimals$}) × 10{}", value / scale, sigma / scale, superscript(size)))
}

/// A relative change: `+3.1 %`; `× 2.40` where it is large; empty where there is none to give.
pub fn change(from: f64, to: f64) -> String {
    if !(from.is_finite() && to.is_finite()) || from == 0.0 {
        return String::new();
    }
    let ratio = to / from;
    if !(1e-6..1e6).contains(&ratio.abs()) {
        return String::new();
    }
    if ratio <= 0.0 || (ratio - 1.0).abs() < 0.5 {
        let percent = 100.0 * (ratio - 1.0);
        if percent.abs() < 0.005 {
            "unchanged".to_owned()
        } else {
            typographic(&format!("{}{} %", if percent > 0.0 { "+" } else { "" }, significant(percent, 2)))
        }
    } else {
        format!("× {}", significant(ratio, 3))
    }
}

/// A whole number in groups of three: `3 600 000`.
pub fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// A number as superscript digits: `⁻³`.
pub fn superscript(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '0' => '⁰',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            digit => digit.to_digit(10).and_then(|d| char::from_u32(0x2070 + d)).unwrap_or(digit),
        })
        .collect()
}

/// log₁₀ of the p-value below which only "< 1e-12" is printed: below it the noise model is more doubtful than chance.
const MIN_LOG10_P: f64 = -12.0;

/// A p-value, given by its logarithm to base 10: `0.034`, `2e-7`, `< 1e-12`; a dash where it is not a number.
pub fn p_value(log10_p: f64) -> String {
    if log10_p.is_nan() {
        "–".to_owned()
    } else if log10_p < MIN_LOG10_P {
        format!("< 1e{MIN_LOG10_P}")
    } else if log10_p < -3.0 {
        format!("{:.0e}", 10f64.powf(log10_p))
    } else {
        plain(10f64.powf(log10_p.min(0.0)), 2)
    }
}

/// A p-value for a sentence: `p = 0.034`, `p < 1e-12`.
pub fn p_statement(log10_p: f64) -> String {
    let sign = if log10_p < MIN_LOG10_P { "" } else { "= " };
    format!("p {sign}{}", p_value(log10_p))
}

/// The exponent of a number in Rust's `1.2e-3`.
fn exponent(scientific: &str) -> i32 {
    scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

fn powered(scientific: &str) -> String {
    let (mantissa, power) = scientific.split_once('e').unwrap_or((scientific, "0"));
    typographic(&format!("{mantissa} × 10{}", superscript(power.parse().unwrap_or(0))))
}

/// Replaces the hyphen by the minus sign.
fn typographic(text: &str) -> String {
    text.replace('-', "−")
}
