//! Runs a session's steps on a stand and keeps what comes: one raw log a step, the journal after each.
//!
//! Whatever ends a step before its time (the line, a fault, a full disk, a kill), the rows until then are in the folder as `NAME.parquet.csv`, the journal says
//! so, and the session goes on later with that step from its begin; what was recorded of it before stays, under the name of an attempt. The journal names the
//! step that is under way before it begins, so that a program that was killed is told by what it left.

use super::check::{Able, check};
use super::journal::{Done, FILE, Journal, JournalError, SESSION, now, sha256, write_whole};
use super::ready::{fault, is_refused};
use super::step::{put_aside, record};
use super::{PlanError, Session};
use crate::acquire::connection::{ConnectionError, StandConnection};
use crate::calibrate::Mounted;
use std::path::Path;

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
    Stand(#[from] ConnectionError),
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
    /// Nothing came, and then it answered as one that was just switched on.
    #[error("step `{step}`: the stand has started anew in the middle of it: was its supply cut?")]
    Restarted {
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
    stand: &mut impl StandConnection,
    session: &Session,
    text: &str,
    begun: Option<Journal>,
    folder: &Path,
    person: &mut impl Person,
    goes: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    match stand.command("STReam OFF").await {
        Err(error) if !is_refused(&error) => return Err(error.into()),
        _ => {}
    }
    if let Some(fault) = fault(stand).await? {
        let says = format!("the drive is off by a fault: {fault}; FAULt:CLEar in `stand console` first");
        return Err(PlanError::Whole(says).into());
    }
    check(session, &Able::of(stand).await?)?;
    let mut journal = match begun {
        Some(journal) => journal,
        None => {
            let journal = Journal::new(session.what, stand.query("*IDN?").await?);
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
    stand: &mut impl StandConnection,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    person: &mut impl Person,
    mut goes: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    if let Some(step) = journal.under_way.take() {
        journal
            .interruptions
            .push(format!("step `{step}`: the program that ran it ended without a word: killed, without power, or its disk full"));
    }
    let ended = steps(stand, session, journal, folder, person, &mut goes).await;
    if let Err(error) = &ended {
        let step = journal.under_way.take().map_or(String::new(), |step| format!("step `{step}`: "));
        let says = error.to_string();
        let says = says.strip_prefix(&step).unwrap_or(&says);
        journal.interruptions.push(format!("{}: {step}{says}", now()));
        // A disk that is full has no room for this either; what was there stays.
        let _ = journal.write(folder);
        let _ = stand.command("PROFile:STOP;:HOST:ARM 0 S;:STReam OFF").await;
    }
    ended
}

async fn steps(
    stand: &mut impl StandConnection,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    person: &mut impl Person,
    goes: &mut impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    stand.command("STReam OFF").await?;
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
        journal.interruptions.extend(put_aside(folder, &file)?);
        journal.under_way = Some(plan.name.clone());
        journal.write(folder)?;
        let (rows, lost_rows) =
            record(stand, session, plan, &folder.join(&file), &mounted[k], &mut |at_s, rate| goes(progress(at_s, rate))).await?;
        let sha256 = sha256(&folder.join(&file))?;
        let (name, added_inertia_kg_m2) = (plan.name.clone(), plan.added_inertia_kg_m2);
        journal.under_way = None;
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
