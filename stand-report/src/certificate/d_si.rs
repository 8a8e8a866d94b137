//! Units in the notation of the D-SI (Digital System of Units, PTB 2019): `\radian\second\tothe{-1}`.

/// D-SI notation of a unit of this project, and the factor from its number to that unit; `None` for an unknown unit.
pub(super) fn d_si(unit: &str) -> Option<(String, f64)> {
    if unit == "1" || unit.is_empty() {
        return Some((r"\one".into(), 1.0));
    }
    let (mut text, mut factor) = (String::new(), 1.0);
    let mut parts = unit.split('/');
    let numerator = parts.next().unwrap_or("");
    let tokens = numerator.split_whitespace().map(|t| (t, 1)).chain(parts.flat_map(str::split_whitespace).map(|t| (t, -1)));
    for (token, sign) in tokens.filter(|(token, _)| *token != "1") {
        let (name, power) = token.strip_suffix('²').map_or((token, 1), |name| (name, 2));
        // (symbol in D-SI, factor)
        let (symbol, scale) = match name {
            "rad" => (r"\radian", 1.0),
            "s" => (r"\second", 1.0),
            "m" => (r"\metre", 1.0),
            "kg" => (r"\kilogram", 1.0),
            "N" => (r"\newton", 1.0),
            "A" => (r"\ampere", 1.0),
            "V" => (r"\volt", 1.0),
            "K" => (r"\kelvin", 1.0),
            "H" => (r"\henry", 1.0),
            "Hz" => (r"\hertz", 1.0),
            "Ω" => (r"\ohm", 1.0),
            "Pa" => (r"\pascal", 1.0),
            "°" => (r"\degree", 1.0),
            "°C" => (r"\degreecelsius", 1.0),
            "%" => (r"\percent", 1.0),
            // Standard gravity is no unit of the D-SI.
            "g" if sign < 0 => {
                factor /= 9.806_65;
                text += r"\metre\tothe{-1}\second\tothe{2}";
                continue;
            }
            _ => return None,
        };
        factor *= scale;
        text += symbol;
        let power = sign * power;
        if power != 1 {
            text += &format!(r"\tothe{{{power}}}");
        }
    }
    Some((text, factor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_all_quantities_have_a_notation() {
        let text = |unit: &str| d_si(unit).map(|(text, _)| text);
        assert_eq!(text("rad/s").as_deref(), Some(r"\radian\second\tothe{-1}"));
        assert_eq!(text("m/s²").as_deref(), Some(r"\metre\second\tothe{-2}"));
        assert_eq!(text("kg m²").as_deref(), Some(r"\kilogram\metre\tothe{2}"));
        assert_eq!(text("rad/s/K").as_deref(), Some(r"\radian\second\tothe{-1}\kelvin\tothe{-1}"));
        assert_eq!(text("1/K").as_deref(), Some(r"\kelvin\tothe{-1}"));
        assert_eq!(text("1").as_deref(), Some(r"\one"));
        assert_eq!(text("furlong"), None);
        for unit in ["%", "s", "Hz", "°", "m", "N m/A", "Ω", "H", "N m s/rad", "N m", "A", "A s/rad", "V", "rad/s/V", "1/s", "rad/s²"] {
            assert!(d_si(unit).is_some_and(|(text, factor)| !text.contains(' ') && factor == 1.0), "{unit}");
        }
        let (unit, factor) = d_si("rad/s/g").unwrap_or_default();
        assert_eq!(unit, r"\radian\second\tothe{-1}\metre\tothe{-1}\second\tothe{2}");
        assert!((factor - 1.0 / 9.806_65).abs() < 1e-15);
    }
}
