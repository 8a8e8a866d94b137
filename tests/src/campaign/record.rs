//! The lines of the CSVs of a set.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// What the generator made: one log of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogRecord {
    /// Name of the log.
    pub id: String,
    /// Hash of log and model.
    pub sha256: String,
    /// Hidden effects of the catalogue; of an outsider its name.
    pub hidden: List,
    /// Expected 2 Δ ln L of each hidden effect ([`super::visible`]).
    pub expected_gain: List,
}

/// The answer of `explain` to one log.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct AnswerRecord {
    /// Name of the log.
    pub id: String,
    /// Hash of log and model.
    pub sha256: String,
    /// Verdict, or `bad-log`, or `error`.
    pub verdict: String,
    /// Names of the added effects, in the order of addition.
    pub missing: List,
    /// Effects not distinguishable from the first one.
    pub alike: List,
    /// χ²/n of each channel of the given model, and of the last one on held-out rows.
    pub chi2_per_n: List,
    /// `name=value±sigma` of all free parameters of the last model.
    pub parameters: List,
    /// Where the truth is known and the added effects are the hidden ones: deviation of each parameter, σ.
    pub deviations: List,
    /// Rows simulated × lanes, over the rows of the log.
    pub effort: u64,
    /// Message, if any.
    pub error: String,
}

/// A list in one field, separated by blanks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct List(pub Vec<String>);

impl List {
    /// `name=value` entries as numbers; entries without a number are left out.
    pub fn numbers(&self) -> impl Iterator<Item = (&str, f64)> {
        self.0.iter().filter_map(|entry| entry.split_once('=')).filter_map(|(name, value)| Some((name, value.parse().ok()?)))
    }
}

impl Serialize for List {
    fn serialize<S: serde::Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        to.serialize_str(&self.0.join(" "))
    }
}

impl<'de> Deserialize<'de> for List {
    fn deserialize<D: serde::Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Ok(List(String::deserialize(from)?.split_whitespace().map(str::to_owned).collect()))
    }
}

/// File of the coverage campaign, in the folder of the committed CSVs and in that of unaccepted runs.
pub const COVERAGE: &str = "coverage.csv";
/// File of the planted effects, likewise.
pub const PLANTED: &str = "planted.csv";

/// The folder of the committed CSVs.
pub fn baselines() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("baselines")
}

/// The records of a CSV; none where the file does not exist.
///
/// # Errors
/// The file, with row and field, that is not one of such records.
pub fn read<R: DeserializeOwned>(path: &Path) -> Result<Vec<R>, String> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let mut file = csv::Reader::from_path(path).map_err(|e| format!("{}: {e}", path.display()))?;
    file.deserialize().map(|record| record.map_err(|e| format!("{}: {e}", path.display()))).collect()
}

/// Writes records as a whole.
///
/// # Errors
/// The file cannot be written.
pub fn write<R: Serialize>(path: &Path, records: &[R]) -> Result<(), String> {
    let mut text = csv::Writer::from_writer(Vec::new());
    records.iter().try_for_each(|record| text.serialize(record)).map_err(|e| e.to_string())?;
    let bytes = text.into_inner().map_err(|e| e.to_string())?;
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)
        .and_then(|()| identification::files::replace(path, |file| file.write_all(&bytes)))
        .map_err(|e| format!("{}: {e}", path.display()))
}
