//! The lines before the rows: names, units, and facts that oscilloscopes and loggers state there.

use super::cells::{number, split};
use super::{ColumnKind, Layout, Line, comment};
use crate::log::error::LogErrorKind;
use crate::log::import::units::Unit;

/// Begin of the name of a column without one.
pub(super) const UNNAMED: &str = "column_";

/// What the lines before the rows say.
pub(super) struct Header<'a> {
    /// A unique name for each column.
    pub names: Vec<String>,
    /// A unit for each column; empty where none is stated.
    pub units: Vec<String>,
    /// Lines before the header that are not notes.
    pub preamble: usize,
    /// The line of names.
    pub line: Option<&'a str>,
    /// A line of words directly before the rows whose number of cells does not fit them.
    pub unmatched: Option<String>,
}

/// Names and units from the lines `before` the first row. A header in a comment is one too, if it has a name for each column.
///
/// # Errors
/// The rows have twice as many cells as names: commas between columns and in numbers.
pub(super) fn header<'a>(before: &[Line<'a>], lines: &[Line<'a>], first_line: usize, layout: &Layout) -> Result<Header<'a>, LogErrorKind> {
    let none = || vec![String::new(); layout.width];
    let stated = stated_units(before, layout);
    let mut from_end = before.iter().rev();
    let last = from_end.next().map(|(_, line)| *line);
    if let Some(last) = last
        && layout.separator == ','
        && layout.decimal == '.'
    {
        let named = split(last, ',').filter(|c| !c.is_empty()).count();
        if named > 1 && layout.width == 2 * named && !last.starts_with(|c: char| c.is_ascii_digit()) {
            return Err(LogErrorKind::CommasBetweenAndInNumbers { names: named, cells: layout.width });
        }
    }
    if let Some(cells) = last.and_then(|line| fitting(line, layout)) {
        let above = before.iter().rev().nth(1).map(|(_, line)| *line);
        if is_unit_row(&cells, layout)
            && let Some(names) = above.and_then(|line| fitting(line, layout))
        {
            let units = cells.iter().map(|c| inner(c).to_owned()).map(|c| if Unit::parse(&c).is_some() { c } else { String::new() });
            return Ok(Header { names: unique(&names), units: units.collect(), preamble: before.len() - 2, line: above, unmatched: None });
        }
        return Ok(Header {
            names: unique(&cells),
            units: stated.unwrap_or_else(none),
            preamble: before.len() - 1,
            line: last,
            unmatched: None,
        });
    }
    let commented = lines.iter().take_while(|(number, _)| *number < first_line).filter_map(|(_, l)| comment(l));
    let commented = commented.filter(|l| !l.contains(": ")).filter_map(|l| fitting(l.trim(), layout)).last();
    let names = commented.filter(|names| names.iter().any(|n| n.chars().any(char::is_alphabetic)));
    let line = names.as_ref().map(|_| "");
    let is_words = |line: &&str| split(line, layout.separator).filter(|c| c.chars().any(char::is_alphabetic)).count() > 1;
    let unmatched = last.filter(|line| names.is_none() && is_words(line)).map(|line| line.trim().chars().take(80).collect());
    Ok(Header { names: unique(&names.unwrap_or_else(none)), units: stated.unwrap_or_else(none), preamble: before.len(), line, unmatched })
}

/// The cells of a line of names, one for each column; `None` if their number does not fit the rows.
fn fitting(line: &str, layout: &Layout) -> Option<Vec<String>> {
    let mut cells: Vec<String> = Vec::new();
    for cell in split(line, layout.separator) {
        match cells.last_mut() {
            // A unit in brackets after a space belongs to the name before it.
            Some(name) if layout.separator == ' ' && cell.starts_with(['[', '(']) => *name = format!("{name} {cell}"),
            _ => cells.push(cell.to_owned()),
        }
    }
    // Units in brackets separate names of several words.
    if layout.separator == ' ' && cells.len() > layout.width {
        let mut parts = line.split_inclusive([']', ')']).map(|part| part.trim().to_owned()).filter(|part| !part.is_empty());
        let named: Vec<String> = parts.by_ref().collect();
        if named.len() == layout.width {
            cells = named;
        }
    }
    let is_empty = |k: usize| layout.kinds[k] == ColumnKind::Empty;
    if cells.len() + 1 == layout.width && !is_empty(layout.width - 1) {
        // R names its rows and not the column of these names.
        cells.insert(0, String::new());
    }
    // Spaces in names make more cells; then nobody knows which name is whose. Names without a column stand at the end.
    let fits = cells.len() + 1 == layout.width || cells.len() == layout.width || (cells.len() > layout.width && layout.separator != ' ');
    cells.resize(layout.width, String::new());
    let words = cells.iter().filter(|c| c.chars().any(char::is_alphabetic) && number(c, layout.decimal).is_none()).count();
    (fits && words > 0).then_some(cells)
}

fn inner(cell: &str) -> &str {
    cell.trim_matches(|c| matches!(c, '[' | ']' | '(' | ')'))
}

/// At least half of the columns of numbers have a unit.
fn is_unit_row(cells: &[String], layout: &Layout) -> bool {
    let of_numbers: Vec<&str> =
        cells.iter().zip(&layout.kinds).filter(|(_, kind)| **kind == ColumnKind::Number).map(|(cell, _)| inner(cell)).collect();
    let units = of_numbers.iter().filter(|c| Unit::parse(c).is_some()).count();
    let other = of_numbers.iter().filter(|c| !c.is_empty() && !matches!(**c, "-" | "1" | "%") && Unit::parse(c).is_none()).count();
    units > 0 && units > other
}

/// Units from a line such as `Vertical Units,V,A` or `Y_Unit_Label  V  A  rad/s`: those of the columns after the first.
fn stated_units(before: &[Line], layout: &Layout) -> Option<Vec<String>> {
    before.iter().rev().find_map(|(_, line)| {
        let mut cells = split(line, layout.separator);
        let key = cells.next()?.to_lowercase();
        if !key.contains("unit") || key.contains("horizontal") || key.starts_with('x') {
            return None;
        }
        let units: Vec<String> =
            cells.map(|c| c.rsplit_once(':').map_or(c, |(_, unit)| unit).to_owned()).filter(|c| !c.is_empty()).collect();
        (units.len() + 1 == layout.width && units.iter().any(|u| Unit::parse(u).is_some()))
            .then(|| std::iter::once(String::new()).chain(units).collect())
    })
}

/// A unique name for each column. A number is no name.
fn unique(given: &[String]) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(given.len());
    for (k, name) in given.iter().enumerate() {
        let name = name.trim();
        let is_name = !name.is_empty() && name.parse::<f64>().is_err();
        let base = if is_name { name.to_owned() } else { format!("{UNNAMED}{}", k + 1) };
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

/// Words for the interval between rows, and for their rate.
const INTERVAL_WORDS: [&str; 7] =
    ["sample interval", "sampling interval", "delta_x", "increment", "sample period", "sampling period", "abtastintervall"];
const RATE_WORDS: [&str; 5] = ["sample rate", "sampling rate", "sampling frequency", "sample frequency", "abtastrate"];

/// The interval of the rows, s, and the words for it, that the lines before the rows or beside the first rows state.
pub(super) fn interval(before: &[Line], beside: &[Line], separator: char) -> Option<(f64, String)> {
    let from_pairs = before.iter().chain(beside).find_map(|(_, line)| {
        let lower = line.to_lowercase();
        let has = |words: &[&str]| words.iter().find_map(|w| lower.strip_prefix(w));
        let (rest, is_rate) = has(&INTERVAL_WORDS).map(|r| (r, false)).or_else(|| has(&RATE_WORDS).map(|r| (r, true)))?;
        let rest = rest.trim_start_matches(|c: char| !c.is_ascii_digit());
        let end = rest.find(|c: char| !(c.is_ascii_digit() || matches!(c, '.' | 'e' | '+' | '-'))).unwrap_or(rest.len());
        let (value, unit) = (rest[..end].parse::<f64>().ok()?, rest[end..].trim_start());
        let factor = |names: &[(&str, f64)]| names.iter().find(|n| unit.starts_with(n.0)).map_or(1.0, |n| n.1);
        let seconds = if is_rate {
            1.0 / (value * factor(&[("khz", 1e3), ("mhz", 1e6), ("ksa", 1e3), ("msa", 1e6)]))
        } else {
            value * factor(&[("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6)])
        };
        Some((
            seconds,
            lower[..lower.len() - lower.trim_start_matches(|c: char| c.is_alphabetic() || " _".contains(c)).len()].trim().to_owned(),
        ))
    });
    // Rigol: a column of the header, its number below it.
    let in_columns = || {
        before.windows(2).find_map(|pair| {
            let at = split(pair[0].1, separator).position(|c| c.eq_ignore_ascii_case("increment"))?;
            let value = number(split(pair[1].1, separator).nth(at)?, '.')?;
            Some((value, "increment".to_owned()))
        })
    };
    from_pairs.or_else(in_columns).filter(|(interval, _)| *interval > 0.0 && interval.is_finite())
}
