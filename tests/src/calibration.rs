//! Calibrations on the simulated stand: a stand and a session in TOML, run over the serial line in virtual time, and the findings.

use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use identification::statistics::Extremes;
use identification::statistics::uncertainty::{COVERAGE_PROBABILITY, Evaluation, coverage_factor};
use stand_acquire::calibration_session::journal::{Journal, read_logs};
use stand_acquire::calibration_session::simulated::simulate;
use stand_acquire::calibration_session::{PreparedSession, Session};
use stand_analysis::calibrate::{Findings, Quantity, Step};
use stand_records::record::{CalibrationRecord, compute};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// The folder of a session; dropping it removes the folder.
pub struct Folder(PathBuf);

impl Folder {
    /// A new folder name.
    pub fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("stand-calibration-{}-{number}", std::process::id())))
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.0
    }
}

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A folder that remains does no harm.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs a session on a stand; returns its folder.
///
/// # Panics
/// The stand or the session is invalid, or the session does not complete.
pub fn run(stand: &str, session: &str, seed: u64) -> Folder {
    let folder = Folder::new();
    let stand = Stand::parse(stand).unwrap_or_else(|e| panic!("stand: {e}"));
    let parsed = Session::parse(session).unwrap_or_else(|e| panic!("session: {e}"));
    let prepared = PreparedSession { session: parsed, text: session.to_owned(), begun: None, simulated_seed: None };
    simulate(&stand, seed, &prepared, &folder.0, Deadline::NEVER, |_| true).unwrap_or_else(|e| panic!("session: {e}"));
    folder
}

/// Runs a session on a stand and computes its record.
///
/// # Panics
/// As [`run`]; the logs give no calibration.
pub fn calibrated(stand: &str, session: &str, seed: u64) -> CalibrationRecord {
    let folder = run(stand, session, seed);
    let record = compute(&folder.0).unwrap_or_else(|e| panic!("record: {e}"));
    for q in &record.findings.quantities {
        println!("{} = {:.7e} ± {:.2e} {} (noise {:.2e})", q.name, q.value, q.expanded_u(), q.unit, noise(q));
    }
    record
}

/// Runs a session; returns its steps with their logs.
///
/// # Panics
/// As [`run`]; a log cannot be read.
pub fn recorded(stand: &str, session: &str, seed: u64) -> (Vec<Step>, Session) {
    let folder = run(stand, session, seed);
    let (journal, session) = Journal::read(&folder.0).unwrap_or_else(|e| panic!("journal: {e}"));
    (read_logs(&journal.steps, &folder.0).unwrap_or_else(|e| panic!("logs: {e}")), session)
}

/// A quantity of the findings.
///
/// # Panics
/// The quantity was not found.
pub fn found<'f>(findings: &'f Findings, name: &str) -> &'f Quantity {
    let reason = || findings.absent.iter().find(|absent| absent.quantity == name).map(|absent| &absent.reason);
    findings.get(name).unwrap_or_else(|| panic!("{name} was not found: {:?}", reason()))
}

/// Asserts that the interval of a quantity contains the truth and that U is at most `max_U`.
///
/// # Panics
/// The interval does not contain the truth, or U is larger.
pub fn assert_covers(findings: &Findings, name: &str, truth: f64, max_U: f64) {
    let q = found(findings, name);
    let U = q.expanded_u();
    assert!(q.covers(truth), "{name} = {} ± {U}, truth {truth}", q.value);
    assert!(U <= max_U, "{name} = {} ± {U}: U exceeds {max_U}", q.value);
}

/// Expanded uncertainty of the type A contributions except drift.
pub fn noise(q: &Quantity) -> f64 {
    let scatter: Vec<_> = q.contributions.iter().filter(|c| c.evaluation == Evaluation::A && c.source != "drift").collect();
    let u = scatter.iter().map(|c| c.contribution().powi(2)).sum::<f64>().sqrt();
    let dof = scatter.iter().map(|c| c.dof).min_or_infinity();
    u * coverage_factor(dof, COVERAGE_PROBABILITY)
}
