//! Preparation of a step: platform at rest, index found, notes of the log.

use super::run::RunError;
use super::{Session, StepPlan};
use crate::acquire::connection::{ConnectionError, StandConnection};
use crate::acquire::link::LinkError;
use crate::acquire::record::shows_index;
use crate::calibrate::{DutKind, Mounting};
use crate::log::{Note, Notes, RateSource, VoltageSource};
use stand_firmware::profile::Parameter;
use stand_firmware::telemetry::RowFrame;

/// Host watchdog: the stand switches its drive off after this time without a command.
pub(super) const HOST_WATCHDOG: &str = "HOST:ARM 5 S";
/// Rate below which the platform counts as at rest, rad/s.
const REST_RAD_S: f64 = 0.01;
/// Time limit for coming to rest, s.
const REST_TIMEOUT_S: f64 = 30.0;
/// Rate of the search for the index, rad/s, and its time limit, s.
const INDEX_SEARCH_RAD_S: f64 = 3.0;
const INDEX_TIMEOUT_S: f64 = 10.0;

/// The latched fault. A fault is also in the error queue, where it makes the next command fail: the query is repeated past it.
pub(super) async fn fault(stand: &mut impl StandConnection) -> Result<Option<String>, ConnectionError> {
    let mut attempts = 0;
    loop {
        attempts += 1;
        match stand.query("FAULt?").await {
            Ok(reply) => return Ok((!reply.starts_with("0,")).then_some(reply)),
            Err(error) if attempts < 3 && is_refused(&error) => {}
            Err(error) => return Err(error),
        }
    }
}

/// The stand has answered with an error.
pub(super) fn is_refused(error: &ConnectionError) -> bool {
    matches!(error, ConnectionError::Refused { .. } | ConnectionError::Link(LinkError::Refused { .. }))
}

async fn number(stand: &mut impl StandConnection, query: &str) -> Result<f64, ConnectionError> {
    let reply = stand.query(query).await?;
    let word = reply.split([' ', ',']).next().unwrap_or_default().parse();
    word.map_err(|_| ConnectionError::Reply { query: query.to_owned(), says: reply })
}

/// Brings the platform to rest and switches the drive off.
pub(super) async fn at_rest(stand: &mut impl StandConnection, step: &str) -> Result<(), RunError> {
    let mut waited_s = 0.0;
    let mut still = 0;
    let mut before = number(stand, "MEASure:ANGLe?").await?;
    let mut braked = false;
    while waited_s < REST_TIMEOUT_S {
        stand.wait_s(0.2).await?;
        waited_s += 0.2;
        let now = number(stand, "MEASure:ANGLe?").await?;
        still = if (now - before).abs() < 0.2 * REST_RAD_S { still + 1 } else { 0 };
        before = now;
        if still >= 2 {
            if braked {
                stand.command("OUTPut OFF").await?;
                stand.wait_s(0.5).await?;
            }
            return Ok(());
        }
        if still == 0 && !braked {
            for command in ["SOURce:RATE 0 RAD/S", "SOURce:MODE RATE", "OUTPut ON"] {
                stand.command(command).await?;
            }
            braked = true;
        }
    }
    Err(RunError::Turning { step: step.to_owned() })
}

/// Searches for the index, from which the angles of the next stream are counted; turns the platform where `may_turn`. Returns whether it was seen.
pub(super) async fn index(stand: &mut impl StandConnection, may_turn: bool) -> Result<bool, RunError> {
    for command in ["STReam:DECimation 1", "STReam:CHANnels from_index_rad", "STReam ON"] {
        stand.command(command).await?;
    }
    let shows = |rows: &[RowFrame]| rows.iter().any(shows_index);
    let mut seen = shows(&stand.wait_s(0.1).await?);
    if !seen && may_turn {
        for command in
            [HOST_WATCHDOG.to_owned(), format!("SOURce:RATE {INDEX_SEARCH_RAD_S} RAD/S"), "SOURce:MODE RATE".into(), "OUTPut ON".into()]
        {
            stand.command(&command).await?;
        }
        let mut waited_s = 0.0;
        while !seen && waited_s < INDEX_TIMEOUT_S {
            seen = shows(&stand.wait_s(0.5).await?);
            waited_s += 0.5;
            stand.command(HOST_WATCHDOG).await?;
        }
        stand.command("HOST:ARM 0 S").await?;
    }
    stand.command("STReam OFF").await?;
    Ok(seen)
}

/// Notes of the log (docs/logs-and-models.md).
pub(super) async fn notes(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    mounting: &Mounting,
    has_index: bool,
) -> Result<Notes, RunError> {
    let mut notes = Notes::from_iter([Note::Stand(stand.query("*IDN?").await?), Note::Date, Note::Text("step", plan.name.clone())]);
    let texts = [("sensor", &session.sensor), ("serial", &session.serial), ("operator", &session.operator)];
    notes.extend(texts.into_iter().filter(|(_, text)| !text.is_empty()).map(|(key, text)| Note::Text(key, text.clone())));
    notes.extend([
        Note::Mode(format!("{:?}", plan.mode).to_lowercase()),
        Note::Voltage(VoltageSource::Command),
        Note::MeanCurrent,
        Note::Number("radius_m", mounting.radius_m),
        Note::Number("tilt_deg", mounting.tilt_deg),
    ]);
    if let Some(config) = plan.config().ok().flatten() {
        notes.push(Note::Profile(config.kind.name().to_owned()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        notes.extend(parameters.map(|p| Note::ProfileParameter { name: p.name, value: (p.read)(&config) }));
    }
    let counts = number(stand, "SETTings:counts_per_turn?").await?;
    notes.extend([
        Note::Encoder(counts),
        Note::QuantizationStep("theta", "rad", std::f64::consts::TAU / counts),
        Note::QuantizationStep("omega", "rad_s", number(stand, "SETTings:rate_rad_s_per_code?").await?),
        Note::SupplyNominal(number(stand, "SETTings:supply_nominal_V?").await?),
    ]);
    let cutoff_Hz = number(stand, "SETTings:rate_cutoff_Hz?").await?;
    notes.push(Note::Rate(RateSource::RateSensor, (cutoff_Hz > 0.0).then_some(cutoff_Hz)));
    // Low-pass of the chip, whose gain and phase are known.
    let column = match session.dut_kind {
        DutKind::Gyro if session.column.as_deref() != Some("omega_rad_s") => Some(0),
        DutKind::Accel => Some(1),
        _ => None,
    };
    if let Some(column) = column {
        let query = "IMU:FILTer?";
        let says = stand.query(query).await?;
        let number = says.split(',').nth(column).and_then(|word| word.split_whitespace().next()?.parse::<f64>().ok());
        let cutoff_Hz = number.ok_or_else(|| ConnectionError::Reply { query: query.to_owned(), says })?;
        notes.push(Note::Number("sensor_filter_Hz", cutoff_Hz));
    }
    notes.extend(plan.drive_s.map(|drive_s| Note::Number("drive_s", drive_s)));
    notes.extend(has_index.then_some(Note::ThetaZeroIsIndex));
    Ok(notes)
}
