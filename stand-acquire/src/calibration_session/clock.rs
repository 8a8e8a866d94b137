//! The clock reference of a session: what the session states about it, and the stand's comparison of its crystal with it during a step.

use crate::connection::{ConnectionError, StandConnection};
use crate::link::reply_number;
use crate::preparation::query_number;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A second clock at the stand's input for one pulse per second, `[clock_reference]` in a session.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockReference {
    /// What it is, for record and certificate: type, serial number, certificate.
    pub name: String,
    /// Half-width of its relative frequency error, ppm. Without a default: a wrong one would be a small uncertainty of all rates.
    pub error_ppm: f64,
}

/// The crystal of the stand compared with the reference during a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClockReading {
    /// Pulses of the comparison.
    pub pulses: f64,
    /// Other edges on the input.
    pub rejected: f64,
    /// Time between the first and the last pulse by the reference, s.
    pub seconds: f64,
    /// The same time in steps of the crystal's timer.
    pub steps: f64,
    /// Standard deviation of the steps per second; `None` for fewer than three pulses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub deviation_Hz: Option<f64>,
    /// Nominal steps per second.
    pub timer_Hz: f64,
}

/// Begins the comparison anew.
pub(super) async fn restart(stand: &mut impl StandConnection) -> Result<(), ConnectionError> {
    stand.command("MEASure:CLOCk:RESet").await
}

/// The comparison since [`restart`].
pub(super) async fn read(stand: &mut impl StandConnection) -> Result<ClockReading, ConnectionError> {
    let query = "MEASure:CLOCk?";
    let reply = stand.query(query).await?;
    let numbers: Option<Vec<f64>> = reply.split(',').map(reply_number).collect();
    match numbers.as_deref() {
        Some([pulses, rejected, seconds, steps, deviation_Hz]) => Ok(ClockReading {
            pulses: *pulses,
            rejected: *rejected,
            seconds: *seconds,
            steps: *steps,
            deviation_Hz: Some(*deviation_Hz).filter(|deviation| deviation.is_finite()),
            timer_Hz: query_number(stand, "SETTings:edge_timer_Hz?").await?,
        }),
        _ => Err(ConnectionError::Reply { query: query.to_owned(), reply }),
    }
}
