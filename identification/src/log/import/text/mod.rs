//! Reads tables from text files of other programs: commas, semicolons, tabs, spaces or bars between cells, decimal points or commas, lines
//! before the header, a row of units, no header at all, lines among the rows that are no rows.
//!
//! The separators are those that make most cells numbers. The native reader ([`crate::log::csv`]) is stricter and streams; this one holds
//! the text. Forms that are no table of lines: vectors of Octave ([`octave`]), pairs of labels and numbers ([`labels`]).

mod cells;
mod decode;
mod header;
mod labels;
mod octave;

use std::path::Path;

use super::table::{Dialect, SkipReason, SkippedLine, Table, TableColumn};
use crate::log::error::{LogError, LogErrorKind};
use crate::log::limits;
use cells::{Cell, cell, is_missing, number, seconds, split, unquote};

/// Lines from which the separators and the kinds of the columns are found.
const SAMPLED_LINES: usize = 400;
/// First lines by which the number of columns is limited.
const WIDTH_LINES: usize = 100;
/// Fraction of numeric cells that makes a line a row, and a column one of numbers.
const MIN_NUMERIC_FRACTION: f64 = 0.5;
/// Fraction of lines among the rows that may be no rows.
const MAX_SKIPPED_FRACTION: f64 = 0.05;
/// Separators in the order of preference.
const SEPARATORS: [char; 5] = ['\t', ';', ',', '|', ' '];
/// Between a time that a terminal program puts before a line, and the line.
const ARROW: &str = " -> ";
/// Characters of a line or cell in a message.
const SHOWN_CHARACTERS: usize = 40;

/// Reads the table in `path`; `stated` are the separators of an import file.
pub fn read(path: &Path, stated: Option<Dialect>) -> Result<Table, LogError> {
    let bytes = std::fs::read(path).map_err(|e| LogError::new(path, LogErrorKind::Read(e)))?;
    if bytes.starts_with(b"PK\x03\x04") {
        return Err(LogError::new(path, LogErrorKind::NotText("; it is a spreadsheet or another compressed file; export it as CSV")));
    }
    let text = decode::decoded(bytes).ok_or_else(|| LogError::new(path, LogErrorKind::NotText("")))?;
    parse(&text, stated).map_err(|kind| LogError::new(path, kind))
}

/// A line that is a comment in common formats.
fn comment(line: &str) -> Option<&str> {
    let line = line.trim_start();
    line.strip_prefix('#').or_else(|| line.strip_prefix('%')).or_else(|| line.strip_prefix("//"))
}

/// A line with its number, from 1.
type Line<'a> = (usize, &'a str);

fn parse(text: &str, stated: Option<Dialect>) -> Result<Table, LogErrorKind> {
    if octave::is_octave(text) {
        return octave::parse(text);
    }
    let lines: Vec<Line> = text.lines().enumerate().map(|(k, line)| (k + 1, line.trim_end_matches('\r'))).collect();
    let plain: Vec<Line> = lines.iter().copied().filter(|(_, l)| !l.trim().is_empty() && comment(l).is_none()).collect();
    // Before anything looks at single cells.
    for (_, line) in plain.iter().take(WIDTH_LINES) {
        let cells = SEPARATORS.iter().map(|separator| split(line, *separator).take(limits::MAX_COLUMNS + 1).count());
        limits::check_columns(cells.max().unwrap_or(0))?;
    }
    if plain.is_empty() {
        return Err(if lines.iter().any(|(_, l)| !l.trim().is_empty()) { LogErrorKind::NotesOnly } else { LogErrorKind::Empty });
    }
    if let Some(table) = labels::parse(&plain) {
        return Ok(table);
    }
    if let Some(text) = without_arrows(&plain, text) {
        return parse(&text, stated);
    }
    let (separator, decimal) = match stated {
        Some(d) => (d.separator, d.decimal),
        None => separators(&plain).ok_or_else(|| no_numbers(&plain))?,
    };
    let layout = Layout::of(&plain, separator, decimal).ok_or_else(|| no_numbers(&plain))?;
    limits::check_size(plain.len(), layout.width)?;
    let first = plain.iter().position(|(_, l)| layout.is_first_row(l)).ok_or_else(|| no_numbers(&plain))?;
    let head = header::header(&plain[..first], &lines, plain[first].0, &layout)?;
    let mut columns: Vec<TableColumn> = (0..layout.width)
        .map(|k| TableColumn {
            name: head.names[k].clone(),
            position: k + 1,
            unit: head.units[k].clone(),
            values: Vec::with_capacity(plain.len() - first),
            ..TableColumn::default()
        })
        .collect();
    let mut skipped = Vec::new();
    let mut origins = layout.origins();
    let unterminated = !text.ends_with(['\n', '\r']);
    for (index, &(line, text)) in plain.iter().enumerate().skip(first) {
        let rows = columns[0].values.len();
        let mut skip = |reason| {
            let text = text.chars().take(SHOWN_CHARACTERS).collect();
            skipped.push(SkippedLine { line, text, before_row: rows + 1, reason });
        };
        if head.line == Some(text) {
            skip(SkipReason::RepeatedHeader);
            continue;
        }
        // The last number of a file without a last line break may be cut short.
        if unterminated && index + 1 == plain.len() && rows > 1 {
            skip(SkipReason::Cut);
            continue;
        }
        let found = match layout.row(text, &mut origins) {
            Ok(found) => found,
            Err(reason) => {
                skip(reason);
                continue;
            }
        };
        for ((column, cell), text) in columns.iter_mut().zip(found).zip(split(text, separator).chain(std::iter::repeat(""))) {
            column.values.push(match cell {
                Cell::Number(value) => value,
                Cell::Time(value) => {
                    column.is_date = true;
                    value
                }
                Cell::Missing => f64::NAN,
                Cell::Text => {
                    column.text.get_or_insert_with(|| (rows + 1, text.chars().take(SHOWN_CHARACTERS).collect()));
                    f64::NAN
                }
            });
        }
    }
    let rows = columns[0].values.len();
    let damaged: Vec<&SkippedLine> = skipped.iter().filter(|s| s.reason != SkipReason::RepeatedHeader).collect();
    if let Some(example) = damaged.first().filter(|_| damaged.len() as f64 > 1.0 + MAX_SKIPPED_FRACTION * rows as f64) {
        return Err(LogErrorKind::NoRowsBetween { lines: damaged.len(), rows, line: example.line, text: example.text.clone() });
    }
    for (column, origin) in columns.iter_mut().zip(origins) {
        column.origin = origin.unwrap_or(0) as f64;
    }
    // A separator at the end of each line makes an empty column; facts about a recording stand beside its first rows.
    let mut index = 0;
    columns.retain(|c| {
        index += 1;
        layout.kinds[index - 1] != ColumnKind::Empty || !c.name.starts_with(header::UNNAMED) && (c.text.is_some() || !c.is_text())
    });
    let notes = lines
        .iter()
        .filter_map(|(_, l)| comment(l))
        .filter_map(|l| l.split_once(':'))
        .map(|(k, v)| (k.trim().to_owned(), v.trim().to_owned()));
    Ok(Table {
        columns,
        notes: notes.collect(),
        first_line: Some(plain[first].0),
        dialect: Some(Dialect { separator, decimal, has_header: head.line.is_some() }),
        preamble: head.preamble,
        unmatched_header: head.unmatched,
        skipped,
        stated_interval: header::interval(&plain[..first], &plain[first..(first + 8).min(plain.len())], separator),
    })
}

/// Why no line is a row.
fn no_numbers(plain: &[Line]) -> LogErrorKind {
    let hexadecimal =
        plain.iter().rev().take(SAMPLED_LINES).flat_map(|(_, l)| l.split([',', ';', '\t', ' '])).find(|c| cells::is_hexadecimal(c));
    match hexadecimal {
        Some(text) => LogErrorKind::Hexadecimal(text.to_owned()),
        None => LogErrorKind::NoNumbers,
    }
}

/// The text with the separator of the rows in place of the arrow that follows a terminal program's time.
fn without_arrows(plain: &[Line], text: &str) -> Option<String> {
    let stamped = |line: &&str| line.split_once(ARROW).is_some_and(|(time, _)| seconds(time.trim()).is_some());
    let sample: Vec<&str> = plain.iter().rev().take(SAMPLED_LINES).map(|(_, l)| *l).collect();
    if sample.iter().filter(|l| stamped(l)).count() * 2 < sample.len() {
        return None;
    }
    let stripped: Vec<Line> = sample.iter().filter_map(|l| Some((0, l.split_once(ARROW)?.1))).collect();
    let (separator, decimal) = separators(&stripped).unwrap_or(('\t', '.'));
    let time = |time: &str| if decimal == ',' { time.trim().replace('.', ",") } else { time.trim().to_owned() };
    let mut out = String::with_capacity(text.len());
    for line in text.lines() {
        match line.split_once(ARROW) {
            Some((stamp, rest)) => out.push_str(&format!("{}{separator}{}\n", time(stamp), rest.trim_end_matches('\r'))),
            None => out.push_str(&format!("{line}\n")),
        }
    }
    Some(out)
}

/// What the cells of a column mostly are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum ColumnKind {
    Number,
    Text,
    Empty,
}

/// How the rows of a text are made.
struct Layout {
    separator: char,
    decimal: char,
    /// Cells of a row.
    width: usize,
    kinds: Vec<ColumnKind>,
}

impl Layout {
    /// The layout of most lines; a line of the preamble may consist of numbers too.
    fn of(plain: &[Line], separator: char, decimal: char) -> Option<Layout> {
        let is_number = |cell: &str| number(cell, decimal).is_some() || seconds(cell).is_some() || is_truth(cell);
        let is_row = |line: &&str| {
            let filled: Vec<&str> = split(line, separator).filter(|c| !is_missing(c)).collect();
            let numeric = filled.iter().filter(|c| is_number(c)).count();
            numeric > 0 && numeric as f64 >= MIN_NUMERIC_FRACTION * filled.len() as f64
        };
        let sampled: Vec<&str> = plain.iter().rev().take(SAMPLED_LINES).map(|(_, l)| *l).filter(is_row).collect();
        let width = most_frequent(&sampled.iter().map(|l| split(l, separator).count()).collect::<Vec<_>>())?;
        let (mut numbers, mut texts, mut rows) = (vec![0usize; width], vec![0usize; width], 0usize);
        for line in sampled.iter().filter(|l| split(l, separator).count() == width) {
            rows += 1;
            for (k, cell) in split(line, separator).enumerate() {
                if is_number(cell) {
                    numbers[k] += 1;
                } else if !is_missing(cell) {
                    texts[k] += 1;
                }
            }
        }
        let kind = |k: usize| {
            if numbers[k] + texts[k] == 0 || 20 * (numbers[k] + texts[k]) < rows {
                ColumnKind::Empty
            } else if numbers[k] >= texts[k] {
                ColumnKind::Number
            } else {
                ColumnKind::Text
            }
        };
        let kinds: Vec<ColumnKind> = (0..width).map(kind).collect();
        kinds.contains(&ColumnKind::Number).then_some(Layout { separator, decimal, width, kinds })
    }

    fn origins(&self) -> Vec<Option<i64>> {
        vec![None; self.width]
    }

    /// The line is a row without text in a column of numbers, as facts before the header have it: `Probe Attenuation,1,10`.
    fn is_first_row(&self, line: &str) -> bool {
        let is_text = |(cell, kind): (&Cell, &ColumnKind)| *kind == ColumnKind::Number && *cell == Cell::Text;
        let is_one_of_numbers = |cells: Vec<Cell>| {
            cells.iter().any(|cell| matches!(cell, Cell::Number(_) | Cell::Time(_))) && !cells.iter().zip(&self.kinds).any(is_text)
        };
        self.row(line, &mut self.origins()).is_ok_and(is_one_of_numbers)
    }

    /// The cells of a line, or why it is no row. The origins change if it is one.
    fn row(&self, line: &str, origins: &mut [Option<i64>]) -> Result<Vec<Cell>, SkipReason> {
        let mut found = Vec::with_capacity(self.width);
        let mut zeros: Vec<Option<i64>> = origins.to_vec();
        let (mut numbers, mut texts) = (0, 0);
        // In a table of one column a line without a value is a row all the same: the rows after it have their times.
        if self.width == 1 && !line.trim().is_empty() && is_missing(unquote(line)) {
            return Ok(vec![Cell::Missing]);
        }
        for text in split(line, self.separator) {
            let Some(zero) = zeros.get_mut(found.len()) else {
                // More cells than columns: a comment, or two lines in one.
                if number(text, self.decimal).is_some() {
                    return Err(SkipReason::NoNumbers);
                }
                break;
            };
            let cell = cell(text, self.decimal, zero);
            if self.kinds[found.len()] == ColumnKind::Number {
                numbers += usize::from(matches!(cell, Cell::Number(_) | Cell::Time(_)));
                texts += usize::from(cell == Cell::Text);
            }
            found.push(cell);
        }
        let is_cut = self.kinds.iter().skip(found.len()).any(|k| *k == ColumnKind::Number);
        match (numbers, texts) {
            (0, _) => Err(SkipReason::NoNumbers),
            // The first cells of a line of words may be numbers.
            (_, 0) if is_cut => Err(SkipReason::Cut),
            (n, t) if is_cut || t >= n => Err(SkipReason::NoNumbers),
            _ => {
                found.resize(self.width, Cell::Missing);
                origins.copy_from_slice(&zeros);
                Ok(found)
            }
        }
    }
}

fn is_truth(cell: &str) -> bool {
    matches!(cell, "True" | "TRUE" | "true" | "False" | "FALSE" | "false")
}

/// Separator and decimal mark that make most cells of the last lines numbers.
fn separators(plain: &[Line]) -> Option<(char, char)> {
    let sample: Vec<&str> = plain.iter().rev().take(SAMPLED_LINES).map(|(_, l)| *l).collect();
    let is_quoted = sample.iter().any(|l| l.contains('"'));
    let pairs = SEPARATORS.into_iter().flat_map(|separator| ['.', ','].map(|decimal| (separator, decimal)));
    let score = |&(separator, decimal): &(char, char)| -> Option<(usize, usize, bool)> {
        let is_number = |cell: &str| number(cell, decimal).is_some() || seconds(cell).is_some();
        let widths: Vec<usize> = sample.iter().map(|l| split(l, separator).count()).collect();
        let width = most_frequent(&widths)?;
        let (mut whole, mut numeric, mut filled) = (0, 0, 0);
        for (line, _) in sample.iter().zip(&widths).filter(|(_, w)| **w == width) {
            let (mut numbers, mut all) = (0, 0);
            for cell in split(line, separator).filter(|c| !is_missing(c)) {
                numbers += usize::from(is_number(cell));
                all += 1;
            }
            // Cells of lines that consist of numbers only first: a wrong separator leaves pieces that are numbers too.
            whole += if numbers == all { all } else { 0 };
            numeric += numbers;
            filled += all;
        }
        (numeric > 0 && numeric as f64 >= MIN_NUMERIC_FRACTION * filled as f64).then_some((whole, numeric, decimal == '.'))
    };
    let scored = pairs.filter(|(separator, decimal)| separator != decimal || is_quoted).filter_map(|pair| Some((score(&pair)?, pair)));
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

#[cfg(test)]
mod tests;
