//! Lines of labels and numbers, as sketches write them for a serial plotter: `t:12 u:1.5 speed=3.2`.

use super::{Dialect, Line, SAMPLED_LINES, SHOWN_CHARACTERS, SkipReason, SkippedLine, Table, TableColumn, number};

/// The pairs of a line; `None` if it is no line of pairs.
fn pairs(line: &str) -> Option<Vec<(&str, f64)>> {
    // A space may follow the mark: "u: 1.5".
    let mut list = Vec::new();
    let mut rest = line.trim();
    while !rest.is_empty() {
        let at = rest.find([':', '='])?;
        let label = rest[..at].trim();
        let begins = label.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_');
        if !begins || label.contains([',', ';', '\t', '"']) {
            return None;
        }
        let value = rest[at + 1..].trim_start();
        let end = value.find(|c: char| c.is_whitespace() || c == ',' || c == ';').unwrap_or(value.len());
        list.push((label, number(&value[..end], '.')?));
        rest = value[end..].trim_start_matches(|c: char| c.is_whitespace() || c == ',' || c == ';');
    }
    (list.len() > 1).then_some(list)
}

/// The table, if most lines have the same labels.
pub(super) fn parse(plain: &[Line]) -> Option<Table> {
    let mut sample: Vec<Vec<&str>> =
        plain.iter().rev().take(SAMPLED_LINES).filter_map(|(_, l)| Some(pairs(l)?.into_iter().map(|p| p.0).collect())).collect();
    if sample.len() * 2 < plain.len().min(SAMPLED_LINES) {
        return None;
    }
    let labels = sample.swap_remove(sample.len() / 2);
    let mut columns: Vec<TableColumn> = labels
        .iter()
        .enumerate()
        .map(|(k, label)| TableColumn { name: (*label).to_owned(), position: k + 1, ..TableColumn::default() })
        .collect();
    let (mut skipped, mut first_line, mut preamble) = (Vec::new(), None, 0);
    for (number, line) in plain {
        let found = pairs(line).filter(|p| p.iter().map(|p| p.0).eq(labels.iter().copied()));
        let Some(found) = found else {
            if first_line.is_none() {
                preamble += 1;
            } else {
                let (text, before_row) = (line.chars().take(SHOWN_CHARACTERS).collect(), columns[0].values.len() + 1);
                skipped.push(SkippedLine { line: *number, text, before_row, reason: SkipReason::Cut });
            }
            continue;
        };
        first_line.get_or_insert(*number);
        columns.iter_mut().zip(found).for_each(|(column, (_, value))| column.values.push(value));
    }
    let dialect = Some(Dialect { separator: ' ', decimal: '.', has_header: true });
    Some(Table { columns, first_line, preamble, skipped, dialect, ..Table::default() })
}
