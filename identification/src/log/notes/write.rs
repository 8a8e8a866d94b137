//! Writes notes.

use super::{FaultNote, RateSource, VoltageSource};

/// Date and time with the time zone: `2026-11-22T22:05:57+01:00`.
pub fn timestamp() -> String {
    jiff::Zoned::now().strftime("%Y-%m-%dT%H:%M:%S%:z").to_string()
}

/// A time rounded to microseconds, which removes the rounding errors of sums: `2.003`, not `2.0029999999999997`.
pub fn microseconds(t_s: f64) -> f64 {
    (t_s * 1e6).round() / 1e6
}

/// A note that the program writes and reads again.
#[derive(Debug, Clone, PartialEq)]
pub enum Note {
    /// The stand: its name, or its answer to `*IDN?`.
    Stand(String),
    /// Date and time of the recording, with its time zone.
    Date,
    /// Name of the profile.
    Profile(String),
    /// A parameter of the profile, in its unit.
    ProfileParameter {
        /// Name with its unit, e.g. `frequency_Hz`.
        name: &'static str,
        /// Value.
        value: f64,
    },
    /// Mode of the drive: `rate`, `voltage`, ….
    Mode(String),
    /// What `u_V` is.
    Voltage(VoltageSource),
    /// `i_A` is a mean over the row.
    MeanCurrent,
    /// How `omega_rad_s` was made: source, and cutoff of a first-order low-pass, Hz, if any.
    Rate(RateSource, Option<f64>),
    /// Resolution of the encoder, counts per turn.
    Encoder(f64),
    /// Quantization step of a column: name without its unit, unit, step in that unit.
    QuantizationStep(&'static str, &'static str, f64),
    /// The zero of `theta_rad` is the index of the encoder.
    ThetaZeroIsIndex,
    /// Nominal supply voltage, V.
    SupplyNominal(f64),
    /// A limit was in force: its name, and the number of rows.
    Limited(&'static str, usize),
    /// Number of rows left out because a value was missing.
    RowsLeftOut(u64),
    /// Number of rows lost on the serial line.
    LostRows(u64),
    /// Number of frames of the serial line with errors.
    DamagedFrames(u64),
    /// A fault ended the recording.
    Fault(FaultNote),
    /// Why the recording ended early, and its last time, s.
    Ended(String, f64),
    /// A number: key with its unit, value in that unit.
    Number(&'static str, f64),
    /// A text.
    Text(&'static str, String),
}

impl Note {
    /// Key and value as in the file.
    pub(super) fn entry(self) -> (String, String) {
        let entry = |key: &str, value: String| (key.to_owned(), value);
        match self {
            Note::Stand(name) => entry("stand", name),
            Note::Date => entry("date", timestamp()),
            Note::Profile(name) => entry("profile", name),
            Note::ProfileParameter { name, value } => entry(&format!("profile_{name}"), value.to_string()),
            Note::Mode(mode) => entry("mode", mode),
            Note::Voltage(VoltageSource::Command) => entry("u_V", "asked".to_owned()),
            Note::Voltage(VoltageSource::Terminals) => entry("u_V", "terminal".to_owned()),
            Note::MeanCurrent => entry("i_A", "mean over [t_k, t_k+1)".to_owned()),
            Note::Rate(source, cutoff_Hz) => {
                let filter = cutoff_Hz.map_or(String::new(), |cutoff_Hz| format!(", filter {cutoff_Hz} Hz"));
                let source = match source {
                    RateSource::Unknown => "at t",
                    RateSource::Encoder => "encoder",
                    RateSource::RateSensor => "gyro",
                };
                entry("omega_rad_s", format!("{source}{filter}"))
            }
            Note::Encoder(counts_per_turn) => entry("encoder", format!("{counts_per_turn} counts per turn")),
            Note::QuantizationStep(name, unit, step) => entry(&format!("{name}_lsb_{unit}"), format!("{step:e}")),
            Note::ThetaZeroIsIndex => entry("theta_zero", "index".to_owned()),
            Note::SupplyNominal(supply_V) => entry("supply_nominal_V", supply_V.to_string()),
            Note::Limited(name, rows) => entry(&format!("limited_{name}"), format!("{rows} rows")),
            Note::RowsLeftOut(rows) => entry("rows_left_out", format!("{rows}, a value was missing")),
            Note::LostRows(rows) => entry("lost_rows", rows.to_string()),
            Note::DamagedFrames(frames) => entry("damaged_frames", frames.to_string()),
            Note::Fault(fault) => entry("fault", fault.value()),
            Note::Ended(reason, last_s) => entry("ended", format!("{reason}, at {} s", microseconds(last_s))),
            Note::Number(key, value) => entry(key, value.to_string()),
            Note::Text(key, text) => entry(key, text),
        }
    }
}
