//! Answers to the logs of a set on all cores. Each answer is kept as soon as it is there, so that an interrupted run goes on where it was.
//!
//! Each core's thread explains one log at a time, single-threaded. Answers of another build of the program are not continued.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use identification::identify::explain::{ExplainError, Explanation, Options, explain_with};
use rayon::ThreadPoolBuilder;
use sha2::{Digest, Sha256};
use stand_firmware::board::Hardware;

use super::case::Case;
use super::record::{AnswerRecord, List, LogRecord, read};
use super::visible::expected_gains;

/// The folder of unaccepted runs.
pub fn folder() -> PathBuf {
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
    target.join("campaigns")
}

/// Applies `work` to the ids that `path` has no record of, on all cores, and appends each record; prints a line for each. Returns all
/// records in the order of the ids.
///
/// # Errors
/// The file cannot be read or written.
pub fn resumed<R>(path: &Path, ids: &[String], work: impl Fn(&str) -> Result<(R, String), String> + Sync) -> Result<Vec<R>, String>
where
    R: serde::Serialize + serde::de::DeserializeOwned + Send + Clone + Identified,
{
    let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
    let build_file = path.with_extension("build");
    let build = build()?;
    if fs::read_to_string(&build_file).ok().as_deref() != Some(build.as_str()) {
        let _ = fs::remove_file(path);
        fs::create_dir_all(folder()).and_then(|()| fs::write(&build_file, &build)).map_err(|e| failed(&e))?;
    }
    let mut known: BTreeMap<String, R> = read::<R>(path)?.into_iter().map(|record| (record.id().to_owned(), record)).collect();
    let open: Vec<&String> = ids.iter().filter(|id| !known.contains_key(*id)).collect();
    let file = OpenOptions::new().create(true).append(true).open(path).map_err(|e| failed(&e))?;
    let has_header = file.metadata().map_err(|e| failed(&e))?.len() > 0;
    let csv = csv::WriterBuilder::new().has_headers(!has_header).from_writer(file);
    let (next, begin, progress) = (AtomicUsize::new(0), Instant::now(), Mutex::new((csv, Vec::new())));
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let one = |id: &String| {
        let alone = ThreadPoolBuilder::new().num_threads(1).build().map_err(|e| e.to_string())?;
        let (record, line) = alone.install(|| work(id))?;
        let mut progress = progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        progress.0.serialize(&record).and_then(|()| progress.0.flush().map_err(Into::into)).map_err(|e| failed(&e))?;
        progress.1.push(record);
        eprintln!("{}/{} {:.0} s {id}: {line}", progress.1.len(), open.len(), begin.elapsed().as_secs_f64());
        Ok::<(), String>(())
    };
    let results: Vec<Result<(), String>> = std::thread::scope(|scope| {
        let work = || -> Result<(), String> {
            while let Some(id) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                one(id)?;
            }
            Ok(())
        };
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        threads.into_iter().map(|thread| thread.join().unwrap_or_else(|_| Err("a log has ended its thread".to_owned()))).collect()
    });
    results.into_iter().collect::<Result<(), _>>()?;
    let (_, computed) = progress.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    known.extend(computed.into_iter().map(|record| (record.id().to_owned(), record)));
    Ok(ids.iter().filter_map(|id| known.get(id).cloned()).collect())
}

/// A record of one log.
pub trait Identified {
    /// Name of the log.
    fn id(&self) -> &str;
}

impl Identified for AnswerRecord {
    fn id(&self) -> &str {
        &self.id
    }
}

impl Identified for LogRecord {
    fn id(&self) -> &str {
        &self.id
    }
}

/// Hash of this program.
fn build() -> Result<String, String> {
    let program = std::env::current_exe().and_then(fs::read).map_err(|e| format!("this program: {e}"))?;
    Ok(Sha256::digest(program).iter().map(|byte| format!("{byte:02x}")).collect())
}

/// What the generator makes for a name.
///
/// # Errors
/// There is no such log.
pub fn generated(id: &str, data: Option<&Path>) -> Result<(LogRecord, String), String> {
    let case = Case::by_name(id, data)?;
    let gains = expected_gains(&case);
    let outsider = case.drawn.as_ref().and_then(|drawn| drawn.outsider.clone()).or_else(|| case.is_outsider.then(|| "outsider".to_owned()));
    let record = LogRecord {
        id: id.to_owned(),
        sha256: case.sha256(),
        hidden: List(case.hidden.iter().cloned().chain(outsider).collect()),
        expected_gain: List(gains.iter().map(|(effect, gain)| format!("{effect}={gain:.0}")).collect()),
    };
    let line = format!("{} {}", record.hidden.0.join(" "), record.expected_gain.0.join(" "));
    Ok((record, line))
}

/// The answer to the log of a name.
///
/// # Errors
/// There is no such log.
pub fn answered(id: &str, data: Option<&Path>) -> Result<(AnswerRecord, String), String> {
    let case = Case::by_name(id, data)?;
    let begin = Instant::now();
    let record = answer(&case);
    let line = format!("{} {:?}, {} passes, {:.1} s", record.verdict, record.missing.0, record.effort, begin.elapsed().as_secs_f64());
    Ok((record, line))
}

/// The answer to a case.
pub fn answer(case: &Case) -> AnswerRecord {
    let begun = AnswerRecord { id: case.id.clone(), sha256: case.sha256(), ..AnswerRecord::default() };
    match explain_with(Options::default(), vec![case.log.clone()], &case.user, &|_| ()) {
        Ok(explanation) => AnswerRecord { ..described(begun, &explanation, case) },
        Err(e) => {
            let verdict = if matches!(e, ExplainError::BadLog { .. }) { "bad-log" } else { "error" };
            AnswerRecord { verdict: verdict.to_owned(), error: e.to_string(), ..begun }
        }
    }
}

fn described(begun: AnswerRecord, e: &Explanation, case: &Case) -> AnswerRecord {
    let first = e.candidates.iter().find(|c| e.missing.first() == Some(&c.effect));
    let last = e.stages.last();
    let channels = e.given.channels.iter().zip(&e.explained.channels).map(|(given, last)| {
        let after = last.heldout_rms.unwrap_or(last.rms);
        format!("{}:{:.4}>{:.4}", given.channel.column(), given.chi2_per_n(), (after / last.noise).powi(2))
    });
    let parameters = last.map_or(&[][..], |stage| &stage.parameters).iter();
    AnswerRecord {
        verdict: e.verdict.name().to_owned(),
        missing: List(e.missing.clone()),
        alike: List(first.map_or_else(Vec::new, |c| c.ambiguous_with.clone())),
        chi2_per_n: List(channels.collect()),
        parameters: List(parameters.map(|p| format!("{}={:.6e}±{:.3e}", p.name, p.value, p.sigma)).collect()),
        deviations: List(deviations(e, case).into_iter().map(|(name, off)| format!("{name}={off:.3}")).collect()),
        effort: e.effort_passes.round() as u64,
        ..begun
    }
}

/// Fitted minus true value of the free parameters, in standard errors, if the added effects are the hidden ones.
fn deviations(e: &Explanation, case: &Case) -> Vec<(String, f64)> {
    let Some(truth) = &case.truth else { return Vec::new() };
    let is_hidden = |name: &String| case.hidden.contains(name);
    if e.missing.len() != case.hidden.len() || !e.missing.iter().all(is_hidden) {
        return Vec::new();
    }
    let Some(last) = e.stages.last() else { return Vec::new() };
    let fitted = last.parameters.iter().filter(|p| p.sigma > 0.0 && !p.name.ends_with("_order"));
    let off = fitted.filter_map(|p| {
        let mut off = p.value - truth.value(&p.name)?;
        if p.name == "eccentricity_phase_rad" {
            off -= index_shift(truth);
        }
        if p.name.ends_with("_phase_rad") {
            off -= std::f64::consts::TAU * (off / std::f64::consts::TAU).round();
        }
        Some((p.name.clone(), off / p.sigma))
    });
    off.collect()
}

/// Phase shift of an eccentric disc when the angle counts from its own index, which is displaced by e sin φ, in whole counts; a row
/// contains the middle of its count.
fn index_shift(truth: &identification::model::Model) -> f64 {
    let value = |name: &str| truth.value(name).unwrap_or(0.0);
    let count_rad = Hardware::default().rad_per_count();
    let shown = value("eccentricity_rad") * value("eccentricity_phase_rad").sin();
    value("eccentricity_order") * (shown / count_rad).floor() * count_rad
}
