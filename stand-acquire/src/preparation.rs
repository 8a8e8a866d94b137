//! The stand before a recording: faults, rest, index, settings that a log's notes state.

use stand_firmware::telemetry::RowFrame;

use super::connection::{ConnectionError, StandConnection};
use super::link::{LinkError, reply_number};
use super::record::shows_index;
use identification::log::{Note, Notes, RateSource, VoltageSource};

/// Rate below which the platform counts as at rest, rad/s.
const REST_RATE_RAD_S: f64 = 0.01;
/// Interval between measurements of the angle, s.
const REST_INTERVAL_S: f64 = 0.2;
/// Longest wait for rest, s.
const REST_TIMEOUT_S: f64 = 30.0;
/// Rate of the search for the index, rad/s.
const INDEX_RATE_RAD_S: f64 = 3.0;
/// Longest search for the index, s.
const INDEX_TIMEOUT_S: f64 = 10.0;

/// The latched fault in the stand's words; `None`: no fault. A fault is also in the error queue, where it appears as the error of the next
/// command; the query is repeated past it.
///
/// # Errors
/// The connection fails.
pub async fn latched_fault(stand: &mut impl StandConnection) -> Result<Option<String>, ConnectionError> {
    let mut attempts = 0;
    loop {
        attempts += 1;
        match stand.query("FAULt?").await {
            Ok(reply) => return Ok((!reply.starts_with("0,")).then_some(reply)),
            Err(error) if attempts < 3 && is_rejected(&error) => {}
            Err(error) => return Err(error),
        }
    }
}

/// The stand answered and rejected the command.
pub fn is_rejected(error: &ConnectionError) -> bool {
    matches!(error, ConnectionError::Rejected { .. } | ConnectionError::Link(LinkError::Rejected { .. }))
}

/// The first number of the reply to `query`.
///
/// # Errors
/// The connection fails, or the reply does not begin with a number.
pub async fn query_number(stand: &mut impl StandConnection, query: &str) -> Result<f64, ConnectionError> {
    let reply = stand.query(query).await?;
    let number = reply.split(',').next().and_then(reply_number);
    number.ok_or_else(|| ConnectionError::Reply { query: query.to_owned(), reply })
}

/// Brings the platform to rest, then switches the drive off; `false`: still in motion after 30 s.
///
/// # Errors
/// The connection fails, or the stand rejects a command.
pub async fn bring_to_rest(stand: &mut impl StandConnection) -> Result<bool, ConnectionError> {
    let mut waited_s = 0.0;
    let mut still = 0;
    let mut before_rad = query_number(stand, "MEASure:ANGLe?").await?;
    let mut braking = false;
    while waited_s < REST_TIMEOUT_S {
        stand.wait_s(REST_INTERVAL_S).await?;
        waited_s += REST_INTERVAL_S;
        let now_rad = query_number(stand, "MEASure:ANGLe?").await?;
        still = if (now_rad - before_rad).abs() < REST_INTERVAL_S * REST_RATE_RAD_S { still + 1 } else { 0 };
        before_rad = now_rad;
        if still >= 2 {
            if braking {
                stand.command("OUTPut OFF").await?;
                stand.wait_s(0.5).await?;
            }
            return Ok(true);
        }
        if still == 0 && !braking {
            for command in ["SOURce:RATE 0 RAD/S", "SOURce:MODE RATE", "OUTPut ON"] {
                stand.command(command).await?;
            }
            braking = true;
        }
    }
    Ok(false)
}

/// Whether the index has been seen, so that the angles of the next stream count from it. With `may_turn`, the platform turns for up to
/// 10 s to find it.
///
/// # Errors
/// The connection fails, or the stand rejects a command.
pub async fn find_index(stand: &mut impl StandConnection, may_turn: bool) -> Result<bool, ConnectionError> {
    for command in ["STReam:CHANnels from_index_rad", "STReam:DECimation 1", "STReam ON"] {
        stand.command(command).await?;
    }
    let shown = |rows: &[RowFrame]| rows.iter().any(shows_index);
    let mut seen = shown(&stand.wait_s(0.1).await?);
    if !seen && may_turn {
        let rate = format!("SOURce:RATE {INDEX_RATE_RAD_S} RAD/S");
        for command in [rate.as_str(), "SOURce:MODE RATE", "OUTPut ON"] {
            stand.command(command).await?;
        }
        let mut waited_s = 0.0;
        while !seen && waited_s < INDEX_TIMEOUT_S {
            seen = shown(&stand.wait_s(0.5).await?);
            waited_s += 0.5;
        }
    }
    stand.command("STReam OFF").await?;
    Ok(seen)
}

/// Settings of the stand that describe the columns of a log. `None`: the firmware does not have the setting.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnSettings {
    /// Encoder counts per turn.
    pub counts_per_turn: Option<f64>,
    /// Rate of one code of the rate sensor, rad/s.
    pub rate_rad_s_per_code: Option<f64>,
    /// Nominal supply, V.
    pub supply_nominal_V: Option<f64>,
    /// Cutoff of the rate sensor's filter, Hz; 0: no filter.
    pub rate_cutoff_Hz: Option<f64>,
}

impl ColumnSettings {
    /// Reads the settings.
    ///
    /// # Errors
    /// The connection fails, or a reply is not a number.
    pub async fn query(stand: &mut impl StandConnection) -> Result<Self, ConnectionError> {
        let mut values = [None; 4];
        for (value, name) in values.iter_mut().zip(["counts_per_turn", "rate_rad_s_per_code", "supply_nominal_V", "rate_cutoff_Hz"]) {
            *value = match query_number(stand, &format!("SETTings:{name}?")).await {
                Ok(number) => Some(number),
                // An older firmware.
                Err(error) if is_rejected(&error) => None,
                Err(error) => return Err(error),
            };
        }
        let [counts_per_turn, rate_rad_s_per_code, supply_nominal_V, rate_cutoff_Hz] = values;
        Ok(Self { counts_per_turn, rate_rad_s_per_code, supply_nominal_V, rate_cutoff_Hz })
    }

    /// Notes of a log on how its columns were made; `has_index`: angles count from the index.
    pub fn notes(&self, has_index: bool) -> Notes {
        let cutoff_Hz = self.rate_cutoff_Hz.filter(|cutoff_Hz| *cutoff_Hz > 0.0);
        let rate = Note::Rate(RateSource::RateSensor, cutoff_Hz);
        let mut notes = Notes::from_iter([Note::Voltage(VoltageSource::Command), Note::MeanCurrent, rate]);
        if let Some(counts) = self.counts_per_turn {
            notes.extend([Note::Encoder(counts), Note::QuantizationStep("theta", "rad", std::f64::consts::TAU / counts)]);
        }
        notes.extend(self.rate_rad_s_per_code.map(|step| Note::QuantizationStep("omega", "rad_s", step)));
        notes.extend(self.supply_nominal_V.map(Note::SupplyNominal));
        notes.extend(has_index.then_some(Note::ThetaZeroIsIndex));
        notes
    }
}
