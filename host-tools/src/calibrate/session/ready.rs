//! Before a step: the platform at rest, its index seen, and what the log will say of itself.

use super::run::RunError;
use super::{Session, StepPlan, What};
use crate::acquire::connection::{ConnectionError, StandConnection};
use crate::acquire::link::LinkError;
use crate::acquire::record::shows_index;
use crate::calibrate::Mounted;
use crate::calibrate::session::journal::now;
use stand_firmware::profile::Parameter;
use stand_firmware::telemetry::RowFrame;

/// The stand switches its drive off when its host is silent for so long.
pub(super) const WATCH: &str = "HOST:ARM 5 S";
/// Slower than this it is at rest, rad/s; and how long is waited for that, s.
const REST_RAD_S: f64 = 0.01;
const REST_S: f64 = 30.0;
/// The rate at which the index is looked for, rad/s, and how long, s.
const LOOK_RAD_S: f64 = 3.0;
const INDEX_S: f64 = 10.0;

/// The fault that has latched. A fault also stands in the queue of errors, where the next order finds it: it is asked past that.
pub(super) async fn fault(stand: &mut impl StandConnection) -> Result<Option<String>, ConnectionError> {
    let mut asked = 0;
    loop {
        asked += 1;
        match stand.query("FAULt?").await {
            Ok(says) => return Ok((!says.starts_with("0,")).then_some(says)),
            Err(error) if asked < 3 && is_refused(&error) => {}
            Err(error) => return Err(error),
        }
    }
}

/// The stand has spoken, and says no.
pub(super) fn is_refused(error: &ConnectionError) -> bool {
    matches!(error, ConnectionError::Refused { .. } | ConnectionError::Link(LinkError::Refused { .. }))
}

async fn number(stand: &mut impl StandConnection, query: &str) -> Result<f64, ConnectionError> {
    let says = stand.query(query).await?;
    let word = says.split([' ', ',']).next().unwrap_or_default().parse();
    word.map_err(|_| ConnectionError::Reply { query: query.to_owned(), says })
}

/// Brings the platform to rest, then takes the drive off.
pub(super) async fn at_rest(stand: &mut impl StandConnection, step: &str) -> Result<(), RunError> {
    let mut waited_s = 0.0;
    let mut still = 0;
    let mut before = number(stand, "MEASure:ANGLe?").await?;
    let mut braked = false;
    while waited_s < REST_S {
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
            for order in ["SOURce:RATE 0 RAD/S", "SOURce:MODE RATE", "OUTPut ON"] {
                stand.command(order).await?;
            }
            braked = true;
        }
    }
    Err(RunError::Turning { step: step.to_owned() })
}

/// Whether the index was seen, so that angles of the next stream are from there; it is looked for once, where the platform may turn.
pub(super) async fn index(stand: &mut impl StandConnection, may_turn: bool) -> Result<bool, RunError> {
    for order in ["STReam:DECimation 1", "STReam:CHANnels from_index_rad", "STReam ON"] {
        stand.command(order).await?;
    }
    let shows = |rows: &[RowFrame]| rows.iter().any(shows_index);
    let mut seen = shows(&stand.wait_s(0.1).await?);
    if !seen && may_turn {
        for order in [WATCH.to_owned(), format!("SOURce:RATE {LOOK_RAD_S} RAD/S"), "SOURce:MODE RATE".into(), "OUTPut ON".into()] {
            stand.command(&order).await?;
        }
        let mut waited_s = 0.0;
        while !seen && waited_s < INDEX_S {
            seen = shows(&stand.wait_s(0.5).await?);
            waited_s += 0.5;
            stand.command(WATCH).await?;
        }
        stand.command("HOST:ARM 0 S").await?;
    }
    stand.command("STReam OFF").await?;
    Ok(seen)
}

/// What the log says of itself: interfaces.md, "Logs".
pub(super) async fn notes(
    stand: &mut impl StandConnection,
    session: &Session,
    plan: &StepPlan,
    mounted: &Mounted,
    has_index: bool,
) -> Result<Vec<(String, String)>, RunError> {
    let note = |key: &str, value: String| (key.to_owned(), value);
    let mut notes = vec![
        note("stand", stand.query("*IDN?").await?),
        note("date", now()),
        note("step", plan.name.clone()),
        note("sensor", session.sensor.clone()),
        note("serial", session.serial.clone()),
        note("operator", session.operator.clone()),
        note("mode", format!("{:?}", plan.mode).to_lowercase()),
        note("u_V", "asked".into()),
        note("i_A", "mean over [t_k, t_k+1)".into()),
        note("radius_m", mounted.radius_m.to_string()),
        note("tilt_deg", mounted.tilt_deg.to_string()),
    ];
    notes.retain(|(_, value)| !value.is_empty());
    if let Some(config) = plan.config().ok().flatten() {
        notes.push(note("profile", config.kind.name().to_owned()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        notes.extend(parameters.map(|p| note(&format!("profile_{}", p.name), (p.read)(&config).to_string())));
    }
    let counts = number(stand, "SETTings:counts_per_turn?").await?;
    notes.push(note("encoder", format!("{counts} counts per turn")));
    notes.push(note("theta_lsb_rad", format!("{:e}", std::f64::consts::TAU / counts)));
    notes.push(note("omega_lsb_rad_s", format!("{:e}", number(stand, "SETTings:rate_rad_s_per_code?").await?)));
    notes.push(note("supply_nominal_V", number(stand, "SETTings:supply_nominal_V?").await?.to_string()));
    let cutoff_Hz = number(stand, "SETTings:rate_cutoff_Hz?").await?;
    notes.push(note("omega_rad_s", if cutoff_Hz > 0.0 { format!("gyro, filter {cutoff_Hz} Hz") } else { "gyro".into() }));
    // The chip's own low-pass: what it does to phase and gain is known.
    let part = match session.what {
        What::Gyro if session.column.as_deref() != Some("omega_rad_s") => Some(0),
        What::Accel => Some(1),
        _ => None,
    };
    if let Some(part) = part {
        let query = "IMU:FILTer?";
        let says = stand.query(query).await?;
        let number = says.split(',').nth(part).and_then(|word| word.split_whitespace().next()?.parse::<f64>().ok());
        let cutoff_Hz = number.ok_or_else(|| ConnectionError::Reply { query: query.to_owned(), says })?;
        notes.push(note("sensor_filter_Hz", cutoff_Hz.to_string()));
    }
    notes.extend(plan.drive_s.map(|drive_s| note("drive_s", drive_s.to_string())));
    if has_index {
        notes.push(note("theta_zero", "index".into()));
    }
    Ok(notes)
}
