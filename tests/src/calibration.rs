//! Calibrations on the simulated stand: a stand and a session in TOML, run over the serial line in virtual time, and what was found.

use hal_sim::plant::Stand;
use host_tools::calibrate::record::{Record, compute};
use host_tools::calibrate::session::Session;
use host_tools::calibrate::session::journal::Journal;
use host_tools::calibrate::session::simulated::simulate;
use host_tools::calibrate::{Findings, Step};
use host_tools::statistics::uncertainty::{CONFIDENCE, Kind, Quantity, coverage_factor};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU32, Ordering};

/// A session's folder, gone with it.
pub struct Folder(PathBuf);

impl Folder {
    /// A new one.
    pub fn new() -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        Self(std::env::temp_dir().join(format!("stand-calibration-{}-{number}", std::process::id())))
    }
}

impl Default for Folder {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What is left behind harms nobody.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Runs a session on a stand; its folder.
///
/// # Panics
/// The stand or the session cannot be, or the session does not come to its end.
pub fn run(stand: &str, session: &str, seed: u64) -> Folder {
    let folder = Folder::new();
    let stand = Stand::parse(stand).unwrap_or_else(|e| panic!("stand: {e}"));
    let parsed = Session::parse(session).unwrap_or_else(|e| panic!("session: {e}"));
    simulate(&stand, seed, &parsed, session, None, &folder.0, |_| true).unwrap_or_else(|e| panic!("session: {e}"));
    folder
}

/// Runs a session on a stand and computes its record.
///
/// # Panics
/// As [`run`]; nothing can be computed.
pub fn calibrated(stand: &str, session: &str, seed: u64) -> Record {
    let folder = run(stand, session, seed);
    let record = compute(&folder.0).unwrap_or_else(|e| panic!("record: {e}"));
    for q in &record.findings.quantities {
        println!("{} = {:.7e} ± {:.2e} {} (noise {:.2e})", q.name, q.value, q.expanded(), q.unit, noise(q));
    }
    record
}

/// Runs a session and gives its steps with their logs, to compute from other parts of them.
///
/// # Panics
/// As [`run`]; a log that cannot be read.
pub fn recorded(stand: &str, session: &str, seed: u64) -> (Vec<Step>, Session) {
    let folder = run(stand, session, seed);
    let (journal, session) = Journal::read(&folder.0).unwrap_or_else(|e| panic!("journal: {e}"));
    (journal.logs(&folder.0).unwrap_or_else(|e| panic!("logs: {e}")), session)
}

/// A quantity that must be there.
///
/// # Panics
/// It is not.
pub fn found<'f>(findings: &'f Findings, name: &str) -> &'f Quantity {
    let why = || findings.absent.iter().find(|(absent, _)| absent == name).map_or("", |(_, why)| why);
    findings.get(name).unwrap_or_else(|| panic!("{name} was not found: {}", why()))
}

/// That a quantity holds the truth, and is known better than to `U`.
///
/// # Panics
/// It does not, or is not.
pub fn holds(findings: &Findings, name: &str, truth: f64, at_most_U: f64) {
    let q = found(findings, name);
    let U = q.expanded();
    assert!(q.holds(truth), "{name} = {} ± {U}, and it is {truth}", q.value);
    assert!(U <= at_most_U, "{name} = {} ± {U}: that is no knowledge, {at_most_U} was expected", q.value);
}

/// What the scatter alone says: the expanded uncertainty of the contributions of type A, without a drift that was seen.
pub fn noise(q: &Quantity) -> f64 {
    let scatter: Vec<_> = q.parts.iter().filter(|p| p.kind == Kind::A && p.of != "drift").collect();
    let u = scatter.iter().map(|p| p.contribution().powi(2)).sum::<f64>().sqrt();
    let dof = scatter.iter().map(|p| p.dof).fold(f64::INFINITY, f64::min);
    u * coverage_factor(dof, CONFIDENCE)
}
