//! Runs the steps of a session on a stand: one raw log per step, the journal updated after each.
//!
//! When a step ends early (serial line, fault, full disk, kill), its rows remain in the folder as `NAME.parquet.csv` and the journal has
//! the reason. The resumed session repeats the step; the earlier rows are kept under the name of an attempt. The journal names the current
//! step before it begins, which reveals a killed program.

use super::check::{StandLimits, check};
use super::error::RunError;
use super::journal::{JOURNAL_FILE, Journal, JournalError, SESSION_FILE, StepRecord, sha256, write_atomically};
use super::step::{RecordedStep, put_aside, record};
use super::{Instruction, Mounting, PlanError, PreparedSession, Session};
use crate::connection::StandConnection;
use crate::preparation::{is_rejected, latched_fault};
use identification::log::timestamp;
use std::path::Path;

/// Who mounts the device under test and loads the platform.
pub trait Operator {
    /// Performs an instruction: `mounting` of the device under test, `added_kg_m2` of additional inertia on the platform. Returns the
    /// operator's answer, or `None` when the instruction was not carried out, which ends the session.
    fn perform(&mut self, instruction: &Instruction, mounting: &Mounting, added_kg_m2: f64) -> Option<String>;
}

/// Progress of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress<'a> {
    /// Name of the step.
    pub step: &'a str,
    /// Number of the step, from 1.
    pub number: usize,
    /// Number of steps.
    pub of: usize,
    /// Remaining time of all steps, s.
    pub left_s: f64,
    /// Latest rate, rad/s.
    pub rate_rad_s: f64,
}

impl RunError {
    /// The message begins with the step.
    fn names_step(&self) -> bool {
        match self {
            RunError::Fault { .. }
            | RunError::Silent { .. }
            | RunError::Restarted { .. }
            | RunError::Sensor { .. }
            | RunError::NotDone { .. }
            | RunError::Turning { .. } => true,
            RunError::Plan(error) => matches!(error, PlanError::Step { .. }),
            RunError::Stand(_) | RunError::Journal(_) | RunError::Write { .. } | RunError::Simulated(_) | RunError::Interrupted => false,
        }
    }
}

/// Checks a session against the limits of the stand and runs it: from the beginning, or from the end of its journal.
///
/// # Errors
/// A session that the stand cannot run, before anything moves; the reason for an early end.
pub async fn run_session(
    stand: &mut impl StandConnection,
    prepared: &PreparedSession,
    folder: &Path,
    operator: &mut impl Operator,
    on_progress: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    let session = &prepared.session;
    match stand.command("STReam OFF").await {
        Err(error) if !is_rejected(&error) => return Err(error.into()),
        _ => {}
    }
    if let Some(fault) = latched_fault(stand).await? {
        let message = format!("a fault has switched the drive off: {fault}; send FAULt:CLEar in `stand console` first");
        return Err(PlanError::Session(message).into());
    }
    check(session, &StandLimits::query(stand).await?)?;
    let mut journal = match &prepared.begun {
        Some(journal) => {
            let now = stand.query("*IDN?").await?;
            if unit(&now) != unit(&journal.stand) {
                let message = format!("the session was begun on the stand `{}`, this one is `{now}`", journal.stand);
                return Err(PlanError::Session(message).into());
            }
            journal.clone()
        }
        None => {
            let mut journal = Journal::new(session.dut_kind, stand.query("*IDN?").await?);
            journal.simulated_seed = prepared.simulated_seed;
            create_folder(folder, &prepared.text, &journal)?;
            journal
        }
    };
    run_remaining(stand, session, &mut journal, folder, operator, on_progress).await
}

/// Manufacturer, model and serial number in the reply to `*IDN?`; a session may go on with another firmware.
fn unit(identity: &str) -> Vec<&str> {
    identity.split(',').take(3).map(str::trim).collect()
}

/// Creates the folder of a session with its session file and journal.
fn create_folder(folder: &Path, session: &str, journal: &Journal) -> Result<(), JournalError> {
    let failed = |message: String| JournalError::File { path: folder.to_owned(), message };
    if folder.join(JOURNAL_FILE).exists() {
        return Err(failed("the folder has a session already: --resume continues it, another --out begins a new one".into()));
    }
    std::fs::create_dir_all(folder).map_err(|e| failed(e.to_string()))?;
    write_atomically(&folder.join(SESSION_FILE), session)?;
    journal.write(folder)
}

/// Runs the steps that are not done; the journal keeps the reason for an early end.
async fn run_remaining(
    stand: &mut impl StandConnection,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    operator: &mut impl Operator,
    mut on_progress: impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    if let Some(step) = journal.current_step.take() {
        journal.interruptions.push(format!("step `{step}`: the program ended without an entry: killed, power failure, or disk full"));
    }
    let ended = steps(stand, session, journal, folder, operator, &mut on_progress).await;
    if let Err(error) = &ended {
        let step = journal.current_step.take().filter(|_| !error.names_step()).map_or(String::new(), |step| format!("step `{step}`: "));
        journal.interruptions.push(format!("{}: {step}{error}", timestamp()));
        // On a full disk this fails too, and the previous journal remains.
        let _ = journal.write(folder);
        let _ = stand.command("PROFile:STOP;:STReam OFF").await;
    }
    ended
}

async fn steps(
    stand: &mut impl StandConnection,
    session: &Session,
    journal: &mut Journal,
    folder: &Path,
    operator: &mut impl Operator,
    on_progress: &mut impl FnMut(Progress) -> bool,
) -> Result<(), RunError> {
    stand.command("STReam OFF").await?;
    let mountings = session.mountings();
    let total = session.steps.len();
    let last = journal.steps.last();
    let mut current = (last.map(|done| done.mounting).unwrap_or_default(), last.and_then(|done| done.added_inertia_kg_m2).unwrap_or(0.0));
    for (k, plan) in session.steps.iter().enumerate() {
        if journal.steps.iter().any(|done| done.name == plan.name) {
            continue;
        }
        let next = (mountings[k], plan.added_inertia_kg_m2.unwrap_or(0.0));
        let wanted = Instruction::before(plan, current, next);
        let instruction = if wanted.is_empty() {
            None
        } else {
            let not_done = || RunError::NotDone { step: plan.name.clone(), instruction: wanted.to_string() };
            let answer = operator.perform(&wanted, &next.0, next.1).ok_or_else(not_done)?;
            Some([wanted.to_string(), answer])
        };
        current = next;
        let after_s: f64 = session.steps[k + 1..].iter().map(|s| s.seconds).sum();
        let progress = |at_s: f64, rate_rad_s| Progress {
            step: &plan.name,
            number: k + 1,
            of: total,
            left_s: after_s + (plan.seconds - at_s).max(0.0),
            rate_rad_s,
        };
        let file = plan.file(k + 1);
        let began = timestamp();
        journal.interruptions.extend(put_aside(folder, &file)?);
        journal.current_step = Some(plan.name.clone());
        journal.write(folder)?;
        let RecordedStep { rows, lost_rows, clock } =
            record(stand, session, plan, &folder.join(&file), &mountings[k], &mut |at_s, rate| on_progress(progress(at_s, rate))).await?;
        let sha256 = sha256(&folder.join(&file))?;
        let (name, added_inertia_kg_m2) = (plan.name.clone(), plan.added_inertia_kg_m2);
        journal.current_step = None;
        let mounting = mountings[k];
        journal.steps.push(StepRecord {
            name,
            log: file,
            sha256,
            rows,
            lost_rows,
            began,
            mounting,
            instruction,
            added_inertia_kg_m2,
            clock,
        });
        journal.write(folder)?;
    }
    Ok(())
}
