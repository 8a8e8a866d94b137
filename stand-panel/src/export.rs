//! Export of the visible range of the plots: the columns that the page shows become a log of the session, written by the library.
//!
//! In: the layout of the answer of `/api/log` (length of the head as u32, the head in JSON, padding to eight bytes, the columns as float64,
//! little-endian), of at most [`MAX_EXPORT`] bytes. Out: `export-N.parquet` or `export-N.csv`, a new file.

use std::io::ErrorKind;
use std::sync::Arc;

use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, State};
use axum::routing::post;
use axum::{Json, Router};
use embassy_futures::block_on;
use serde::Deserialize;
use serde_json::json;

use super::connection::PanelConnection;
use super::control::NOBODY;
use super::parts::Panel;
use super::request::{Admitted, Answer, ApiError, Shared, blocking};
use identification::log::{Column, Log, LogErrorKind, Note, Notes, is_own_name};
use stand_acquire::preparation::ColumnSettings;

/// Longest export, bytes: 64 000 rows of 24 columns are 12 MiB.
const MAX_EXPORT: usize = 64 << 20;
/// Most columns.
const MAX_COLUMNS: usize = 64;
/// Part of a column that may be missing.
const MAX_MISSING: f64 = 0.01;
/// What the page names the plots of the running stand.
const LIVE: &str = "live";

/// The routes below `/api`.
pub fn routes() -> Router<Arc<Panel>> {
    Router::new().route("/export", post(export).layer(DefaultBodyLimit::max(MAX_EXPORT)))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    /// `csv` or `parquet`.
    format: String,
    /// What is shown: [`LIVE`], or the series of an answer.
    of: String,
    columns: Vec<String>,
    rows: usize,
}

async fn export(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    blocking(move || {
        let (head, columns) = read(&body)?;
        if !matches!(head.format.as_str(), "csv" | "parquet") {
            return Err("the format is csv or parquet".into());
        }
        let Complete { columns, left_out, without } = complete(columns);
        let mut notes = if head.of == LIVE { live_notes(&panel) } else { Notes::default() };
        let of =
            if head.of == LIVE { format!("stream of {}", panel.line.name()) } else { panel.session.existing(&head.of).map(|_| head.of)? };
        notes.push(Note::Text("export_of", of));
        let log = Log::new("export", columns, notes)?;
        // Another export may take the name meanwhile.
        let name = loop {
            let name = panel.session.free_name("export", &head.format);
            match log.write_new(panel.session.new_file(&name)?) {
                Ok(()) => break name,
                Err(error) if matches!(&*error.kind, LogErrorKind::Write(cause) if cause.kind() == ErrorKind::AlreadyExists) => {}
                Err(error) => return Err(error.into()),
            }
        };
        Ok(Json(json!({"name": name, "rows": log.len(), "left_out": left_out, "without": without})))
    })
    .await
}

/// Notes on how the columns were made, as of a recording; none while the stand does not answer.
fn live_notes(panel: &Panel) -> Notes {
    let mut stand = PanelConnection::new(panel.line.clone(), NOBODY);
    block_on(ColumnSettings::query(&mut stand)).map_or_else(|_| Notes::default(), |settings| settings.notes(false))
}

/// Head and columns of a body.
fn read(body: &[u8]) -> Result<(Head, Vec<Column>), ApiError> {
    let broken = || ApiError::from("an export is its head and its columns as float64");
    let (length, rest) = body.split_first_chunk::<4>().ok_or_else(broken)?;
    let (head, values) = rest.split_at_checked(u32::from_le_bytes(*length) as usize).ok_or_else(broken)?;
    let head: Head = serde_json::from_slice(head).map_err(|error| ApiError::from(format!("head of the export: {error}")))?;
    let expected = head.rows.checked_mul(head.columns.len()).and_then(|cells| cells.checked_mul(8));
    if head.rows == 0 || head.columns.is_empty() || head.columns.len() > MAX_COLUMNS || expected != Some(values.len()) {
        return Err(broken());
    }
    if let Some(name) = head.columns.iter().find(|name| !is_own_name(name)) {
        return Err(format!("`{}`: no name of a column", name.escape_default()).into());
    }
    let cells = |bytes: &[u8]| bytes.as_chunks::<8>().0.iter().map(|cell| f64::from_le_bytes(*cell)).collect();
    let columns = head.columns.iter().zip(values.chunks_exact(8 * head.rows));
    let columns = columns.map(|(name, bytes)| Column { name: name.clone(), values: cells(bytes) }).collect();
    Ok((head, columns))
}

/// Columns without missing numbers.
#[derive(Debug, PartialEq)]
struct Complete {
    columns: Vec<Column>,
    /// Rows that were left out.
    left_out: usize,
    /// Names of the columns that were left out.
    without: Vec<String>,
}

/// A log has a number in every cell. Columns that lack many are left out, as the command of a mode that was not in force; then rows that
/// lack one.
fn complete(mut columns: Vec<Column>) -> Complete {
    let mut without = Vec::new();
    columns.retain(|column| {
        let missing = column.values.iter().filter(|value| !value.is_finite()).count();
        let is_kept = missing as f64 <= MAX_MISSING * column.values.len() as f64;
        if !is_kept {
            without.push(column.name.clone());
        }
        is_kept
    });
    let rows = columns.first().map_or(0, |column| column.values.len());
    let complete: Vec<bool> = (0..rows).map(|row| columns.iter().all(|column| column.values[row].is_finite())).collect();
    let left_out = complete.iter().filter(|complete| !**complete).count();
    if left_out > 0 {
        for column in &mut columns {
            let mut row = complete.iter();
            column.values.retain(|_| *row.next().unwrap_or(&true));
        }
    }
    Complete { columns, left_out, without }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(head: &str, values: &[f64]) -> Vec<u8> {
        let mut body = (head.len() as u32).to_le_bytes().to_vec();
        body.extend(head.as_bytes());
        values.iter().for_each(|value| body.extend(value.to_le_bytes()));
        body
    }

    #[test]
    fn incomplete_rows_and_columns_that_lack_many_are_left_out() {
        let head = r#"{"format":"csv","of":"live","columns":["t_s","u_V","rate_cmd_rad_s"],"rows":200}"#;
        let row = |k: i32| [f64::from(k), if k == 3 { f64::NAN } else { 5.0 }, if k < 100 { f64::NAN } else { 1.0 }];
        let values: Vec<f64> = (0..3).flat_map(|column| (0..200).map(move |k| row(k)[column])).collect();
        let (_, columns) = read(&body(head, &values)).ok().unwrap();
        let found = complete(columns);
        let shape: Vec<(&str, usize)> = found.columns.iter().map(|c| (c.name.as_str(), c.values.len())).collect();
        assert_eq!((shape, found.left_out, found.without), (vec![("t_s", 199), ("u_V", 199)], 1, vec!["rate_cmd_rad_s".to_owned()]));
        assert_eq!(found.columns[0].values[3], 4.0);
    }

    #[test]
    fn broken_bodies_are_refused_in_one_line() {
        let good = body(r#"{"format":"csv","of":"live","columns":["t_s"],"rows":1}"#, &[0.0]);
        assert!(read(&good).is_ok());
        let huge = body(r#"{"format":"csv","of":"live","columns":["t_s","a"],"rows":9223372036854775807}"#, &[0.0]);
        let name = body(r#"{"format":"csv","of":"live","columns":["a,b\n"],"rows":1}"#, &[0.0]);
        for body in [&good[..good.len() - 1], &good[..3], &[255; 40], &[], &huge, &name] {
            let Err(ApiError(_, message)) = read(body) else { panic!("{body:?}") };
            assert_eq!(message.lines().count(), 1, "{message}");
        }
    }
}
