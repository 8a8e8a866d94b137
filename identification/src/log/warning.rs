//! Warnings of the readers; `report` words them.

use std::path::PathBuf;

/// A warning about the file of a log, which was read nevertheless.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LogWarning {
    /// A file of another program was read by its import file.
    Imported {
        /// Each used column, and each note, in words.
        statements: Vec<String>,
        /// The import file.
        import_file: PathBuf,
    },
    /// A warning about one of several logs.
    InLog {
        /// The log.
        log: String,
        /// The warning.
        warning: Box<LogWarning>,
    },
    /// Rows without a value in a used column were left out.
    RowsLeftOut {
        /// Number of rows.
        rows: usize,
        /// The column with the most missing values.
        column: String,
        /// Its first row without a value, from 1.
        first: usize,
    },
    /// Lines among the rows that are no rows were skipped.
    LinesSkipped {
        /// Number of lines.
        lines: usize,
        /// The first, from 1.
        line: usize,
        /// Its text, shortened.
        text: String,
    },
    /// Rows that repeat the row before in every used column were left out.
    RepeatedRows {
        /// Number of rows.
        rows: usize,
        /// The first, from 1.
        first: usize,
    },
    /// The first row is out of order in time, as a line that is cut in front, and was left out.
    FirstRowLeftOut,
    /// The timer of the logger overflowed; the time goes on.
    ClockOverflow {
        /// Bits of the timer.
        bits: u32,
        /// First row after the overflow, from 1.
        row: usize,
    },
    /// The time of day passed midnight; the time goes on.
    Midnight {
        /// First row after midnight, from 1.
        row: usize,
    },
    /// The clock restarts: the file has several runs.
    ClockRestarts {
        /// Number of runs.
        runs: usize,
        /// First row of the second, from 1.
        row: usize,
    },
    /// A counter overflowed and was continued.
    CounterContinued {
        /// The column of the file.
        column: String,
        /// Bits of the counter.
        bits: u32,
        /// Number of overflows.
        overflows: usize,
    },
    /// A column has readings in some rows only, and is interpolated between them.
    SlowColumn {
        /// The column.
        column: String,
        /// Rows with a reading.
        readings: usize,
        /// Rows.
        rows: usize,
    },
    /// Readings were logged as words without their sign, which was restored.
    SignedWords {
        /// The column of the file.
        column: String,
        /// Bits of a word.
        bits: u32,
        /// How the words have the sign.
        form: WordForm,
        /// Number of negative rows.
        rows: usize,
    },
    /// The last row does not end with a line break; its last number may be cut short.
    UnterminatedRow {
        /// Line of the file, from 1.
        line: usize,
    },
    /// The recording was interrupted within its last row, which is left out.
    RowCutShort {
        /// Line of the file, from 1.
        line: usize,
    },
    /// The notes of the end are missing: the recording was interrupted, or the file was copied in part.
    EndMissing {
        /// Number of rows in the file.
        rows: usize,
    },
    /// The rows are not those that were written, by their number or their SHA-256.
    RowsChanged {
        /// Number of rows in the file.
        rows: usize,
        /// Number of rows that were written, from the note.
        written: String,
    },
    /// The time stamps scatter although the readings are evenly spaced: even times are used.
    EvenTimes {
        /// Rms scatter of the stamps, µs.
        scatter_us: u64,
    },
    /// The steps in time are irregular: long ones are usual for the logger, and no gaps up to a limit.
    IrregularRows {
        /// The longest step that is no gap, µs.
        longest_us: u64,
    },
    /// The model compares another column as the rate.
    OtherRate {
        /// The column.
        column: String,
    },
    /// The angle was wrapped to one turn and is continued over the turns.
    UnwrappedAngle {
        /// The column.
        column: &'static str,
        /// Number of jumps by a turn.
        jumps: usize,
    },
    /// A part of a note was not understood and is not used.
    NoteNotUnderstood {
        /// Key of the note.
        key: String,
        /// The part.
        part: String,
        /// An example of a note that is understood.
        example: &'static str,
    },
}

/// How a word has its sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WordForm {
    /// −1 is the largest word.
    TwosComplement,
    /// The highest bit is the sign, the others are the magnitude.
    SignAndMagnitude,
}
