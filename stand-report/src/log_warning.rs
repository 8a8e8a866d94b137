//! Words for the warnings of a log's reader.

use identification::log::{LogWarning, WordForm};

/// A warning in one sentence, without its full stop.
pub fn log_warning(warning: &LogWarning) -> String {
    match warning {
        LogWarning::Imported { statements, import_file } => {
            format!("read as {} states: {}", import_file.display(), statements.join(", "))
        }
        LogWarning::InLog { log, warning } => format!("{log}: {}", log_warning(warning)),
        LogWarning::RowsLeftOut { rows, column, first } => {
            let (rows, are) = if *rows == 1 { ("one row".to_owned(), "is") } else { (format!("{rows} rows"), "are") };
            format!("{rows} without a value {are} left out, column {column} has the most, the first in row {first}")
        }
        LogWarning::LinesSkipped { lines, line, text } => {
            let (lines, are) =
                if *lines == 1 { ("one line".to_owned(), "is no row and is") } else { (format!("{lines} lines"), "are no rows and are") };
            format!("{lines} among the rows {are} skipped, the first is line {line}: “{}” (cut short, or text)", text.escape_debug())
        }
        LogWarning::RepeatedRows { rows, first } => {
            format!("{rows} rows repeat the row before in time and values and are left out, the first is row {first}")
        }
        LogWarning::FirstRowLeftOut => "the first row is out of order in time (a line that is cut in front?) and is left out".to_owned(),
        LogWarning::ClockOverflow { bits, row } => {
            format!("the {bits}-bit timer of the time overflows before row {row}; the time was continued")
        }
        LogWarning::Midnight { row } => format!("the time of day passes midnight before row {row}; the time was continued"),
        LogWarning::ClockRestarts { runs, row } => {
            format!("the time restarts in row {row}: the file has {runs} runs, which are treated as {runs} logs")
        }
        LogWarning::CounterContinued { column, bits, overflows } => {
            format!("{column} is a {bits}-bit counter with {overflows} overflows; it was continued")
        }
        LogWarning::SlowColumn { column, readings, rows } => {
            format!("{column} has readings in {readings} of {rows} rows; it is interpolated between them")
        }
        LogWarning::SignedWords { column, bits, form, rows } => {
            let form = match form {
                WordForm::TwosComplement => "two’s complement",
                WordForm::SignAndMagnitude => "sign and magnitude",
            };
            format!("{column} has words of {bits} bits without their sign; it was restored ({form}, {rows} negative rows)")
        }
        LogWarning::UnterminatedRow { line } => {
            format!("the last row (line {line}) does not end with a line break; its last number may be cut short")
        }
        LogWarning::RowCutShort { line } => format!("the last row (line {line}) is cut short and left out"),
        LogWarning::EndMissing { rows } => {
            format!("the end of the log is missing: the recording was interrupted, or the file was copied in part; it has {rows} rows")
        }
        LogWarning::RowsChanged { rows, written } => {
            format!("its {rows} rows are not the {written} rows that were written: the file was edited or damaged")
        }
        LogWarning::EvenTimes { scatter_us } => {
            format!("the time stamps scatter by {scatter_us} µs rms, and the readings are evenly spaced: even times are used")
        }
        LogWarning::IrregularRows { longest_us } => format!(
            "the steps in time are irregular: each row is integrated over its own length, and only a step above {} ms is a gap",
            crate::numbers::plain(*longest_us as f64 * 1e-3, 3)
        ),
        LogWarning::OtherRate { column } => format!("the rate omega_rad_s is the column {column}, as the model states (rate_column)"),
        LogWarning::UnwrappedAngle { column, jumps } => {
            format!("{column} is wrapped to one turn ({jumps} jumps of 2π); it was continued over the turns")
        }
        LogWarning::NoteNotUnderstood { key, part, example } => {
            format!("note “{key}”: “{part}” was not understood and is not used; an example that is understood: {example}")
        }
    }
}
