//! One row of the table: the answer about one log.

use serde::{Deserialize, Serialize};

/// Verdict of a log that cannot be read or computed.
pub const ERROR: &str = "error";
/// Verdict of a search that the limit of effort or time ended.
pub const NOT_FINISHED: &str = "not-finished";

/// The answer about one log. Field by field the columns of the table (`docs/fleets.md`).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Row {
    /// Path of the log.
    pub path: String,
    /// SHA-256 of its contents and of its import file, hexadecimal; `None`: the file could not be read.
    pub sha256: Option<String>,
    /// Size of the file, bytes.
    pub bytes: Option<i64>,
    /// Number of samples.
    pub samples: Option<i64>,
    /// Duration, s.
    pub duration_s: Option<f64>,
    /// Start of the recording, µs since 1970-01-01 UTC.
    pub began_us: Option<i64>,
    /// The stand.
    pub stand: Option<String>,
    /// The device under test.
    pub device: Option<String>,
    /// Batch of the stand.
    pub batch: Option<String>,
    /// Name of the model.
    pub model: String,
    /// Hash of the model and the build.
    pub settings: String,
    /// Version and commit of the program.
    pub build: String,
    /// Verdict of the explanation, `bad-log` or [`ERROR`].
    pub verdict: String,
    /// The missing effects, in the order in which they were added.
    pub effects: Vec<String>,
    /// Effects that the log does not distinguish from a missing one.
    pub not_distinguishable: Vec<Alternative>,
    /// Parameters of the final model.
    pub parameters: Vec<ParameterValue>,
    /// The standard uncertainties may be too small: the model leaves more than noise.
    pub uncertainty_is_lower_bound: Option<bool>,
    /// Errors of the compared outputs.
    pub outputs: Vec<OutputError>,
    /// Why there is no explanation.
    pub error: Option<String>,
    /// Limit of effort of the search, passes; `None`: none.
    #[serde(default)]
    pub effort_limit_passes: Option<i64>,
    /// Effort of the search, passes.
    #[serde(default)]
    pub effort_passes: Option<f64>,
    /// Time limit of the search, s; `None`: none.
    pub time_limit_s: Option<f64>,
    /// Computing time, s.
    pub seconds: f64,
}

/// An effect that the log does not distinguish from a missing one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Alternative {
    /// The missing effect.
    pub effect: String,
    /// The other.
    pub alternative: String,
}

/// A parameter of the final model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct ParameterValue {
    /// Name in the model file.
    pub name: String,
    /// Value, in `unit`.
    pub value: f64,
    /// Standard uncertainty; `None`: fixed, scanned or not determined.
    pub standard_uncertainty: Option<f64>,
    /// Unit.
    pub unit: String,
}

/// Error of an output.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct OutputError {
    /// Column of the output.
    pub output: String,
    /// Unit.
    pub unit: String,
    /// Standard deviation of its noise.
    pub noise: f64,
    /// rms of the residual over the noise, the given model fitted.
    pub ratio_given: f64,
    /// The same with the missing effects.
    pub ratio: f64,
}

impl Row {
    /// There is an explanation, finished or not.
    pub fn is_explained(&self) -> bool {
        self.error.is_none()
    }

    /// The row of a log without an explanation.
    pub fn failed(path: &str, hash: Option<(String, i64)>, error: String) -> Row {
        let (sha256, bytes) = hash.unzip();
        Row { path: path.to_owned(), sha256, bytes, verdict: ERROR.to_owned(), error: Some(error), ..Row::default() }
    }
}

/// Microseconds since 1970 of a date in a note or a table: with its time zone, or else in UTC.
pub fn microseconds_of(date: &str) -> Option<i64> {
    let date = date.trim();
    let utc = |time: jiff::civil::DateTime| Some(time.to_zoned(jiff::tz::TimeZone::UTC).ok()?.timestamp());
    let instant = date.parse::<jiff::Timestamp>().ok();
    let instant = instant.or_else(|| date.parse::<jiff::civil::DateTime>().ok().and_then(utc));
    instant.or_else(|| date.parse::<jiff::civil::Date>().ok().and_then(|day| utc(day.at(0, 0, 0, 0)))).map(|t| t.as_microsecond())
}

/// The day of a time in UTC: `2026-11-26`.
pub fn day_of(began_us: i64) -> String {
    jiff::Timestamp::from_microsecond(began_us).map_or(String::new(), |time| time.strftime("%Y-%m-%d").to_string())
}

/// A stand by its note: manufacturer, type and number, as `stand record` notes them; of an answer to `*IDN?` without the version, which an
/// update changes.
pub fn stand_of(note: &str) -> String {
    let fields: Vec<&str> = note.split(',').map(str::trim).collect();
    match fields[..] {
        [maker, model, serial, _] => format!("{maker} {model} {serial}"),
        _ => note.trim().to_owned(),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn dates_have_a_time_zone_or_are_utc() {
        let noon = microseconds_of("2026-11-22T12:00:00Z").unwrap();
        assert_eq!(microseconds_of("2026-11-22T13:00:00+01:00"), Some(noon));
        assert_eq!(microseconds_of("2026-11-22T12:00:00"), Some(noon));
        assert_eq!(microseconds_of("2026-11-22"), Some(noon - 12 * 3_600_000_000));
        assert_eq!((microseconds_of("last week"), day_of(noon).as_str()), (None, "2026-11-22"));
    }

    #[test]
    fn version_is_no_part_of_a_stand() {
        assert_eq!(stand_of("Rotary Stand,RS-1,17,0.1.0+1234abc"), "Rotary Stand RS-1 17");
        assert_eq!(stand_of("heavy"), "heavy");
    }
}
