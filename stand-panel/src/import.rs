//! Logs of other programs: the upload of a file into the session's folder, and what `stand log inspect` believes about its columns.
//!
//! In: a file of at most [`MAX_UPLOAD`] bytes whose length is declared; what the person states about its columns. Out: a file of the
//! session, which never replaces another; the answer of `stand log inspect`; with the person's consent `NAME.import.toml`.

use std::future::poll_fn;
use std::io::{self, ErrorKind, Write};
use std::pin::Pin;
use std::sync::Arc;

use axum::body::{Body, Bytes};
use axum::extract::{Query, State};
use axum::http::header::CONTENT_LENGTH;
use axum::http::{HeaderMap, StatusCode};
use axum::routing::post;
use axum::{Json, Router};
use hyper::body::Body as _;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::sync::mpsc;

use super::parts::Panel;
use super::request::{Admitted, Answer, ApiError, Name, Shared, blocking, parsed};
use super::session::quoted;
use identification::files;
use identification::log::KNOWN;
use identification::log::import::{ENDINGS, ImportMapping, Statements, file_of, inspect as inspect_log};
use stand_report::inspection as report;

/// Longest uploaded log, bytes: an hour of ten columns at 1 kHz as text.
pub const MAX_UPLOAD: u64 = 512 << 20;
/// Chunks of an upload that wait for the disk.
const CHUNKS: usize = 16;
/// Longest statement about a column, characters.
const MAX_STATEMENT: usize = 300;

/// The routes below `/api`.
pub fn routes() -> Router<Arc<Panel>> {
    Router::new().route("/upload", post(upload)).route("/inspect", post(inspect))
}

fn conflict(name: &str) -> ApiError {
    ApiError(StatusCode::CONFLICT, format!("`{name}`: a file of this name exists in the session; rename the new one"))
}

/// Writes the body into a new file of the session.
async fn upload(_: Admitted, State(panel): Shared, Query(Name { name }): Query<Name>, headers: HeaderMap, mut body: Body) -> Answer {
    let declared = headers.get(CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    let declared = declared.ok_or_else(|| ApiError(StatusCode::LENGTH_REQUIRED, "an upload declares its length".to_owned()))?;
    if declared > MAX_UPLOAD {
        let message = format!("`{name}`: {} MiB at most", MAX_UPLOAD >> 20);
        return Err(ApiError(StatusCode::PAYLOAD_TOO_LARGE, message));
    }
    let path = panel.session.new_file(&name)?;
    let ending = path.extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    if !ending.is_some_and(|ending| ENDINGS.contains(&ending.as_str())) {
        return Err(format!("`{name}`: a log ends with .{}", ENDINGS.join(", .")).into());
    }
    // An import file without its log would be taken for that of the new one.
    if path.symlink_metadata().is_ok() || file_of(&path).symlink_metadata().is_ok() {
        return Err(conflict(&name));
    }
    let (chunks, mut received) = mpsc::channel::<Bytes>(CHUNKS);
    let writing = tokio::task::spawn_blocking(move || {
        files::create_new(&path, |out| {
            let mut length = 0;
            while let Some(chunk) = received.blocking_recv() {
                length += chunk.len() as u64;
                out.write_all(&chunk)?;
            }
            if length == declared { Ok(()) } else { Err(io::Error::new(ErrorKind::UnexpectedEof, "the upload broke off")) }
        })
    });
    // An error of the body leaves bytes missing, which the writer notices. So does a request that ends by its time limit.
    while let Some(Ok(frame)) = poll_fn(|context| Pin::new(&mut body).poll_frame(context)).await {
        let Ok(chunk) = frame.into_data() else { continue };
        if chunks.send(chunk).await.is_err() {
            break;
        }
    }
    drop(chunks);
    match writing.await? {
        Ok(()) => Ok(Json(json!({"name": name, "bytes": declared}))),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(conflict(&name)),
        Err(error) => Err(format!("`{name}`: {error}").into()),
    }
}

/// What the person states about a log, and whether it is to be accepted.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InspectRequest {
    name: String,
    /// Column of the file and column of the project; `-`: not used.
    #[serde(default)]
    columns: Vec<(String, String)>,
    /// Column and unit.
    #[serde(default)]
    units: Vec<(String, String)>,
    sample_rate_Hz: Option<f64>,
    /// Column and how it was made; an empty text removes the note.
    #[serde(default)]
    notes: Vec<(String, String)>,
    /// Write the import file.
    #[serde(default)]
    accept: bool,
}

/// `stand log inspect`.
async fn inspect(_: Admitted, State(panel): Shared, body: Bytes) -> Answer {
    let InspectRequest { name, columns, units, sample_rate_Hz, notes, accept } = parsed(&body)?;
    let statements = Statements { columns, units, sample_rate_Hz, notes };
    blocking(move || {
        check(&statements)?;
        let path = panel.session.existing(&name)?;
        let inspection = inspect_log(&path, &statements)?;
        let mut answer = report::json(&inspection);
        let command = command(&name, &statements, accept);
        if accept {
            if let Some(open) = report::open_question(&inspection) {
                return Err(format!("{name}: {open}").into());
            }
            if file_of(&path).is_file() && ImportMapping::beside(&path)?.is_none() {
                let message = format!("{name}: its import file is that of another log of the same stem; rename one of them");
                return Err(ApiError(StatusCode::CONFLICT, message));
            }
            inspection.accept()?;
            panel.hub.note(&command, &[], &[]);
            panel.session.note_command(&command);
            answer["is_mapped"] = true.into();
        }
        answer["name"] = name.into();
        answer["command"] = command.into();
        answer["text"] = report::text(&inspection).into();
        answer["notes"] = serde_json::to_value(&inspection.mapping.notes)?;
        answer["sample_rate_Hz"] = inspection.mapping.sample_rate_Hz.into();
        answer["known"] = known_columns();
        Ok(Json(answer))
    })
    .await
}

/// The columns of the project, for the choice.
fn known_columns() -> Value {
    KNOWN.iter().map(|column| json!({"name": column.name, "unit": column.unit, "description": column.description})).collect()
}

/// Statements are single lines of moderate length, and notes are understood.
fn check(statements: &Statements) -> Result<(), ApiError> {
    let pairs = statements.columns.iter().chain(&statements.units).flat_map(|(a, b)| [(a, false), (b, false)]);
    // A note without a text is one that is removed.
    let notes = statements.notes.iter().flat_map(|(key, text)| [(key, false), (text, true)]);
    for (text, may_be_empty) in pairs.chain(notes) {
        if text.trim().is_empty() && !(may_be_empty && text.is_empty())
            || text.chars().count() > MAX_STATEMENT
            || text.chars().any(char::is_control)
        {
            return Err(format!("a statement about a column is one line of 1 to {MAX_STATEMENT} characters").into());
        }
    }
    if statements.sample_rate_Hz.is_some_and(|rate| !(rate.is_finite() && rate > 0.0)) {
        return Err("the row rate is more than 0 Hz".into());
    }
    match report::note_not_understood(&statements.notes) {
        Some(message) => Err(message.into()),
        None => Ok(()),
    }
}

/// The command that does the same in a shell.
fn command(name: &str, statements: &Statements, accept: bool) -> String {
    let mut command = format!("stand log inspect {name}");
    let options = [("--map", &statements.columns), ("--unit", &statements.units), ("--note", &statements.notes)];
    for (option, pairs) in options {
        pairs.iter().for_each(|(a, b)| command += &format!(" {option} {}", quoted(&format!("{a}={b}"))));
    }
    command += &statements.sample_rate_Hz.map_or_else(String::new, |rate| format!(" --sample-rate {rate}"));
    if accept { command + " --accept" } else { command }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_is_one_line_that_a_shell_reads_as_its_words() {
        let pair = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        let statements = Statements {
            columns: vec![pair("it's $(reboot) `x`", "u_V")],
            units: vec![pair("t", "ms")],
            sample_rate_Hz: Some(500.0),
            notes: vec![pair("u_V", "at t")],
        };
        let expected =
            r"stand log inspect a.csv --map 'it'\''s $(reboot) `x`=u_V' --unit t=ms --note 'u_V=at t' --sample-rate 500 --accept";
        assert_eq!(command("a.csv", &statements, true), expected);
        assert!(check(&Statements { units: vec![pair("t", "ms\nreboot")], ..Statements::default() }).is_err());
        assert!(check(&Statements { sample_rate_Hz: Some(-1.0), ..Statements::default() }).is_err());
        assert!(check(&Statements { notes: vec![pair("u_V", "at t")], ..Statements::default() }).is_ok());
    }
}
