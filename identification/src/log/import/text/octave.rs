//! Text files of Octave, `save -text`: named vectors and matrices one after another, each below comments with its name and size.

use super::{Dialect, LogErrorKind, Table, TableColumn, number};

/// Columns of a matrix that are read at most.
const MAX_MATRIX_COLUMNS: usize = 64;

/// The text has variables in Octave's form.
pub(super) fn is_octave(text: &str) -> bool {
    let mut comments = text.lines().take(8).filter_map(|l| l.strip_prefix('#'));
    comments.any(|l| l.trim_start().starts_with("name:"))
}

/// The vectors of the most frequent length, as columns.
pub(super) fn parse(text: &str) -> Result<Table, LogErrorKind> {
    let mut variables: Vec<(String, Vec<Vec<f64>>)> = Vec::new();
    let mut is_matrix = false;
    for line in text.lines() {
        if let Some(comment) = line.strip_prefix('#') {
            match comment.split_once(':').map(|(key, value)| (key.trim(), value.trim())) {
                Some(("name", name)) => {
                    variables.push((name.to_owned(), Vec::new()));
                    is_matrix = false;
                }
                Some(("type", kind)) => is_matrix = matches!(kind, "matrix" | "float matrix" | "int32 matrix" | "bool matrix" | "range"),
                _ => {}
            }
        } else if is_matrix
            && !line.trim().is_empty()
            && let Some((_, rows)) = variables.last_mut()
        {
            let cells: Vec<f64> = line.split_whitespace().map(|c| number(c, '.').unwrap_or(f64::NAN)).collect();
            rows.push(cells);
        }
    }
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for (name, rows) in variables {
        // A row vector is a column too.
        if let [row] = &rows[..] {
            columns.push((name, row.clone()));
            continue;
        }
        let width = rows.first().map_or(0, Vec::len);
        if (1..=MAX_MATRIX_COLUMNS).contains(&width) && rows.iter().all(|r| r.len() == width) {
            for k in 0..width {
                let name = if width == 1 { name.clone() } else { format!("{name}_{}", k + 1) };
                columns.push((name, rows.iter().map(|r| r[k]).collect()));
            }
        }
    }
    let lengths: Vec<usize> = columns.iter().map(|c| c.1.len()).filter(|n| *n > 1).collect();
    let length = super::most_frequent(&lengths).ok_or(LogErrorKind::NoNumbers)?;
    let columns = columns.into_iter().filter(|c| c.1.len() == length).enumerate();
    Ok(Table {
        columns: columns.map(|(k, (name, values))| TableColumn { name, position: k + 1, values, ..TableColumn::default() }).collect(),
        dialect: Some(Dialect { separator: ' ', decimal: '.', has_header: true }),
        ..Table::default()
    })
}
