//! Units of imported columns: spellings of laboratories, and their size in the unit of the project's columns.
//!
//! In: text such as `rpm`, `deg/s`, `mN m`, `counts:8192` (counts per turn), `erpm:7` (pole pairs), `0.047 V` and `12/255 V` (a factor before
//! a unit). Out: a [`Unit`] with value in SI = scale × number + offset.

use std::f64::consts::{PI, TAU};

use crate::log::axis::Axis;

/// Kind of quantity that a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Time; s.
    Time,
    /// Angle; rad. On a linear axis a position; m.
    Angle,
    /// Rate; rad/s. On a linear axis a velocity; m/s.
    Rate,
    /// Voltage; V.
    Voltage,
    /// Current; A.
    Current,
    /// Torque; N m. On a linear axis a force; N.
    Torque,
    /// Temperature; °C.
    Temperature,
    /// Acceleration; m/s².
    Acceleration,
}

impl Quantity {
    /// Unit of the project's columns of this quantity.
    pub fn si(self) -> &'static str {
        match self {
            Quantity::Time => "s",
            Quantity::Angle => "rad",
            Quantity::Rate => "rad/s",
            Quantity::Voltage => "V",
            Quantity::Current => "A",
            Quantity::Torque => "N m",
            Quantity::Temperature => "°C",
            Quantity::Acceleration => "m/s²",
        }
    }
}

/// A unit: value in SI = `scale` × number + `offset`.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// As it was written.
    pub text: String,
    /// What it measures.
    pub quantity: Quantity,
    /// Size in SI.
    pub scale: f64,
    /// Zero point in SI.
    pub offset: f64,
    /// A unit of a linear axis: m, m/s, N.
    pub linear: bool,
}

const DEGREE: f64 = PI / 180.0;
/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

/// Spellings with their size in SI; letters in lower case, without spaces, dots and powers' marks.
const SPELLINGS: &[(&str, Quantity, f64)] = &[
    ("s", Quantity::Time, 1.0),
    ("с", Quantity::Time, 1.0),
    ("сек", Quantity::Time, 1.0),
    ("мс", Quantity::Time, 1e-3),
    ("мкс", Quantity::Time, 1e-6),
    ("sec", Quantity::Time, 1.0),
    ("secs", Quantity::Time, 1.0),
    ("second", Quantity::Time, 1.0),
    ("seconds", Quantity::Time, 1.0),
    ("ms", Quantity::Time, 1e-3),
    ("msec", Quantity::Time, 1e-3),
    ("millis", Quantity::Time, 1e-3),
    ("milliseconds", Quantity::Time, 1e-3),
    ("us", Quantity::Time, 1e-6),
    ("usec", Quantity::Time, 1e-6),
    ("micros", Quantity::Time, 1e-6),
    ("microseconds", Quantity::Time, 1e-6),
    ("ns", Quantity::Time, 1e-9),
    ("nsec", Quantity::Time, 1e-9),
    ("min", Quantity::Time, 60.0),
    ("h", Quantity::Time, 3600.0),
    ("rad", Quantity::Angle, 1.0),
    ("radian", Quantity::Angle, 1.0),
    ("radians", Quantity::Angle, 1.0),
    ("рад", Quantity::Angle, 1.0),
    ("град", Quantity::Angle, DEGREE),
    ("grad", Quantity::Angle, DEGREE),
    ("об", Quantity::Angle, TAU),
    ("tr", Quantity::Angle, TAU),
    ("mrad", Quantity::Angle, 1e-3),
    ("urad", Quantity::Angle, 1e-6),
    ("deg", Quantity::Angle, DEGREE),
    ("degree", Quantity::Angle, DEGREE),
    ("degrees", Quantity::Angle, DEGREE),
    ("°", Quantity::Angle, DEGREE),
    ("arcmin", Quantity::Angle, DEGREE / 60.0),
    ("arcsec", Quantity::Angle, DEGREE / 3600.0),
    ("rev", Quantity::Angle, TAU),
    ("revs", Quantity::Angle, TAU),
    ("revolutions", Quantity::Angle, TAU),
    ("turn", Quantity::Angle, TAU),
    ("turns", Quantity::Angle, TAU),
    ("rad/s", Quantity::Rate, 1.0),
    ("rad/sec", Quantity::Rate, 1.0),
    ("rads", Quantity::Rate, 1.0),
    ("rads-1", Quantity::Rate, 1.0),
    ("radps", Quantity::Rate, 1.0),
    ("рад/с", Quantity::Rate, 1.0),
    ("град/с", Quantity::Rate, DEGREE),
    ("grad/s", Quantity::Rate, DEGREE),
    ("об/хв", Quantity::Rate, TAU / 60.0),
    ("об/мин", Quantity::Rate, TAU / 60.0),
    ("об/с", Quantity::Rate, TAU),
    ("tr/min", Quantity::Rate, TAU / 60.0),
    ("tr/s", Quantity::Rate, TAU),
    ("umdr/min", Quantity::Rate, TAU / 60.0),
    ("upm", Quantity::Rate, TAU / 60.0),
    ("u/s", Quantity::Rate, TAU),
    ("obr/min", Quantity::Rate, TAU / 60.0),
    ("giri/min", Quantity::Rate, TAU / 60.0),
    ("mrad/s", Quantity::Rate, 1e-3),
    ("deg/s", Quantity::Rate, DEGREE),
    ("deg/sec", Quantity::Rate, DEGREE),
    ("degps", Quantity::Rate, DEGREE),
    ("dps", Quantity::Rate, DEGREE),
    ("mdps", Quantity::Rate, 1e-3 * DEGREE),
    ("°/s", Quantity::Rate, DEGREE),
    ("deg/h", Quantity::Rate, DEGREE / 3600.0),
    ("°/h", Quantity::Rate, DEGREE / 3600.0),
    ("dph", Quantity::Rate, DEGREE / 3600.0),
    ("rpm", Quantity::Rate, TAU / 60.0),
    ("krpm", Quantity::Rate, 1e3 * TAU / 60.0),
    ("1/min", Quantity::Rate, TAU / 60.0),
    ("min-1", Quantity::Rate, TAU / 60.0),
    ("r/min", Quantity::Rate, TAU / 60.0),
    ("rev/min", Quantity::Rate, TAU / 60.0),
    ("u/min", Quantity::Rate, TAU / 60.0),
    ("rps", Quantity::Rate, TAU),
    ("rev/s", Quantity::Rate, TAU),
    ("turn/s", Quantity::Rate, TAU),
    ("turns/s", Quantity::Rate, TAU),
    ("v", Quantity::Voltage, 1.0),
    ("volt", Quantity::Voltage, 1.0),
    ("volts", Quantity::Voltage, 1.0),
    ("в", Quantity::Voltage, 1.0),
    ("мв", Quantity::Voltage, 1e-3),
    ("mv", Quantity::Voltage, 1e-3),
    ("uv", Quantity::Voltage, 1e-6),
    ("a", Quantity::Current, 1.0),
    ("amp", Quantity::Current, 1.0),
    ("amps", Quantity::Current, 1.0),
    ("ampere", Quantity::Current, 1.0),
    ("а", Quantity::Current, 1.0),
    ("ма", Quantity::Current, 1e-3),
    ("ma", Quantity::Current, 1e-3),
    ("ua", Quantity::Current, 1e-6),
    ("nm", Quantity::Torque, 1.0),
    ("нм", Quantity::Torque, 1.0),
    ("мнм", Quantity::Torque, 1e-3),
    ("mnm", Quantity::Torque, 1e-3),
    ("unm", Quantity::Torque, 1e-6),
    ("nmm", Quantity::Torque, 1e-3),
    ("ncm", Quantity::Torque, 1e-2),
    ("ozin", Quantity::Torque, 7.061_552e-3),
    ("kgcm", Quantity::Torque, 1e-2 * GRAVITY),
    ("gcm", Quantity::Torque, 1e-5 * GRAVITY),
    ("c", Quantity::Temperature, 1.0),
    ("°c", Quantity::Temperature, 1.0),
    ("degc", Quantity::Temperature, 1.0),
    ("°с", Quantity::Temperature, 1.0),
    ("celsius", Quantity::Temperature, 1.0),
    ("m/s2", Quantity::Acceleration, 1.0),
    ("ms2", Quantity::Acceleration, 1.0),
    ("ms-2", Quantity::Acceleration, 1.0),
    ("g", Quantity::Acceleration, GRAVITY),
    ("mg", Quantity::Acceleration, 1e-3 * GRAVITY),
    ("ug", Quantity::Acceleration, 1e-6 * GRAVITY),
];

/// Units of a linear axis.
const LINEAR: &[(&str, Quantity, f64)] = &[
    ("m", Quantity::Angle, 1.0),
    ("cm", Quantity::Angle, 1e-2),
    ("mm", Quantity::Angle, 1e-3),
    ("um", Quantity::Angle, 1e-6),
    ("m/s", Quantity::Rate, 1.0),
    ("cm/s", Quantity::Rate, 1e-2),
    ("mm/s", Quantity::Rate, 1e-3),
    ("n", Quantity::Torque, 1.0),
    ("н", Quantity::Torque, 1.0),
    ("м", Quantity::Angle, 1.0),
    ("мм", Quantity::Angle, 1e-3),
    ("м/с", Quantity::Rate, 1.0),
    ("мм/с", Quantity::Rate, 1e-3),
    ("mn", Quantity::Torque, 1e-3),
    ("kn", Quantity::Torque, 1e3),
];

impl Unit {
    /// The unit that `text` names; `None` if it names none.
    pub fn parse(text: &str) -> Option<Unit> {
        let text = text.trim();
        if let Some((factor, rest)) = text.split_once([' ', '*'])
            && let Some(factor) = factor_of(factor).filter(|f| f.is_finite() && *f != 0.0)
        {
            let unit = Unit::parse(rest)?;
            return Some(Unit { text: text.to_owned(), scale: factor * unit.scale, offset: unit.offset, ..unit });
        }
        let plain = normalised(text);
        let new = |quantity, scale, offset, linear| Some(Unit { text: text.to_owned(), quantity, scale, offset, linear });
        if let Some((kind, per_turn)) = plain.split_once(':') {
            let per_turn: f64 = per_turn.parse().ok().filter(|n: &f64| n.is_finite() && *n != 0.0)?;
            return match kind {
                "count" | "counts" | "ticks" => new(Quantity::Angle, TAU / per_turn, 0.0, false),
                "count/s" | "counts/s" | "ticks/s" => new(Quantity::Rate, TAU / per_turn, 0.0, false),
                "erpm" => new(Quantity::Rate, TAU / 60.0 / per_turn, 0.0, false),
                _ => None,
            };
        }
        match plain.as_str() {
            "k" | "kelvin" => return new(Quantity::Temperature, 1.0, -273.15, false),
            "f" | "°f" | "degf" => return new(Quantity::Temperature, 5.0 / 9.0, -160.0 / 9.0, false),
            _ => {}
        }
        let of = |list: &'static [(&str, Quantity, f64)]| list.iter().find(|s| s.0 == plain).copied();
        if let Some((_, quantity, scale)) = of(SPELLINGS) {
            return new(quantity, scale, 0.0, false);
        }
        of(LINEAR).and_then(|(_, quantity, scale)| new(quantity, scale, 0.0, true))
    }

    /// The project's own unit of a quantity.
    pub fn si(quantity: Quantity) -> Unit {
        Unit { text: quantity.si().to_owned(), quantity, scale: 1.0, offset: 0.0, linear: false }
    }

    /// The unit of a quantity on a linear axis: m, m/s, N.
    pub fn of_linear_axis(quantity: Quantity) -> Unit {
        let linear = LINEAR.iter().find(|(_, q, scale)| *q == quantity && *scale == 1.0);
        linear.map_or_else(
            || Unit::si(quantity),
            |_| Unit { text: Axis::Linear.unit(quantity.si()).to_owned(), linear: true, ..Unit::si(quantity) },
        )
    }

    /// A number in this unit, in SI.
    pub fn to_si(&self, number: f64) -> f64 {
        self.scale * number + self.offset
    }

    /// Angle of one count, rad, for a unit of counts.
    pub fn count_rad(&self) -> Option<f64> {
        let counts = ["count", "tick"].iter().any(|word| self.text.to_lowercase().starts_with(word));
        (counts && self.quantity == Quantity::Angle).then_some(self.scale.abs())
    }
}

/// A number, or the quotient of two: `12/255`.
fn factor_of(text: &str) -> Option<f64> {
    match text.split_once('/') {
        Some((dividend, divisor)) => Some(dividend.parse::<f64>().ok()? / divisor.parse::<f64>().ok()?),
        None => text.parse().ok(),
    }
}

fn normalised(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    for letter in text.to_lowercase().chars() {
        match letter {
            ' ' | '.' | '*' | '·' | '⋅' | '^' if !text.contains(':') || letter == ' ' => {}
            'µ' | 'μ' => plain.push('u'),
            '²' => plain.push('2'),
            '−' => plain.push('-'),
            'º' | '˚' => plain.push('°'),
            other => plain.push(other),
        }
    }
    plain
}

/// How a unit is part of a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum UnitMark {
    /// In brackets, after a slash or a comma: a unit and nothing else.
    Marked,
    /// The last word, which may also be part of the name: `Channel A`.
    LastWord,
}

/// Splits the unit off a column name: `Speed [rpm]`, `Speed (rpm)`, `speed/rpm`, `Speed, rpm`, `speed_rpm`, `omega_rad_s`, `SpeedRpm` is
/// not split. Returns the rest of the name, the unit and how it is marked.
pub fn split_name(name: &str) -> (String, Option<(Unit, UnitMark)>) {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some(rest) = name.strip_suffix(close)
            && let Some((base, unit)) = rest.rsplit_once(open)
            && let Some(unit) = Unit::parse(unit)
        {
            return (base.trim().trim_end_matches(['/', ',']).to_owned(), Some((unit, UnitMark::Marked)));
        }
    }
    for mark in ["/", ",", " in ", " "] {
        if let Some((base, unit)) = name.split_once(mark)
            && !base.trim().is_empty()
            && let Some(unit) = Unit::parse(unit)
        {
            let how = if mark == " " { UnitMark::LastWord } else { UnitMark::Marked };
            return (base.trim().to_owned(), Some((unit, how)));
        }
    }
    let parts: Vec<&str> = name.split('_').collect();
    for take in (1..=3.min(parts.len().saturating_sub(1))).rev() {
        let (base, tail) = parts.split_at(parts.len() - take);
        let spellings = [tail.join("/"), tail.concat()];
        if let Some(unit) = spellings.iter().find_map(|s| Unit::parse(s)) {
            return (base.join("_"), Some((Unit { text: spelled(&unit, tail), ..unit }, UnitMark::LastWord)));
        }
    }
    (name.to_owned(), None)
}

/// A unit from the end of a column name, as a person writes it.
fn spelled(unit: &Unit, tail: &[&str]) -> String {
    match unit.quantity {
        Quantity::Torque => tail.join(" "),
        _ => tail.join("/"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_laboratories_have_their_size() {
        let size = |text: &str| Unit::parse(text).map(|u| (u.quantity, u.scale));
        assert_eq!(size("rpm"), Some((Quantity::Rate, TAU / 60.0)));
        assert_eq!(size("1/min"), size("rpm"));
        assert_eq!(size("°/s"), Some((Quantity::Rate, DEGREE)));
        assert_eq!(size("mN m"), Some((Quantity::Torque, 1e-3)));
        assert_eq!(size("N·m"), Some((Quantity::Torque, 1.0)));
        assert_eq!(size("µs"), Some((Quantity::Time, 1e-6)));
        assert_eq!(size("m/s^2"), Some((Quantity::Acceleration, 1.0)));
        assert_eq!(size("counts:8192"), Some((Quantity::Angle, TAU / 8192.0)));
        assert_eq!(size("0.05 V"), Some((Quantity::Voltage, 0.05)));
        assert_eq!(size("banana"), None);
        assert!(Unit::parse("mm").is_some_and(|u| u.linear && u.quantity == Quantity::Angle));
        let kelvin = Unit::parse("K").expect("a unit");
        assert!((kelvin.to_si(298.15) - 25.0).abs() < 1e-12);
        let fahrenheit = Unit::parse("F").expect("a unit");
        assert!((fahrenheit.to_si(77.0) - 25.0).abs() < 1e-12);
    }

    #[test]
    fn unit_is_split_off_a_name() {
        let split = |name: &str| {
            let (base, unit) = split_name(name);
            (base, unit.map(|u| u.0.text))
        };
        let both = |base: &str, unit: &str| (base.to_owned(), Some(unit.to_owned()));
        assert_eq!(split("Speed [rpm]"), both("Speed", "rpm"));
        assert_eq!(split("Motor current (mA)"), both("Motor current", "mA"));
        assert_eq!(split("speed_rpm"), both("speed", "rpm"));
        assert_eq!(split("omega_rad_s"), both("omega", "rad/s"));
        assert_eq!(split("torque_mN_m"), both("torque", "mN m"));
        assert_eq!(split("t/ms"), both("t", "ms"));
        assert_eq!(split("Zeit, s"), both("Zeit", "s"));
        assert_eq!(split("velocity"), ("velocity".to_owned(), None));
    }
}
