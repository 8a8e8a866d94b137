//! Reads notes.
//!
//! A note about a column has the name of the column as key, with or without the unit (`omega`); commas separate its clauses. Understood are
//! `encoder`, `gyro`; `magnitude`; for an angle `compared absolutely`; `mean over 4 ms before t`, `counts per 20 ms`,
//! `newest sample of 1667 Hz before t`; `filter 100 Hz`; `at t`, `instant`; `mean over the row`; for `u_V` `asked`, `terminal`, `coasting`,
//! `held`; `over the row before t`; for a quantization step `theta_lsb_rad: 3e-4`, `encoder: 8192 counts per turn`, `0.1286 deg per count`.

use std::f64::consts::TAU;

use super::Notes;
use crate::log::axis::Axis;
use crate::log::columns::{KNOWN, known};
use crate::log::warning::LogWarning;

/// How a column was made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Provenance {
    /// Taken at the time t_k of the row; otherwise the mean over the row, from t_k to t_k+1. The default depends on the column.
    pub instant: bool,
    /// Mean over this interval before t_k, s.
    pub mean_before_s: Option<f64>,
    /// The newest sample of a sensor with a clock of its own, which samples at this interval, s. `mean_before_s` is then the same: the
    /// expectation over the unknown age of the sample.
    pub sample_interval_s: Option<f64>,
    /// Cutoff of a first-order low-pass, Hz.
    pub filter_hz: Option<f64>,
    /// The sensor of a rate.
    pub source: RateSource,
    /// The column is a magnitude, without its sign.
    pub magnitude: bool,
    /// An angle is to be compared itself, not by its increments.
    pub absolute: bool,
}

/// The sensor of a rate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RateSource {
    /// No note states it.
    Unknown,
    /// The encoder of the platform.
    Encoder,
    /// A rate sensor.
    RateSensor,
}

/// What `u_V` is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VoltageSource {
    /// The command, duty × supply (the default).
    Command,
    /// Measured at the terminals of the motor.
    Terminals,
}

/// A fault that ended a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FaultNote {
    /// Name of the fault, or the stand's own message: number, name, remedy.
    pub message: String,
    /// Last time before the fault, as text in s; empty where it is not known.
    pub at_s: String,
}

impl FaultNote {
    /// Value of the note.
    pub(super) fn value(&self) -> String {
        format!("{} at {} s; the rows end there", self.message, self.at_s)
    }

    /// Name of the fault.
    pub fn name(&self) -> &str {
        let mut parts = self.message.splitn(3, ',');
        match (parts.next(), parts.next()) {
            (Some(number), Some(name)) if number.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => &self.message,
        }
    }
}

impl Notes {
    /// How a column was made: the convention, and what the notes state otherwise.
    pub fn provenance(&self, column: &str) -> Provenance {
        provenance(self, column).0
    }

    /// A note states that the column holds values at t, not means over the row.
    pub fn is_at_t(&self, column: &str) -> bool {
        note_of(self, column).is_some() && self.provenance(column).instant
    }

    /// There is a note on how the column was made.
    pub fn has_provenance(&self, column: &str) -> bool {
        note_of(self, column).is_some()
    }

    /// A note states when the column had its values. That a voltage is held does not: it may have been held over the row before.
    pub fn states_timing(&self, column: &str) -> bool {
        note_of(self, column).into_iter().flat_map(clauses).any(|clause| !is_held(clause) || is_of_row_before(clause))
    }

    /// Each value is the mean over the row before its own.
    pub fn is_of_row_before(&self, column: &str) -> bool {
        note_of(self, column).into_iter().flat_map(clauses).any(is_of_row_before)
    }

    /// What `u_V` is.
    pub fn voltage(&self) -> VoltageSource {
        let stated = note_of(self, "u_V").into_iter().flat_map(clauses).find_map(voltage_of);
        stated.unwrap_or(VoltageSource::Command)
    }

    /// The bridge coasts in the off time of its PWM: the winding is then open, not short-circuited.
    pub fn bridge_coasts(&self) -> bool {
        note_of(self, "u_V").into_iter().flat_map(clauses).any(is_coasting)
    }

    /// The voltage is constant within each row: an output that is set once per row.
    pub fn voltage_is_held(&self) -> bool {
        note_of(self, "u_V").into_iter().flat_map(clauses).any(is_held)
    }

    /// The input was not made from a measured channel: a note states that the drive had no loop. Without a note it may have had one.
    pub fn is_open_loop(&self) -> bool {
        self.text("mode").is_some_and(|mode| ["voltage", "off"].iter().any(|open| mode.trim().eq_ignore_ascii_case(open)))
    }

    /// Quantization step of a column as a note states it, in the unit of the column.
    pub fn quantization_step(&self, column: &str) -> Option<f64> {
        if let Some((key, value)) = self.iter().find(|(k, _)| lsb_column(k) == Some(column)) {
            return lsb_value(key, value, column);
        }
        let count_rad = || self.text("encoder").and_then(|v| clauses(v).find_map(count_rad));
        match column {
            "theta_rad" => count_rad(),
            "omega_rad_s" => {
                let made = self.provenance(column);
                (made.source == RateSource::Encoder).then(|| Some(count_rad()? / made.mean_before_s?)).flatten()
            }
            _ => None,
        }
    }

    /// The zero of `theta_rad` is the index of the encoder; otherwise it is arbitrary.
    pub fn theta_zero_is_index(&self) -> bool {
        self.text("theta_zero").is_some_and(|v| v.trim().eq_ignore_ascii_case("index"))
    }

    /// The axis that the log is of; rotary, if no note states it.
    pub fn axis(&self) -> Axis {
        self.text("axis").and_then(Axis::named).unwrap_or_default()
    }

    /// The number that a note begins with; a unit may follow.
    pub fn number(&self, key: &str) -> Option<f64> {
        self.text(key).and_then(|text| text.split_whitespace().next()?.parse().ok())
    }

    /// The fault that ended the recording.
    pub fn fault(&self) -> Option<FaultNote> {
        let note = self.text("fault")?;
        let note = note.strip_suffix("; the rows end there").unwrap_or(note);
        let (message, at) = note.rsplit_once(" at ").unwrap_or((note, ""));
        let at_s = at.strip_suffix(" s").unwrap_or(at);
        Some(FaultNote { message: message.to_owned(), at_s: at_s.to_owned() })
    }

    /// Notes about limits that were in force: name and value, e.g. `current`, `12 rows`.
    pub fn limits(&self) -> impl Iterator<Item = (&str, &str)> {
        self.iter().filter_map(|(key, value)| Some((key.strip_prefix("limited_")?, value.as_str())))
    }
}

/// How a column was made, and the clauses of its note that were not understood.
fn provenance(notes: &[(String, String)], column: &str) -> (Provenance, Vec<String>) {
    let instant = known(column).is_none_or(|c| !c.mean_over_row);
    let mut made = Provenance {
        instant,
        mean_before_s: None,
        sample_interval_s: None,
        filter_hz: None,
        source: RateSource::Unknown,
        magnitude: false,
        absolute: false,
    };
    let mut unclear = Vec::new();
    let own = note_of(notes, column);
    // Some loggers state under `encoder` how the rate was made.
    let encoder = notes.iter().find(|(k, _)| k == "encoder").filter(|_| column == "omega_rad_s" && own.is_none());
    for clause in own.into_iter().flat_map(clauses) {
        let is_voltage = column == "u_V" && (voltage_of(clause).is_some() || is_coasting(clause) || is_held(clause));
        if !is_voltage && !is_of_row_before(clause) && !take_clause(&mut made, clause) {
            unclear.push(clause.to_owned());
        }
    }
    for clause in encoder.iter().flat_map(|(_, v)| clauses(v)).filter(|c| has_word(c, &["rate", "omega"])) {
        made.source = RateSource::Encoder;
        if !take_clause(&mut made, clause) {
            unclear.push(clause.to_owned());
        }
    }
    (made, unclear)
}

/// A warning for each note about a column of the drive that was not understood.
pub(in crate::log) fn warnings(notes: &[(String, String)]) -> Vec<LogWarning> {
    let mut warnings = Vec::new();
    let mut report = |key: &str, part: &str, example| {
        warnings.push(LogWarning::NoteNotUnderstood { key: key.to_owned(), part: part.to_owned(), example });
    };
    for (key, value) in notes {
        if let Some(column) = lsb_column(key) {
            if lsb_value(key, value, column).is_none() {
                report(key, value, "# theta_lsb_rad: 3.1e-4");
            }
        } else if let Some(column) = KNOWN.iter().find(|c| is_about(key, c.name)) {
            if !column.of_drive {
                continue;
            }
            let example = if column.mean_over_row { "# i_A: at t" } else { "# omega_rad_s: encoder, mean over 4 ms before t" };
            for clause in provenance(std::slice::from_ref(&(key.clone(), value.clone())), column.name).1 {
                report(key, &clause, if column.name == "u_V" { "# u_V: terminal" } else { example });
            }
        } else if key == "encoder" {
            for clause in clauses(value) {
                let understood = count_rad(clause).is_some() || take_clause(&mut provenance(&[], "omega_rad_s").0, clause);
                if !understood {
                    report(key, clause, "# encoder: 8192 counts per turn");
                }
            }
        } else if key == "axis" && Axis::named(value).is_none() {
            report(key, value, "# axis: linear");
        } else if key == "theta_zero" && !["index", "arbitrary"].contains(&value.trim().to_ascii_lowercase().as_str()) {
            report(key, value, "# theta_zero: index");
        }
    }
    warnings
}

/// Reads one clause into `made`; false if the clause is not understood.
fn take_clause(made: &mut Provenance, clause: &str) -> bool {
    let mut understood = false;
    if has_word(clause, &["magnitude", "unsigned"]) {
        made.magnitude = true;
        return true;
    }
    if has_word(clause, &["absolutely"]) {
        made.absolute = true;
        return true;
    }
    if has_word(clause, &["encoder"]) {
        made.source = RateSource::Encoder;
        understood = true;
    } else if has_word(clause, &["gyro", "gyroscope", "tachometer"]) {
        made.source = RateSource::RateSensor;
        understood = true;
    }
    // The age of such a sample is even over its interval, as that of a mean over the interval.
    if has_word(clause, &["newest"]) && has_word(clause, &["before"]) {
        made.mean_before_s = number_with(clause, &[("hz", 1.0), ("khz", 1e3)]).filter(|hz| *hz > 0.0).map(|hz| 1.0 / hz);
        made.sample_interval_s = made.mean_before_s;
        return made.mean_before_s.is_some();
    }
    let windowed = has_word(clause, &["mean", "average", "averaged", "per", "difference", "differences"]);
    let filtered = has_word(clause, &["filter", "filtered", "low-pass", "lowpass"]);
    // A window that does not end at t, or a filter of higher order, is not supported.
    if has_word(clause, &["after", "centred", "centered", "around", "second-order", "2nd-order", "order"]) {
        return false;
    }
    let over_row = has_word(clause, &["row", "interval", "period", "sample"]) || clause.contains("[t");
    match (windowed, filtered) {
        (true, false) => match number_with(clause, &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6)]) {
            Some(window_s) => {
                made.mean_before_s = Some(window_s);
                made.instant = false;
                true
            }
            None => over_row && !made.instant && !has_word(clause, &["before"]),
        },
        (false, true) => match number_with(clause, &[("hz", 1.0), ("khz", 1e3)]) {
            Some(hz) => {
                made.filter_hz = Some(hz);
                true
            }
            None => false,
        },
        (true, true) => false,
        (false, false) => {
            let words = words(clause).map(str::to_ascii_lowercase).collect::<Vec<_>>();
            let at_t = words.windows(2).any(|w| w[0] == "at" && (w[1] == "t" || w[1] == "t_k"));
            if at_t || has_word(clause, &["instant", "instantaneous"]) {
                made.instant = true;
                return true;
            }
            understood
        }
    }
}

fn voltage_of(clause: &str) -> Option<VoltageSource> {
    if has_word(clause, &["terminal", "terminals", "measured"]) {
        Some(VoltageSource::Terminals)
    } else if has_word(clause, &["asked", "duty", "commanded"]) {
        Some(VoltageSource::Command)
    } else {
        None
    }
}

fn is_coasting(clause: &str) -> bool {
    has_word(clause, &["coasts", "coasting"])
}

fn is_of_row_before(clause: &str) -> bool {
    has_word(clause, &["row"]) && has_word(clause, &["before"])
}

fn is_held(clause: &str) -> bool {
    has_word(clause, &["held", "constant"])
}

/// The column whose quantization step (LSB) a key names: `theta_lsb_rad`, `theta_rad_lsb`, `lsb_theta_rad`, `theta_lsb`, `theta_lsb_deg`.
fn lsb_column(key: &str) -> Option<&'static str> {
    let key = key.to_ascii_lowercase().replace([' ', '-'], "_");
    let rest = key.strip_prefix("lsb_").map(str::to_owned).or_else(|| {
        let (stem, unit) = key.split_once("_lsb")?;
        (unit.is_empty() || unit.starts_with('_')).then(|| stem.to_owned())
    })?;
    KNOWN.iter().find(|c| is_about(&rest, c.name)).map(|c| c.name)
}

fn lsb_value(key: &str, value: &str, column: &str) -> Option<f64> {
    let degrees = key.to_ascii_lowercase().contains("_deg");
    let unit = words(value).nth(1).unwrap_or("");
    let (scale, fits) = match unit {
        "" if degrees => (TAU / 360.0, true),
        "" => (1.0, true),
        "deg" | "deg/s" | "°" | "°/s" => (TAU / 360.0, column.contains("_rad")),
        "mrad" | "mV" | "mA" => (1e-3, true),
        "rad" | "rad/s" | "V" | "A" | "N" => (1.0, true),
        _ => (0.0, false),
    };
    let number: f64 = words(value).next()?.parse().ok()?;
    let lsb = number * scale;
    (fits && lsb.is_finite() && lsb > 0.0).then_some(lsb)
}

/// Angle of one count, rad: `8192 counts per turn`, `0.1286 deg per count`, `1e-4 rad per count`.
fn count_rad(clause: &str) -> Option<f64> {
    let words: Vec<String> = words(clause).map(str::to_ascii_lowercase).collect();
    let number: f64 = words.first()?.parse().ok()?;
    let unit = words.get(1)?.trim_end_matches('s');
    let per = words.last()?.as_str();
    let rad = match (unit, per) {
        ("count", "turn" | "rev" | "revolution") => TAU / number,
        ("deg" | "degree" | "°", "count") => number * TAU / 360.0,
        ("rad", "count") => number,
        _ => return None,
    };
    (rad.is_finite() && rad > 0.0 && words.len() <= 4).then_some(rad)
}

/// The number before one of the units, separated or not, times the scale of the unit; positive and finite.
fn number_with(clause: &str, units: &[(&str, f64)]) -> Option<f64> {
    let lower = clause.to_lowercase();
    let words: Vec<&str> = words(&lower).collect();
    let positive = |text: &str, scale: f64| text.parse::<f64>().ok().map(|v| v * scale).filter(|v| v.is_finite() && *v > 0.0);
    (0..words.len()).find_map(|k| {
        units.iter().find_map(|&(unit, scale)| {
            let before = (k > 0 && words[k] == unit).then(|| positive(words[k - 1], scale)).flatten();
            before.or_else(|| positive(words[k].strip_suffix(unit)?, scale))
        })
    })
}

fn note_of<'a>(notes: &'a [(String, String)], column: &str) -> Option<&'a str> {
    let exact = notes.iter().find(|(k, _)| k == column);
    exact.or_else(|| notes.iter().find(|(k, _)| is_about(k, column))).map(|(_, v)| v.as_str())
}

/// The key is the name of the column, with or without its unit.
fn is_about(key: &str, column: &str) -> bool {
    const UNITS: [&str; 7] = ["_rad_s", "_m_s2", "_N_m", "_rad", "_V", "_A", "_C"];
    let stem = UNITS.iter().find_map(|u| column.strip_suffix(u)).unwrap_or(column);
    key.eq_ignore_ascii_case(column) || key.eq_ignore_ascii_case(stem)
}

/// The key is the column's name, or names its quantization step.
pub(super) fn is_about_column(key: &str, column: &str) -> bool {
    is_about(key, column) || lsb_column(key) == Some(column)
}

/// The parts between commas and semicolons that are not inside brackets, as in `[t_k, t_k+1)`.
fn clauses(text: &str) -> impl Iterator<Item = &str> {
    let mut depth = 0i32;
    text.split(move |c| {
        match c {
            '[' | '(' => depth += 1,
            ']' | ')' => depth -= 1,
            _ => {}
        }
        depth <= 0 && (c == ',' || c == ';')
    })
    .map(str::trim)
    .filter(|c| !c.is_empty())
}

fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split_whitespace()
}

fn has_word(text: &str, any: &[&str]) -> bool {
    words(text).any(|w| any.iter().any(|a| w.trim_matches(|c: char| !c.is_alphanumeric()).eq_ignore_ascii_case(a)))
}
