//! Runs a session's steps on a stand and keeps what comes: one raw log a step, the journal after each.
//!
//! Whatever ends a step before its time (the line, a fault, a full disk, a kill), the rows until then are in the folder as `NAME.parquet.csv`, the journal says
//! so, and the session goes on later with that step from its begin.

use super::check::{Able, check};
use super::journal::{Done, FILE, Journal, JournalError, SESSION, now, sha256, write_whole};
use super::{How, PlanError, Session, StepPlan};
use crate::calibrate::Mounted;
use crate::record::{Place, Recorder, Taken};
use crate::stand::{SessionError, Stand};
use stand_firmware::profile::Parameter;
use stand_firmware::telemetry::{Channels, RowFrame};
use std::io::Write;
use std::path::Path;

/// How often is looked for rows, s.
const LOOK_S: f64 = 0.1;
/// A stand that says nothing for this long has gone, s.
const SILENCE_S: f64 = 3.0;
/// The stand switches its drive off when its host is silent for so long.
const WATCH: &str = "HOST:ARM 5 S";
/// Slower than this it is at rest, rad/s; and how long is waited for that, s.
const REST_RAD_S: f64 = 0.01;
const REST_S: f64 = 30.0;
/// The rate at which the index is looked for, rad/s, and how long, s.
const LOOK_RAD_S: f64 = 3.0;
const INDEX_S: f64 = 10.0;

/// What a session asks of a person.
pub trait Person {
    /// Does what is asked for and says so; `None`: does not, and the session ends there. How the part is to be mounted, and the moment of inertia that is to
    /// be on the platform beside it, kg m².
    fn does(&mut self, ask: &str, mounted: &Mounted, added_kg_m2: f64) -> Option<String>;
}

/// How far it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// The step's name.
    pub step: &'a str,
    /// Its number, from 1, and how many there are.
    pub number: usize,
    /// How many there are.
    pub of: usize,
    /// Time left of all steps, s.
    pub left_s: f64,
    /// The newest rate, rad/s.
    pub rate_rad_s: f64,
}

/// Why a session ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The line or the stand.
    #[error(transparent)]
    Stand(#[from] SessionError),
    /// Journal and logs.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The log cannot be written.
    #[error("{log}: cannot write: {says}")]
    Write {
        /// Which.
        log: String,
        /// Why.
        says: String,
    },
    /// A fault latched.
    #[error("step `{step}`: the stand switched off: {fault}")]
    Fault {
        /// In which step.
        step: String,
        /// What the stand says of it.
        fault: String,
    },
    /// Nothing came.
    #[error("step `{step}`: the stand is silent")]
    Silent {
        /// In which step.
        step: String,
    },
    /// A row lacks what the session needs.
    #[error("step `{step}`: the sensor under test is silent: {lacking} has no values")]
    Sensor {
        /// In which step.
        step: String,
        /// The columns.
        lacking: String,
    },
    /// The person did not.
    #[error("step `{step}`: not done: {ask}")]
    NotDone {
        /// In which step.
        step: String,
        /// What was asked for.
        ask: String,
    },
    /// It does not come to rest.
    #[error("step `{step}`: the platform does not come to rest")]
    Turning {
        /// Before which step.
        step: String,
    },
    /// The stand cannot run it.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The simulated stand cannot be, or stands still.
    #[error("{0}")]
    Simulated(String),
    /// Somebody ended it.
    #[error("ended by hand")]
    Interrupted,
}

/// Asks what the stand can, refuses what it cannot, and runs the session from its begin, or from where the journal ends. `text` is the session's file.
///
/// # Errors
/// What is refused, before anything moved; what ended it.
pub async fn whole(
    stand: &mut impl Stand,
    session: &Session,
    text: &str,
    begun: Option<Journal>,
    folder: &Path,
    person: &mut impl Person,
    goes: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    stand.tell("STReam OFF").await?;
    let fault = stand.ask("FAULt?").await?;
    if !fault.starts_with("0,") {
        let says = format!("the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first");
        return Err(PlanError::Whole(says).into());
    }
    check(session, &Able::of(stand).await?)?;
    let mut journal = match begun {
        Some(journal) => journal,
        None => {
            let journal = Journal::new(session.what, stand.ask("*IDN?").await?);
            begin(folder, text, &journal)?;
            journal
        }
    };
    run(stand, session, &mut journal, folder, person, goes).await
}

/// What a session's folder is told before it begins.
fn begin(folder: &Path, session: &str, journal: &Journal) -> Result<(), JournalError> {
    let failed = |says: String| JournalError::File { path: folder.to_owned(), says };
    if folder.join(FILE).exists() {
        return Err(failed("another session was begun here; --resume goes on with it, another --out begins anew".into()));
    }
    std::fs::create_dir_all(folder).map_err(|e| failed(e.to_string()))?;
    write_whole(&folder.join(SESSION), session)?;
    journal.write(folder)
}

/// Runs the steps that are not done; what ends it is in the journal too.
async fn run(
    stand: &mut impl Stand,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    person: &mut impl Person,
    mut goes: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    let ended = steps(stand, session, journal, folder, person, &mut goes).await;
    if let Err(error) = &ended {
        journal.interruptions.push(format!("{}: {error}", now()));
        // A disk that is full has no room for this either; what was there stays.
        let _ = journal.write(folder);
        let _ = stand.tell("PROFile:STOP;:HOST:ARM 0 S;:STReam OFF").await;
    }
    ended
}

async fn steps(
    stand: &mut impl Stand,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    person: &mut impl Person,
    goes: &mut impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    stand.tell("STReam OFF").await?;
    let mounted = session.mounted();
    let total = session.steps.len();
    let last = journal.steps.last();
    let mut here = (last.map(|done| done.mounted).unwrap_or_default(), last.and_then(|done| done.added_inertia_kg_m2).unwrap_or(0.0));
    for (k, plan) in session.steps.iter().enumerate() {
        if journal.steps.iter().any(|done| done.name == plan.name) {
            continue;
        }
        let there = (mounted[k], plan.added_inertia_kg_m2.unwrap_or(0.0));
        let ask = plan.ask.clone().or_else(|| asks(here, there));
        let asked = match ask {
            Some(ask) => {
                let said =
                    person.does(&ask, &there.0, there.1).ok_or_else(|| RunError::NotDone { step: plan.name.clone(), ask: ask.clone() })?;
                Some([ask, said])
            }
            None => None,
        };
        here = there;
        let after_s: f64 = session.steps[k + 1..].iter().map(|s| s.seconds).sum();
        let progress = |at_s: f64, rate_rad_s| Progress {
            step: &plan.name,
            number: k + 1,
            of: total,
            left_s: after_s + (plan.seconds - at_s).max(0.0),
            rate_rad_s,
        };
        let file = plan.file(k + 1);
        let began = now();
        let (rows, lost_rows) =
            record(stand, session, plan, &folder.join(&file), &mounted[k], &mut |at_s, rate| goes(progress(at_s, rate))).await?;
        let sha256 = sha256(&folder.join(&file))?;
        let (name, added_inertia_kg_m2) = (plan.name.clone(), plan.added_inertia_kg_m2);
        journal.steps.push(Done { name, log: file, sha256, rows, lost_rows, began, mounted: mounted[k], asked, added_inertia_kg_m2 });
        journal.write(folder)?;
    }
    Ok(())
}

/// What a person must do so that part and platform are as a step has them; `None`: nothing.
fn asks(here: (Mounted, f64), there: (Mounted, f64)) -> Option<String> {
    let mount = (here.0 != there.0).then(|| says_mounted(&there.0));
    let load = (here.1 != there.1).then(|| match there.1 {
        0.0 => "Take the added inertia off the platform.".to_owned(),
        added => format!("Put the inertia of {added} kg m² on the platform, centred on its axis."),
    });
    let all: Vec<String> = mount.into_iter().chain(load).collect();
    (!all.is_empty()).then(|| all.join(" "))
}

fn says_mounted(m: &Mounted) -> String {
    let lying = match m.lying {
        super::super::Lying::Flat => "its sensitive axis along the platform's",
        super::super::Lying::Side => "on its side, its y along the platform's axis",
        super::super::Lying::OtherSide => "on its other side, its y against the platform's axis",
    };
    format!("Mount the part at {} m from the axis, turned by {}°, {lying}; tilt the stand by {}°.", m.radius_m, m.turned_deg, m.tilt_deg)
}

/// The columns of a session's logs.
fn channels(session: &Session, plan: &StepPlan) -> Channels {
    // As many as the line carries at 1 kHz: a sensor's calibration goes without supply and winding.
    let mut names = vec!["u_V", "i_A", "theta_rad", "omega_rad_s", "limits", "fault"];
    match session.what {
        super::What::Drive => names.extend(["supply_V", "temp_C"]),
        // The stand's own rate sensor needs no other.
        super::What::Gyro if session.column.as_deref() == Some("omega_rad_s") => {}
        super::What::Gyro => names.extend(["gyro_rad_s", "sensor_C", "sensor_age_s"]),
        super::What::Accel => names.extend(["gyro_rad_s", "accel_x_m_s2", "accel_y_m_s2"]),
    }
    // Where the drive goes off in mid-record there is no command any more.
    if plan.mode == How::Rate && plan.drive_s.is_none() {
        names.push("rate_cmd_rad_s");
    }
    names.iter().filter_map(|name| Channels::named(name)).fold(Channels::default(), Channels::and)
}

/// Runs one step and writes its log; rows, and rows lost.
async fn record(
    stand: &mut impl Stand,
    session: &Session,
    plan: &StepPlan,
    path: &Path,
    mounted: &Mounted,
    goes: &mut impl FnMut(f64, f64) -> bool,
) -> Result<(u64, u64), RunError> {
    let name = &plan.name;
    let fault = stand.ask("FAULt?").await?;
    if !fault.starts_with("0,") {
        return Err(RunError::Fault { step: name.clone(), fault });
    }
    at_rest(stand, name).await?;
    let zero_rad = index(stand, plan.mode != How::Off).await?;
    at_rest(stand, name).await?;
    let config = plan.config().map_err(|says| RunError::Write { log: name.clone(), says })?;
    let channels = channels(session, plan);
    let list: Vec<&str> = channels.iter().map(|c| c.name).collect();
    let written = |e: std::io::Error| RunError::Write { log: path.display().to_string(), says: e.to_string() };
    let place = Place::of(path).map_err(JournalError::from)?;
    let notes = notes(stand, session, plan, mounted, zero_rad.is_some()).await?;
    let mut recorder = Recorder::new(place.create().map_err(written)?, channels, zero_rad.unwrap_or(0.0), notes);
    let mut orders = Vec::new();
    if let Some(config) = &config {
        orders.push(format!("PROFile:MODE {}", if plan.mode == How::Rate { "RATE" } else { "VOLTage" }));
        orders.push(format!("PROFile:TYPE {}", config.kind.name()));
        let parameters = config.kind.parameters().iter().filter_map(|name| Parameter::of_name(name));
        orders.extend(parameters.map(|p| format!("PROFile:{} {}", p.name, (p.read)(config))));
        orders.push(format!("PROFile:DURation {}", plan.drive_s.unwrap_or(plan.seconds + 0.5)));
    }
    orders.push(format!("STReam:CHANnels {}", list.join(",")));
    orders.push("STReam:DECimation 1".into());
    orders.push("STReam ON".into());
    orders.push(WATCH.into());
    if config.is_some() {
        orders.push("PROFile:STARt".into());
    }
    for order in &orders {
        stand.tell(order).await?;
    }
    let sequence = rows(stand, plan, &mut recorder, path, goes).await?;
    let lost_rows =
        sequence.map_or(0, |(first, last)| u64::from(last.wrapping_sub(first)) + 1).saturating_sub(recorder.rows() + recorder.left_out());
    for order in ["PROFile:STOP", "HOST:ARM 0 S", "STReam OFF"] {
        stand.tell(order).await?;
    }
    if !recorder.absent().is_empty() {
        return Err(RunError::Sensor { step: name.clone(), lacking: recorder.absent().join(", ") });
    }
    let written_rows = recorder.rows();
    recorder.finish(&[("lost_rows".into(), lost_rows.to_string())]).map_err(written)?;
    place.close().map_err(JournalError::from)?;
    Ok((written_rows, lost_rows))
}

/// Takes rows until the step is long enough; the numbers of the first and the last.
async fn rows<W: Write>(
    stand: &mut impl Stand,
    plan: &StepPlan,
    recorder: &mut Recorder<W>,
    path: &Path,
    goes: &mut impl FnMut(f64, f64) -> bool,
) -> Result<Option<(u32, u32)>, RunError> {
    let written = |e: std::io::Error| RunError::Write { log: path.display().to_string(), says: e.to_string() };
    let (mut silent_s, mut since_s) = (0.0, 0.0);
    let mut numbers: Option<(u32, u32)> = None;
    let mut rate = f64::NAN;
    loop {
        let came: Vec<RowFrame> = stand.wait_s(LOOK_S).await?;
        since_s += LOOK_S;
        silent_s = if came.is_empty() { silent_s + LOOK_S } else { 0.0 };
        if silent_s > SILENCE_S {
            recorder.flush().map_err(written)?;
            return Err(RunError::Silent { step: plan.name.clone() });
        }
        for row in &came {
            match recorder.take(row).map_err(written)? {
                Taken::Fault(_) => {
                    recorder.flush().map_err(written)?;
                    stand.tell("STReam OFF").await?;
                    let fault = stand.ask("FAULt?").await?;
                    return Err(RunError::Fault { step: plan.name.clone(), fault });
                }
                Taken::Written | Taken::LeftOut => {
                    numbers = Some((numbers.map_or(row.sequence, |(first, _)| first), row.sequence));
                    if recorder.last_s() + 0.5e-3 >= plan.seconds - 1e-3 {
                        return Ok(numbers);
                    }
                }
                Taken::NotYet => {}
            }
        }
        if let Some(row) = came.last() {
            rate = row.named().find(|(name, _)| *name == "omega_rad_s").map_or(rate, |(_, rate)| rate);
        }
        if recorder.left_out() > 500 {
            recorder.flush().map_err(written)?;
            return Err(RunError::Sensor { step: plan.name.clone(), lacking: "a column".into() });
        }
        if !goes(recorder.last_s(), rate) {
            recorder.flush().map_err(written)?;
            return Err(RunError::Interrupted);
        }
        if since_s >= 1.0 {
            since_s = 0.0;
            recorder.flush().map_err(written)?;
            stand.tell(WATCH).await?;
        }
    }
}

async fn number(stand: &mut impl Stand, query: &str) -> Result<f64, SessionError> {
    let says = stand.ask(query).await?;
    let word = says.split([' ', ',']).next().unwrap_or_default().parse();
    word.map_err(|_| SessionError::Reply { query: query.to_owned(), says })
}

/// Brings the platform to rest, then takes the drive off.
async fn at_rest(stand: &mut impl Stand, step: &str) -> Result<(), RunError> {
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
                stand.tell("OUTPut OFF").await?;
                stand.wait_s(0.5).await?;
            }
            return Ok(());
        }
        if still == 0 && !braked {
            for order in ["SOURce:RATE 0 RAD/S", "SOURce:MODE RATE", "OUTPut ON"] {
                stand.tell(order).await?;
            }
            braked = true;
        }
    }
    Err(RunError::Turning { step: step.to_owned() })
}

/// What must be added to angles so that their zero is the index; it is looked for once, where the platform may turn.
async fn index(stand: &mut impl Stand, may_turn: bool) -> Result<Option<f64>, RunError> {
    for order in ["STReam:DECimation 1", "STReam:CHANnels theta_rad,from_index_rad", "STReam ON"] {
        stand.tell(order).await?;
    }
    let seen = |rows: &[RowFrame]| {
        rows.iter().rev().find_map(|row| {
            let value = |name: &str| row.named().find(|(n, _)| *n == name).map_or(f64::NAN, |(_, value)| value);
            let zero_rad = value("from_index_rad") - value("theta_rad");
            zero_rad.is_finite().then_some(zero_rad)
        })
    };
    let mut zero = seen(&stand.wait_s(0.1).await?);
    if zero.is_none() && may_turn {
        for order in [WATCH.to_owned(), format!("SOURce:RATE {LOOK_RAD_S} RAD/S"), "SOURce:MODE RATE".into(), "OUTPut ON".into()] {
            stand.tell(&order).await?;
        }
        let mut waited_s = 0.0;
        while zero.is_none() && waited_s < INDEX_S {
            zero = seen(&stand.wait_s(0.5).await?);
            waited_s += 0.5;
            stand.tell(WATCH).await?;
        }
        stand.tell("HOST:ARM 0 S").await?;
    }
    stand.tell("STReam OFF").await?;
    Ok(zero)
}

/// What the log says of itself: interfaces.md, "Logs".
async fn notes(
    stand: &mut impl Stand,
    session: &Session,
    plan: &StepPlan,
    mounted: &Mounted,
    has_index: bool,
) -> Result<Vec<(String, String)>, RunError> {
    let note = |key: &str, value: String| (key.to_owned(), value);
    let mut notes = vec![
        note("stand", stand.ask("*IDN?").await?),
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
        super::What::Gyro if session.column.as_deref() != Some("omega_rad_s") => Some(0),
        super::What::Accel => Some(1),
        _ => None,
    };
    if let Some(part) = part {
        let query = "IMU:FILTer?";
        let says = stand.ask(query).await?;
        let number = says.split(',').nth(part).and_then(|word| word.split_whitespace().next()?.parse::<f64>().ok());
        let cutoff_Hz = number.ok_or_else(|| SessionError::Reply { query: query.to_owned(), says })?;
        notes.push(note("sensor_filter_Hz", cutoff_Hz.to_string()));
    }
    notes.extend(plan.drive_s.map(|drive_s| note("drive_s", drive_s.to_string())));
    if has_index {
        notes.push(note("theta_zero", "index".into()));
    }
    Ok(notes)
}
