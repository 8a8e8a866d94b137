//! Cells of a line: their separation, numbers, truth values, dates and times of day.

/// The cells of a line, without spaces and quotes. A separator inside double quotes separates nothing.
pub(super) fn split(line: &str, separator: char) -> Cells<'_> {
    Cells { rest: Some(line), separator, quoted: line.contains('"') }
}

/// See [`split`].
pub(super) struct Cells<'a> {
    rest: Option<&'a str>,
    separator: char,
    quoted: bool,
}

impl<'a> Iterator for Cells<'a> {
    type Item = &'a str;
    fn next(&mut self) -> Option<&'a str> {
        if self.separator == ' ' {
            // Any number of spaces and tabs.
            let rest = self.rest?.trim_start();
            if rest.is_empty() {
                self.rest = None;
                return None;
            }
            let end = if let Some(quoted) = rest.strip_prefix('"') {
                quoted.find('"').map_or(rest.len(), |at| at + 2)
            } else {
                rest.find(char::is_whitespace).unwrap_or(rest.len())
            };
            self.rest = Some(&rest[end..]);
            return Some(unquote(&rest[..end]));
        }
        let rest = self.rest?;
        let mut inside = false;
        let end = if self.quoted {
            rest.char_indices().find(|(_, c)| {
                inside ^= *c == '"';
                *c == self.separator && !inside
            })
        } else {
            rest.find(self.separator).map(|at| (at, self.separator))
        };
        let (cell, rest) = match end {
            Some((at, mark)) => (&rest[..at], Some(&rest[at + mark.len_utf8()..])),
            None => (rest, None),
        };
        self.rest = rest;
        Some(unquote(cell))
    }
}

pub(super) fn unquote(cell: &str) -> &str {
    let cell = cell.trim();
    ['"', '\''].iter().find_map(|mark| cell.strip_prefix(*mark)?.strip_suffix(*mark)).map_or(cell, str::trim)
}

/// A cell that states that there is no value. Oscilloscopes write ∞ for a reading beyond their range.
pub(super) fn is_missing(cell: &str) -> bool {
    const NONE: [&str; 15] = ["", "nan", "na", "n/a", "null", "none", "-", "--", "inf", "-inf", "#n/a", "∞", "-∞", "<na>", "nat"];
    NONE.iter().any(|none| cell.eq_ignore_ascii_case(none))
}

/// A number as the file has it, and its part above `origin`, which keeps the digits of large numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cell {
    /// A number.
    Number(f64),
    /// A date or a time of day, s.
    Time(f64),
    /// No value.
    Missing,
    /// Text.
    Text,
}

/// Digits of a whole number from which it is read relative to the first of its column: a count since 1970 has more than an `f64` resolves.
const LONG_DIGITS: usize = 9;

/// The cell; `origin` is the whole number or second that is subtracted from the numbers of this column, found from its first number.
pub(super) fn cell(text: &str, decimal: char, origin: &mut Option<i64>) -> Cell {
    if let Some(value) = number(text, decimal) {
        return Cell::Number(match (*origin, long(text, decimal)) {
            (Some(0), _) | (None, None) => {
                *origin = Some(0);
                value
            }
            (None, Some((whole, fraction))) => {
                *origin = Some(whole);
                fraction
            }
            (Some(zero), Some((whole, fraction))) => (whole - zero) as f64 + fraction,
            (Some(zero), None) => value - zero as f64,
        });
    }
    if let Some((second, fraction)) = seconds(text) {
        let zero = *origin.get_or_insert(second);
        return Cell::Time((second - zero) as f64 + fraction);
    }
    match text {
        "True" | "TRUE" | "true" => Cell::Number(1.0),
        "False" | "FALSE" | "false" => Cell::Number(0.0),
        _ if is_missing(text) => Cell::Missing,
        _ => Cell::Text,
    }
}

/// Whole part and fraction of a number with many digits before its decimal mark.
fn long(text: &str, decimal: char) -> Option<(i64, f64)> {
    let (whole, fraction) = text.split_once(decimal).unwrap_or((text, ""));
    let digits = |t: &str| t.bytes().all(|b| b.is_ascii_digit());
    let unsigned = whole.strip_prefix('-').unwrap_or(whole);
    if unsigned.len() < LONG_DIGITS || !digits(unsigned) || !digits(fraction) || whole.starts_with('-') {
        return None;
    }
    Some((whole.parse().ok()?, if fraction.is_empty() { 0.0 } else { format!("0.{fraction}").parse().ok()? }))
}

/// The number in a cell.
pub(super) fn number(cell: &str, decimal: char) -> Option<f64> {
    let cell = cell.trim();
    let first = cell.bytes().find(|b| !matches!(b, b'+' | b'-'))?;
    if !(first.is_ascii_digit() || first == b'.' || first == b',') {
        return None;
    }
    let finite = |text: &str| text.parse::<f64>().ok().filter(|v| v.is_finite());
    let thousands = |mark: char| {
        let whole = cell.split_once(decimal).map_or(cell, |(whole, _)| whole).trim_start_matches(['+', '-']);
        let mut groups = whole.split(mark);
        let begins = groups.next().is_some_and(|g| (1..=3).contains(&g.len()));
        begins
            && whole.contains(mark)
            && groups.all(|g| g.len() == 3)
            && whole.bytes().all(|b| b.is_ascii_digit() || !b.is_ascii() || b == mark as u8)
    };
    let plain = |text: &str| if decimal == ',' { finite(&text.replace(',', ".")) } else { finite(text) };
    let other = if decimal == ',' { '.' } else { ',' };
    if !cell.contains(other) && cell.is_ascii() && !cell.contains([' ', '\'']) {
        return if decimal == '.' { finite(cell) } else { plain(cell) };
    }
    // Marks between thousands: 1.234,5 · 1,234.5 · 1 234,5 with spaces of any kind · 1'234.5.
    [other, ' ', '\u{a0}', '\u{202f}', '\''].into_iter().find(|mark| thousands(*mark)).and_then(|mark| plain(&cell.replace(mark, "")))
}

/// A date with time, or a time of day: whole seconds and the fraction. Two numbers with a colon are minutes and seconds, as spreadsheets
/// show them.
pub(super) fn seconds(cell: &str) -> Option<(i64, f64)> {
    if cell.len() < 5 || !cell.contains(':') || !cell.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let with_point = cell.replace(',', ".");
    let parts = |stamp: jiff::Timestamp| (stamp.as_second(), f64::from(stamp.subsec_nanosecond()) * 1e-9);
    let slashes = with_point.replace('/', "-");
    if let Ok(stamp) = slashes.parse::<jiff::Timestamp>() {
        return Some(parts(stamp));
    }
    if let Ok(date) = slashes.parse::<jiff::civil::DateTime>() {
        return Some(parts(date.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp()));
    }
    // The day of a date in another order does not matter within a recording.
    let clock = match with_point.split_once(' ') {
        Some((date, clock)) if date.chars().all(|c| c.is_ascii_digit() || matches!(c, '.' | '-' | '/')) => clock,
        Some(_) => return None,
        None => with_point.as_str(),
    };
    let numbers: Vec<&str> = clock.split(':').collect();
    let whole = |text: &str, limit: i64| text.parse::<i64>().ok().filter(|v| (0..limit).contains(v));
    let (hours, minutes, second) = match numbers[..] {
        [h, m, s] => (whole(h, i64::from(u32::MAX))?, whole(m, 60)?, s),
        [m, s] => (0, whole(m, i64::from(u32::MAX))?, s),
        _ => return None,
    };
    let second: f64 = second.parse().ok().filter(|s| (0.0..61.0).contains(s))?;
    Some((3600 * hours + 60 * minutes + second.floor() as i64, second.fract()))
}

/// The cell is a hexadecimal number.
pub(super) fn is_hexadecimal(cell: &str) -> bool {
    cell.strip_prefix("0x").or_else(|| cell.strip_prefix("0X")).is_some_and(|d| !d.is_empty() && d.bytes().all(|b| b.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_between_thousands_are_read() {
        for (text, decimal) in [("1.234,5", ','), ("1,234.5", '.'), ("1 234,5", ','), ("1\u{202f}234,5", ','), ("1'234.5", '.')] {
            assert_eq!(number(text, decimal), Some(1234.5), "{text}");
        }
        for (text, decimal) in [("1.23,4", ','), ("12,34.5", '.'), ("-0.17333,", ','), (",,1", ','), ("1,2", '.'), ("2024-05-01", '.')] {
            assert_eq!(number(text, decimal), None, "{text}");
        }
    }

    #[test]
    fn clocks_are_seconds() {
        assert_eq!(seconds("12:00:01.250"), Some((43_201, 0.25)));
        assert_eq!(seconds("01:02.500"), Some((62, 0.5)));
        let date = seconds("2024-05-01 12:00:00.5+02:00").expect("a date");
        assert_eq!(date, (1_714_557_600, 0.5));
        assert_eq!(seconds("2024-05-01T10:00:00,5").map(|d| d.0), Some(1_714_557_600));
        assert_eq!(seconds("01.05.2024 10:00:00").map(|d| d.0), Some(36_000));
        assert_eq!(seconds("rst:0x1"), None);
    }

    #[test]
    fn digits_of_long_counts_are_kept() {
        let mut origin = None;
        let read = |text: &str, origin: &mut Option<i64>| cell(text, '.', origin);
        assert_eq!(read("1714557600000000001", &mut origin), Cell::Number(0.0));
        assert_eq!(read("1714557600000000008", &mut origin), Cell::Number(7.0));
        let mut origin = None;
        assert_eq!(read("1714557600.25", &mut origin), Cell::Number(0.25));
        assert_eq!(read("1714557601.125", &mut origin), Cell::Number(1.125));
        let mut origin = None;
        assert_eq!(read("1.5", &mut origin), Cell::Number(1.5));
        assert_eq!(read("1714557600", &mut origin), Cell::Number(1_714_557_600.0));
    }

    #[test]
    fn separators_in_quotes_separate_nothing() {
        assert_eq!(split("\"1,5\",\"2\", 3", ',').collect::<Vec<_>>(), ["1,5", "2", "3"]);
        assert_eq!(split("a;;b;", ';').collect::<Vec<_>>(), ["a", "", "b", ""]);
        assert_eq!(split(" \"motor speed\"  2\t3 ", ' ').collect::<Vec<_>>(), ["motor speed", "2", "3"]);
    }
}
