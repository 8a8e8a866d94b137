//! Logs as other programs write them: oscilloscopes, motor controllers, spreadsheets, scientific software.
//!
//! In: a log of the simulated stand. Out: the bytes of files in the formats of these programs, with what the owner of such a file has to
//! state and the columns that must arrive. The formats are written from the programs' own exports; nothing is recorded.

mod controllers;
mod instruments;
mod scientific;
mod spreadsheets;
mod times;

use std::f64::consts::TAU;

use identification::log::Log;

/// A file of another program.
pub struct ForeignFile {
    /// Name, whose ending selects the format.
    pub name: &'static str,
    /// The file.
    pub bytes: Vec<u8>,
    /// What its owner has to state beyond accepting what is shown; each missing part is asked for.
    pub stated: &'static [&'static str],
    /// Columns of the project that arrive, with the largest error, a part of the largest value.
    pub columns: &'static [(&'static str, f64)],
    /// Where the rows of the file begin in the log, and their number.
    pub rows: (usize, usize),
    /// A part of what `stand log inspect` or the reader says about the file; empty where nothing special is to be said.
    pub said: &'static str,
}

/// All files of the corpus, from a log of at least 3000 rows with voltage, current, angle, rate and temperature.
pub fn corpus(log: &Log) -> Vec<ForeignFile> {
    let rows = Rows { log };
    [instruments::files(&rows), controllers::files(&rows), spreadsheets::files(&rows), scientific::files(&rows), times::files(&rows)]
        .into_iter()
        .flatten()
        .collect()
}

/// Rows of a log in the units of other programs.
pub(crate) struct Rows<'a> {
    log: &'a Log,
}

/// Rows of each file.
pub(crate) const ROWS: usize = 3000;

impl Rows<'_> {
    fn at(&self, column: &str, k: usize) -> f64 {
        self.log.column(column).and_then(|c| c.get(k)).copied().unwrap_or(f64::NAN)
    }
    pub(crate) fn t(&self, k: usize) -> f64 {
        self.at("t_s", k)
    }
    pub(crate) fn u(&self, k: usize) -> f64 {
        self.at("u_V", k)
    }
    pub(crate) fn i(&self, k: usize) -> f64 {
        self.at("i_A", k)
    }
    pub(crate) fn omega(&self, k: usize) -> f64 {
        self.at("omega_rad_s", k)
    }
    pub(crate) fn theta(&self, k: usize) -> f64 {
        self.at("theta_rad", k)
    }
    pub(crate) fn rpm(&self, k: usize) -> f64 {
        self.omega(k) * 60.0 / TAU
    }
    pub(crate) fn rev(&self, k: usize) -> f64 {
        self.theta(k) / TAU
    }
    pub(crate) fn deg(&self, k: usize) -> f64 {
        self.theta(k).to_degrees()
    }
    pub(crate) fn temp(&self, k: usize) -> f64 {
        self.at("temp_C", k)
    }
    /// Lines of [`ROWS`] rows from the first, each with a line break, below a header.
    pub(crate) fn text(&self, header: &str, line: impl Fn(usize) -> String) -> String {
        (0..ROWS).fold(header.to_owned(), |text, k| text + &line(k) + "\n")
    }
}

/// A text file of all rows from the first, on which nothing special is said.
pub(crate) fn file(
    name: &'static str,
    text: impl Into<Vec<u8>>,
    stated: &'static [&'static str],
    columns: &'static [(&'static str, f64)],
) -> ForeignFile {
    ForeignFile { name, bytes: text.into(), stated, columns, rows: (0, ROWS), said: "" }
}

/// A number with a decimal comma.
pub(crate) fn comma(text: String) -> String {
    text.replace('.', ",")
}
