//! Numbers with units: the units that a parameter accepts, and the unit of a reply.
//!
//! A [`Quantity`] has one unit of its own and accepts others with a conversion factor. One parser serves all.

use crate::text::scaled;

/// A physical quantity: its unit, and the units that are converted to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// The unit of replies and of numbers without a unit; empty for a plain number.
    pub unit: &'static str,
    /// Selects the other units that are accepted.
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Plain,
    Rate,
    Angle,
    Acceleration,
    Voltage,
    Current,
    Time,
    Frequency,
    Torque,
    Temperature,
}

impl Quantity {
    /// No unit.
    pub const PLAIN: Self = Self::new("", Kind::Plain);
    /// rad/s.
    pub const RATE: Self = Self::new("RAD/S", Kind::Rate);
    /// rad.
    pub const ANGLE: Self = Self::new("RAD", Kind::Angle);
    /// rad/s².
    pub const ACCELERATION: Self = Self::new("RAD/S2", Kind::Acceleration);
    /// V.
    pub const VOLTAGE: Self = Self::new("V", Kind::Voltage);
    /// A.
    pub const CURRENT: Self = Self::new("A", Kind::Current);
    /// s.
    pub const TIME: Self = Self::new("S", Kind::Time);
    /// Hz.
    pub const FREQUENCY: Self = Self::new("HZ", Kind::Frequency);
    /// N m.
    pub const TORQUE: Self = Self::new("N.M", Kind::Torque);
    /// °C.
    pub const TEMPERATURE: Self = Self::new("CEL", Kind::Temperature);

    const fn new(unit: &'static str, kind: Kind) -> Self {
        Self { unit, kind }
    }

    /// A unit without other accepted units.
    pub const fn only(unit: &'static str) -> Self {
        Self::new(unit, Kind::Plain)
    }

    /// The quantity that the unit at the end of a setting's name stands for (`rate_bandwidth_Hz`).
    pub fn of_name(name: &str) -> Self {
        const ENDS: [(&str, Quantity); 29] = [
            ("_rad_per_code", Quantity::only("RAD/CODE")),
            ("_rad_s_A", Quantity::only("RAD/S/A")),
            ("_A_per_step", Quantity::only("A/STEP")),
            ("_V_s_rad", Quantity::only("V.S/RAD")),
            ("_V_rad", Quantity::only("V/RAD")),
            ("_N_m_s", Quantity::only("N.M.S")),
            ("_N_m_A", Quantity::only("N.M/A")),
            ("_kg_m2", Quantity::only("KG.M2")),
            ("_A_per_code", Quantity::only("A/CODE")),
            ("_V_per_code", Quantity::only("V/CODE")),
            ("_C_per_code", Quantity::only("CEL/CODE")),
            ("_rad_s_per_code", Quantity::only("RAD/S/CODE")),
            ("_rad_s2", Quantity::ACCELERATION),
            ("_rad_s3", Quantity::only("RAD/S3")),
            ("_V_s", Quantity::only("V.S")),
            ("_1_s2", Quantity::only("1/S2")),
            ("_1_s", Quantity::only("1/S")),
            ("_N_m", Quantity::TORQUE),
            ("_rad_s", Quantity::RATE),
            ("_turns", Quantity::only("TURN")),
            ("_m_s2", Quantity::only("M/S2")),
            ("_percent", Quantity::only("PCT")),
            ("_rad", Quantity::ANGLE),
            ("_ohm", Quantity::only("OHM")),
            ("_Hz", Quantity::FREQUENCY),
            ("_V", Quantity::VOLTAGE),
            ("_A", Quantity::CURRENT),
            ("_C", Quantity::TEMPERATURE),
            ("_s", Quantity::TIME),
        ];
        ENDS.iter().find(|(end, _)| name.ends_with(end)).map_or(Self::PLAIN, |(_, quantity)| *quantity)
    }

    /// The factor that converts a number with this suffix; `None` where the suffix is not a unit of this quantity.
    pub fn factor(self, suffix: &[u8]) -> Option<f64> {
        const TURN: f64 = core::f64::consts::TAU;
        const DEGREE: f64 = TURN / 360.0;
        const OTHERS: [(Kind, &str, f64); 29] = [
            (Kind::Rate, "DEG/S", DEGREE),
            (Kind::Rate, "DPS", DEGREE),
            (Kind::Rate, "MRAD/S", 1e-3),
            (Kind::Rate, "RPM", TURN / 60.0),
            (Kind::Rate, "TURN/S", TURN),
            (Kind::Angle, "DEG", DEGREE),
            (Kind::Angle, "MRAD", 1e-3),
            (Kind::Angle, "TURN", TURN),
            (Kind::Acceleration, "DEG/S2", DEGREE),
            (Kind::Acceleration, "DEG/S/S", DEGREE),
            (Kind::Acceleration, "DEG/S^2", DEGREE),
            (Kind::Acceleration, "RAD/S/S", 1.0),
            (Kind::Acceleration, "RAD/S^2", 1.0),
            (Kind::Voltage, "MV", 1e-3),
            (Kind::Voltage, "UV", 1e-6),
            (Kind::Current, "MA", 1e-3),
            (Kind::Current, "UA", 1e-6),
            (Kind::Time, "MS", 1e-3),
            (Kind::Time, "US", 1e-6),
            (Kind::Time, "MIN", 60.0),
            (Kind::Time, "H", 3600.0),
            (Kind::Frequency, "KHZ", 1e3),
            (Kind::Frequency, "MHZ", 1e6),
            (Kind::Frequency, "1/S", 1.0),
            (Kind::Torque, "NM", 1.0),
            (Kind::Torque, "MN.M", 1e-3),
            (Kind::Torque, "MNM", 1e-3),
            (Kind::Torque, "UN.M", 1e-6),
            (Kind::Temperature, "C", 1.0),
        ];
        if suffix.is_empty() || suffix.eq_ignore_ascii_case(self.unit.as_bytes()) {
            return Some(1.0);
        }
        let fits = |(kind, name, _): &&(Kind, &str, f64)| *kind == self.kind && suffix.eq_ignore_ascii_case(name.as_bytes());
        OTHERS.iter().find(fits).map(|(_, _, factor)| *factor)
    }
}

/// A number at the beginning of `text`, and the rest: decimal, or an integer as `#H1F`, `#Q17` or `#B101` (IEEE 488.2 §7.7.4). `None` if
/// there is none.
pub fn number(text: &[u8]) -> Option<(f64, &[u8])> {
    if let Some((b'#', rest)) = text.split_first() {
        let (kind, digits) = rest.split_first()?;
        let base = match kind.to_ascii_uppercase() {
            b'H' => 16,
            b'Q' => 8,
            b'B' => 2,
            _ => return None,
        };
        let digits = str::from_utf8(digits).ok().filter(|digits| !digits.starts_with('+'))?;
        return u32::from_str_radix(digits, base).ok().map(|value| (f64::from(value), &b""[..]));
    }
    let (negative, mut rest) = match text.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, text),
    };
    let (mut digits, mut exponent, mut any, mut point) = (0_u64, 0_i32, false, false);
    while let Some((byte, after)) = rest.split_first() {
        match byte {
            b'0'..=b'9' => {
                any = true;
                let more = digits.checked_mul(10).and_then(|d| d.checked_add(u64::from(byte - b'0')));
                match more {
                    Some(more) => {
                        digits = more;
                        exponent -= i32::from(point);
                    }
                    // Digits from the twentieth on have no effect.
                    None => exponent += i32::from(!point),
                }
            }
            b'.' if !point => point = true,
            _ => break,
        }
        rest = after;
    }
    if !any {
        return None;
    }
    if let Some((b'e' | b'E', after)) = rest.split_first()
        && let Some((power, after)) = power(after)
    {
        exponent = exponent.saturating_add(power);
        rest = after;
    }
    // Limits the number of multiplications; such a value is outside every range anyway.
    let value = scaled(digits as f64, exponent.clamp(-400, 400));
    Some((if negative { -value } else { value }, rest))
}

/// The exponent behind an E; `None` where the E begins a word.
fn power(text: &[u8]) -> Option<(i32, &[u8])> {
    let (negative, mut rest) = match text.split_first() {
        Some((b'-', rest)) => (true, rest),
        Some((b'+', rest)) => (false, rest),
        _ => (false, text),
    };
    let mut power = 0_i32;
    let before = rest.len();
    while let Some((digit @ b'0'..=b'9', after)) = rest.split_first() {
        power = power.saturating_mul(10).saturating_add(i32::from(digit - b'0')).min(10_000);
        rest = after;
    }
    (rest.len() < before).then_some((if negative { -power } else { power }, rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_the_standard_library_reads_them() {
        for text in ["0", "-1", "+2.5", "1e-3", ".5", "5.", "6.02E23", "123456789.123456789", "0.00025", "1E-30", "-34.906585"] {
            let (value, rest) = number(text.as_bytes()).unwrap();
            let expected: f64 = text.parse().unwrap();
            assert!(rest.is_empty() && (value - expected).abs() <= 4e-16 * expected.abs(), "{text}: {value}");
        }
        assert_eq!(number(b"100 DEG/S").unwrap(), (100.0, &b" DEG/S"[..]));
        assert_eq!(number(b"2E").unwrap(), (2.0, &b"E"[..]));
        assert_eq!((number(b"-"), number(b"."), number(b"RAD")), (None, None, None));
        assert_eq!(number(b"123456789012345678901234567890").unwrap().0, 1.234_567_890_123_456_7e29);
        assert!(number(b"1E999999999999").unwrap().0.is_infinite());
        assert_eq!([b"#H1f", b"#q17", b"#B11"].map(|text| number(text)), [31.0, 15.0, 3.0].map(|value| Some((value, &b""[..]))));
        assert_eq!([&b"#H"[..], b"#H1G", b"#B2", b"#H+1", b"#10"].map(number), [None; 5]);
    }

    #[test]
    fn units_belong_to_their_quantity_in_any_case() {
        assert_eq!(Quantity::RATE.factor(b"deg/s"), Some(core::f64::consts::PI / 180.0));
        assert_eq!(Quantity::RATE.factor(b"RPM"), Some(core::f64::consts::TAU / 60.0));
        assert_eq!((Quantity::TIME.factor(b"ms"), Quantity::CURRENT.factor(b"mA")), (Some(1e-3), Some(1e-3)));
        assert_eq!((Quantity::RATE.factor(b"V"), Quantity::VOLTAGE.factor(b"DEG/S"), Quantity::PLAIN.factor(b"V")), (None, None, None));
    }

    #[test]
    fn a_name_ends_with_its_unit() {
        for (name, unit) in [
            ("resistance_ohm", "OHM"),
            ("motor_constant_N_m_A", "N.M/A"),
            ("rate_gain_V_s_rad", "V.S/RAD"),
            ("acceleration_rad_s2", "RAD/S2"),
            ("overspeed_rad_s", "RAD/S"),
            ("coulomb_N_m", "N.M"),
            ("viscous_N_m_s", "N.M.S"),
            ("counts_per_turn", ""),
        ] {
            assert_eq!(Quantity::of_name(name).unit, unit, "{name}");
        }
    }
}
