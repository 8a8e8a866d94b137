//! Reads tables from text files of other programs: commas, semicolons, tabs, spaces or bars between cells, decimal points or commas, lines before the
//! header, a row of units, no header at all.
//!
//! The separators are those that make most cells numbers. The native reader ([`crate::log::csv`]) is stricter and streams; this one holds the text.

use std::path::Path;

use super::table::{Dialect, Table, TableColumn};
use super::units::Unit;
use crate::log::error::{LogError, LogErrorKind};

/// Lines from which the separators are found.
const SAMPLED_LINES: usize = 400;
/// Fraction of numeric cells of a line that makes it a row.
const MIN_NUMERIC_FRACTION: f64 = 0.5;
/// Separators in the order of preference.
const SEPARATORS: [char; 5] = ['\t', ';', ',', '|', ' '];

/// Reads the table in `path`; `stated` are the separators of an import file.
pub fn read(path: &Path, stated: Option<Dialect>) -> Result<Table, LogError> {
    let bytes = std::fs::read(path).map_err(|e| LogError::new(path, LogErrorKind::Read(e)))?;
    let text = decoded(&bytes).ok_or_else(|| LogError::new(path, LogErrorKind::NotText("")))?;
    parse(&text, stated).map_err(|kind| LogError::new(path, kind))
}

/// The text of a file: UTF-8, UTF-16 with its mark, or else Latin-1. `None` for bytes that are no text.
fn decoded(bytes: &[u8]) -> Option<String> {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units: Vec<u16> = bytes[2..].chunks_exact(2).map(|pair| from([pair[0], pair[1]])).collect();
        String::from_utf16(&units).ok()
    };
    match bytes {
        [0xff, 0xfe, ..] => wide(u16::from_le_bytes),
        [0xfe, 0xff, ..] => wide(u16::from_be_bytes),
        _ if bytes.iter().take(4096).any(|b| *b == 0) => None,
        _ => Some(match std::str::from_utf8(bytes) {
            Ok(text) => text.strip_prefix('\u{feff}').unwrap_or(text).to_owned(),
            Err(_) => bytes.iter().map(|b| char::from(*b)).collect(),
        }),
    }
}

/// A line that is a comment in common formats.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix('#').or_else(|| line.strip_prefix('%')).or_else(|| line.strip_prefix("//"))
}

fn parse(text: &str, stated: Option<Dialect>) -> Result<Table, LogErrorKind> {
    let lines: Vec<(usize, &str)> = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim_end_matches('\r'))).collect();
    let plain: Vec<(usize, &str)> = lines.iter().copied().filter(|(_, l)| !l.trim().is_empty() && comment(l).is_none()).collect();
    if plain.is_empty() {
        return Err(if lines.iter().any(|(_, l)| !l.trim().is_empty()) { LogErrorKind::NotesOnly } else { LogErrorKind::Empty });
    }
    let (separator, decimal) = match stated {
        Some(d) => (d.separator, d.decimal),
        None => separators(&plain).ok_or(LogErrorKind::NoNumbers)?,
    };
    let cells = |line: &'_ str| -> Vec<String> { split(line, separator).map(str::to_owned).collect() };
    let is_row = |line: &str| {
        let (mut numeric, mut all) = (0usize, 0usize);
        for cell in split(line, separator) {
            numeric += usize::from(number(cell, decimal).is_some() || seconds(cell).is_some());
            all += usize::from(!cell.is_empty());
        }
        all > 0 && numeric as f64 >= MIN_NUMERIC_FRACTION * all as f64
    };
    // The width of the table is that of most of its rows: a line of the preamble may consist of numbers too.
    let sampled: Vec<usize> =
        plain.iter().rev().take(SAMPLED_LINES).filter(|(_, l)| is_row(l)).map(|(_, l)| split(l, separator).count()).collect();
    let width = most_frequent(&sampled).ok_or(LogErrorKind::NoNumbers)?;
    let first = plain.iter().position(|(_, l)| is_row(l) && split(l, separator).count() == width).ok_or(LogErrorKind::NoNumbers)?;
    let (header, units, preamble) = header(&plain[..first], &lines, plain[first].0, width, &cells);
    let mut names = names(header.as_deref(), width);
    let mut columns: Vec<TableColumn> = names
        .drain(..)
        .zip(units.into_iter().chain(std::iter::repeat(String::new())))
        .map(|(name, unit)| TableColumn { name, unit, values: Vec::with_capacity(plain.len() - first), text: None, is_date: false })
        .collect();
    for (row, (_, line)) in plain[first..].iter().enumerate() {
        let mut cells = split(line, separator);
        for column in &mut columns {
            let cell = cells.next().unwrap_or("");
            let value = match number(cell, decimal) {
                Some(value) => value,
                None => match seconds(cell) {
                    Some(value) => {
                        column.is_date = true;
                        value
                    }
                    None => {
                        if !is_missing(cell) && column.text.is_none() {
                            column.text = Some((row + 1, cell.chars().take(40).collect()));
                        }
                        f64::NAN
                    }
                },
            };
            column.values.push(value);
        }
    }
    // A separator at the end of each line makes an empty column.
    columns.retain(|c| !(c.is_text() && c.text.is_none() && c.name.starts_with("column_")));
    let notes = lines
        .iter()
        .filter_map(|(_, l)| comment(l))
        .filter_map(|l| l.split_once(':'))
        .map(|(k, v)| (k.trim().to_owned(), v.trim().to_owned()));
    Ok(Table {
        columns,
        notes: notes.collect(),
        first_line: Some(plain[first].0),
        dialect: Some(Dialect { separator, decimal, has_header: header.is_some() }),
        preamble,
    })
}

/// The cells of a line, without spaces and quotes.
fn split(line: &str, separator: char) -> Box<dyn Iterator<Item = &str> + '_> {
    if separator == ' ' { Box::new(line.split_whitespace().map(unquote)) } else { Box::new(line.split(separator).map(unquote)) }
}

fn unquote(cell: &str) -> &str {
    let cell = cell.trim();
    ['"', '\''].iter().find_map(|mark| cell.strip_prefix(*mark)?.strip_suffix(*mark)).map_or(cell, str::trim)
}

/// Separator and decimal mark that make most cells of the last lines numbers.
fn separators(plain: &[(usize, &str)]) -> Option<(char, char)> {
    let sample: Vec<&str> = plain.iter().rev().take(SAMPLED_LINES).map(|(_, l)| *l).collect();
    let pairs = SEPARATORS.into_iter().flat_map(|separator| ['.', ','].map(|decimal| (separator, decimal)));
    let score = |&(separator, decimal): &(char, char)| -> Option<(usize, usize, bool)> {
        let count = |line: &str| split(line, separator).filter(|cell| number(cell, decimal).is_some() || seconds(cell).is_some()).count();
        let widths: Vec<usize> = sample.iter().map(|l| split(l, separator).count()).collect();
        let width = most_frequent(&widths)?;
        let numeric: Vec<usize> = sample.iter().zip(&widths).filter(|(_, w)| **w == width).map(|(l, _)| count(l)).collect();
        let (all, cells) = (numeric.iter().sum::<usize>(), numeric.len() * width);
        // Cells of lines that consist of numbers only first: a wrong separator leaves pieces that are numbers too.
        let whole = numeric.iter().filter(|n| **n == width).count() * width;
        (all > 0 && all as f64 >= MIN_NUMERIC_FRACTION * cells as f64).then_some((whole, all, decimal == '.'))
    };
    let scored = pairs.filter(|(separator, decimal)| separator != decimal).filter_map(|pair| Some((score(&pair)?, pair)));
    // Of equal scores the first in the order of preference.
    scored.reduce(|best, next| if next.0 > best.0 { next } else { best }).map(|(_, found)| found)
}

fn most_frequent(values: &[usize]) -> Option<usize> {
    let mut counts: Vec<(usize, usize)> = Vec::new();
    for value in values {
        match counts.iter_mut().find(|(v, _)| v == value) {
            Some((_, n)) => *n += 1,
            None => counts.push((*value, 1)),
        }
    }
    counts.into_iter().max_by_key(|(value, n)| (*n, *value)).map(|(value, _)| value)
}

/// Names and units from the lines before the first row, and the number of other lines there. A header in a comment is one too, if it has a name for each
/// column.
fn header(
    before: &[(usize, &str)],
    lines: &[(usize, &str)],
    first_line: usize,
    width: usize,
    cells: &dyn Fn(&str) -> Vec<String>,
) -> (Option<Vec<String>>, Vec<String>, usize) {
    let fitting = |line: &str| Some(cells(line)).filter(|c| c.len() == width || (c.len() + 1 == width && !c.is_empty()));
    let as_unit = |cell: &String| {
        let inner = cell.trim_matches(|c| matches!(c, '[' | ']' | '(' | ')'));
        inner.is_empty() || matches!(inner, "-" | "1" | "%") || Unit::parse(inner).is_some()
    };
    let unit_of = |cell: &String| cell.trim_matches(|c| matches!(c, '[' | ']' | '(' | ')')).to_owned();
    let mut from_end = before.iter().rev().map(|(_, line)| fitting(line));
    if let Some(Some(last)) = from_end.next() {
        if last.iter().all(as_unit)
            && let Some(Some(names)) = from_end.next()
        {
            return (Some(names), last.iter().map(unit_of).collect(), before.len() - 2);
        }
        return (Some(last), Vec::new(), before.len() - 1);
    }
    let commented = lines.iter().take_while(|(number, _)| *number < first_line).filter_map(|(_, l)| comment(l));
    match commented.filter(|l| !l.contains(": ")).filter_map(|l| fitting(l.trim())).last() {
        Some(names) if names.iter().any(|n| n.chars().any(char::is_alphabetic)) => (Some(names), Vec::new(), before.len()),
        _ => (None, Vec::new(), before.len()),
    }
}

/// A unique name for each column.
fn names(header: Option<&[String]>, width: usize) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(width);
    for k in 0..width {
        let given = header.and_then(|h| h.get(k)).map(|n| n.trim()).filter(|n| !n.is_empty());
        let base = given.map_or_else(|| format!("column_{}", k + 1), str::to_owned);
        let mut name = base.clone();
        let mut copy = 2;
        while names.contains(&name) {
            name = format!("{base}#{copy}");
            copy += 1;
        }
        names.push(name);
    }
    names
}

/// A cell that states that there is no value.
fn is_missing(cell: &str) -> bool {
    matches!(cell.to_ascii_lowercase().as_str(), "" | "nan" | "na" | "n/a" | "null" | "none" | "-" | "--" | "inf" | "-inf" | "#n/a")
}

/// The number in a cell.
fn number(cell: &str, decimal: char) -> Option<f64> {
    let cell = cell.trim();
    let first = cell.bytes().find(|b| !matches!(b, b'+' | b'-'))?;
    if !(first.is_ascii_digit() || first == b'.' || first == b',') {
        return None;
    }
    let value = if decimal == '.' {
        cell.parse::<f64>().ok()
    } else if cell.contains('.') {
        // A decimal point beside decimal commas separates thousands: 1.234,5.
        cell.contains(',').then(|| cell.replace('.', "").replace(',', ".").parse::<f64>().ok()).flatten()
    } else {
        cell.replace(',', ".").parse::<f64>().ok()
    };
    value.filter(|v| v.is_finite())
}

/// A date with time, or a time of day, in seconds.
fn seconds(cell: &str) -> Option<f64> {
    if cell.len() < 5 || !cell.contains(':') || !cell.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let with_point = cell.replace(',', ".");
    if let Ok(stamp) = with_point.parse::<jiff::Timestamp>() {
        return Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9);
    }
    if let Ok(date) = with_point.parse::<jiff::civil::DateTime>() {
        let stamp = date.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp();
        return Some(stamp.as_second() as f64 + f64::from(stamp.subsec_nanosecond()) * 1e-9);
    }
    let mut parts = with_point.split(':');
    let (h, m, s) =
        (parts.next()?.parse::<f64>().ok()?, parts.next()?.parse::<f64>().ok()?, parts.next().unwrap_or("0").parse::<f64>().ok()?);
    (parts.next().is_none() && m < 60.0 && s < 61.0).then_some(3600.0 * h + 60.0 * m + s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        parse(text, None).expect("a table")
    }

    fn names_of(table: &Table) -> Vec<&str> {
        table.columns.iter().map(|c| c.name.as_str()).collect()
    }

    #[test]
    fn separators_and_decimal_marks_are_found() {
        for (text, separator, decimal) in [
            ("t;u\n0,001;1,5\n0,002;2,5\n", ';', ','),
            ("t\tu\n0,001\t1,5\n0,002\t2,5\n", '\t', ','),
            ("t,u\n0.001,1.5\n0.002,2.5\n", ',', '.'),
            ("t u\n0.001   1.5\n0.002  2.5\n", ' ', '.'),
            ("t|u\n0.001|1.5\n0.002|2.5\n", '|', '.'),
        ] {
            let table = table(text);
            assert_eq!(table.dialect, Some(Dialect { separator, decimal, has_header: true }), "{text}");
            assert_eq!(names_of(&table), ["t", "u"]);
            assert_eq!(
                (table.columns[0].values.as_slice(), table.columns[1].values.as_slice()),
                (&[0.001, 0.002][..], &[1.5, 2.5][..]),
                "{text}"
            );
        }
    }

    #[test]
    fn preamble_units_and_missing_cells_are_understood() {
        let scope = "Logger 3000\nRate: 1000 Hz\n\nTime,Channel A\n(ms),(mV)\n\n0,12.5\n1,\n2,13.5\n";
        let table = table(scope);
        assert_eq!(names_of(&table), ["Time", "Channel A"]);
        assert_eq!((table.columns[0].unit.as_str(), table.columns[1].unit.as_str()), ("ms", "mV"));
        assert_eq!((table.preamble, table.rows(), table.columns[1].missing()), (2, 3, 1));
    }

    #[test]
    fn header_may_be_missing_or_in_a_comment() {
        assert_eq!(names_of(&table("0.0 1.5 2\n0.1 2.5 3\n")), ["column_1", "column_2", "column_3"]);
        assert_eq!(names_of(&table("# t u omega\n0.0 1.5 2\n0.1 2.5 3\n")), ["t", "u", "omega"]);
    }

    #[test]
    fn dates_are_seconds() {
        let table = table("time;speed\n2024-05-01 12:00:00.000;1\n2024-05-01 12:00:00.010;2\n");
        assert!(table.columns[0].is_date);
        let t = &table.columns[0].values;
        assert!((t[1] - t[0] - 0.01).abs() < 1e-6, "{t:?}");
    }

    #[test]
    fn latin_1_and_utf_16_are_text() {
        assert_eq!(decoded(b"t;\xb0/s").as_deref(), Some("t;°/s"));
        assert_eq!(decoded(&[0xff, 0xfe, b't', 0, b';', 0]).as_deref(), Some("t;"));
        assert_eq!(decoded(&[1, 0, 2, 0]), None);
    }
}
