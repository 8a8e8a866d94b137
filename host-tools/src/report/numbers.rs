//! Numbers for a person: as many digits as they deserve, and no more.

/// A number with `digits` significant digits; a power of ten only where zeros would pile up.
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

/// The same without zeros at its end: what a person wrote, not what was measured.
pub fn plain(x: f64, digits: u32) -> String {
    let text = significant(x, digits);
    let (number, power) = text.split_once(" × ").map_or((text.as_str(), None), |(n, p)| (n, Some(p)));
    let number = if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { number };
    power.map_or(number.to_owned(), |power| format!("{number} × {power}"))
}

/// A value and its standard error to the same place, two digits of the error: `0.02340 ± 0.00012`, `(2.512 ± 0.031) × 10⁻⁴`.
///
/// An error of 0 is said as none: the value alone.
pub fn with_sigma(value: f64, sigma: f64) -> String {
    if !(value.is_finite() && sigma.is_finite()) || sigma <= 0.0 {
        return plain(value, 6);
    }
    let size = exponent(&format!("{:.1e}", value.abs().max(sigma)));
    let last = exponent(&format!("{sigma:.1e}")) - 1;
    let decimals = |power: i32| (power - last).clamp(0, 12) as usize;
    if (-3..6).contains(&size) {
        let decimals = decimals(0);
        return typographic(&format!("{value:.decimals$} ± {sigma:.decimals$}"));
    }
    let scale = 10f64.powi(size);
    let decimals = decimals(size);
    typographic(&format!("({:.decimals$} ± {:.decimals$}) × 10{}", value / scale, sigma / scale, superscript(size)))
}

/// A change in percent: `+3.1 %`, `× 2.4` where it is large.
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

/// A power as it is written above the line: `⁻³`.
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

/// The exponent of a number in Rust's `1.2e-3`.
fn exponent(scientific: &str) -> i32 {
    scientific.split_once('e').and_then(|(_, e)| e.parse().ok()).unwrap_or(0)
}

fn powered(scientific: &str) -> String {
    let (mantissa, power) = scientific.split_once('e').unwrap_or((scientific, "0"));
    typographic(&format!("{mantissa} × 10{}", superscript(power.parse().unwrap_or(0))))
}

/// A minus is a minus, not a hyphen.
fn typographic(text: &str) -> String {
    text.replace('-', "−")
}
