//! Words for the warnings of a log's reader.

use crate::log::LogWarning;

/// A warning in one sentence, without its full stop.
pub fn log_warning(warning: &LogWarning) -> String {
    match warning {
        LogWarning::Imported { columns, import_file } => {
            format!("read as {} states: {}", import_file.display(), columns.join(", "))
        }
        LogWarning::RowsLeftOut { rows, column, first } => {
            let (rows, are) = if *rows == 1 { ("one row".to_owned(), "is") } else { (format!("{rows} rows"), "are") };
            format!("{rows} without a value {are} left out, column {column} has the most, the first in row {first}")
        }
        LogWarning::UnterminatedRow { line } => {
            format!("the last row (line {line}) does not end with a line break; its last number may be cut short")
        }
        LogWarning::EndMissing { rows } => {
            format!("the end of the log is missing: the recording was interrupted, or the file was copied in part; it has {rows} rows")
        }
        LogWarning::RowsChanged { rows, written } => {
            format!("its {rows} rows are not the {written} rows that were written: the file was edited or damaged")
        }
        LogWarning::EvenTimes { scatter_us } => {
            format!("the time stamps scatter by {scatter_us} µs rms, and the readings are evenly spaced: even times are used")
        }
        LogWarning::UnwrappedAngle { jumps } => {
            format!("theta_rad is wrapped to one turn ({jumps} jumps of 2π); it was continued over the turns")
        }
        LogWarning::NoteNotUnderstood { key, part, example } => {
            format!("note “{key}”: “{part}” was not understood and is not used; an example that is understood: {example}")
        }
    }
}
