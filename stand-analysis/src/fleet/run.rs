//! Computes a table on the cores of this machine: each log on one thread, the longest first, so that no core waits long at the end.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::identity::IdentityTable;
use super::row::{NOT_FINISHED, Row};
use super::session::{FileHash, MAX_ATTEMPTS, Session, SessionError};

/// The table, and how it came about.
#[derive(Debug)]
pub struct FleetRun {
    /// The rows of the table, sorted by path.
    pub rows: Vec<Row>,
    /// Number of logs.
    pub logs: usize,
    /// Answers that this run has computed.
    pub computed: usize,
    /// The run was interrupted: logs may be missing.
    pub is_interrupted: bool,
}

impl FleetRun {
    /// Number of logs without an explanation.
    pub fn failed(&self) -> usize {
        self.rows.iter().filter(|row| !row.is_explained()).count()
    }
}

/// What a run asks of its caller.
pub struct Callbacks<'a> {
    /// The row of the log at a path with this hash.
    pub compute: &'a (dyn Fn(&Path, &FileHash) -> Row + Sync),
    /// The run shall end; computations in progress end early by themselves.
    pub is_interrupted: &'a (dyn Fn() -> bool + Sync),
    /// Called after each log with the number of logs that have an answer.
    pub finished: &'a (dyn Fn(&Row, usize) + Sync),
}

/// Computes the answers about `paths` that the session does not have, on `threads` threads, and writes the table.
///
/// # Errors
/// The journal or the table cannot be written.
pub fn run(
    session: Session,
    paths: &[String],
    identities: &IdentityTable,
    threads: usize,
    callbacks: &Callbacks<'_>,
) -> Result<FleetRun, SessionError> {
    let logs = on_threads(threads, paths, |path| match FileHash::of(Path::new(path)) {
        _ if (callbacks.is_interrupted)() => None,
        Ok(hash) => Some((path.clone(), Ok(hash))),
        Err(error) => Some((path.clone(), Err(format!("{path}: cannot read: {error}")))),
    });
    let mut failures = BTreeMap::new();
    let mut seen = BTreeSet::new();
    let mut open: Vec<(&String, &FileHash)> = Vec::new();
    for (path, hash) in &logs {
        let Ok(hash) = hash else { continue };
        if session.is_abandoned(&hash.sha256) {
            let reason = format!("the program ended {MAX_ATTEMPTS} times while it computed this log, for example for lack of memory");
            failures.insert(hash.sha256.clone(), reason);
        } else if session.answer(&hash.sha256).is_none() && seen.insert(&hash.sha256) {
            open.push((path, hash));
        }
    }
    open.sort_by_key(|(_, hash)| std::cmp::Reverse(hash.bytes));
    let done = AtomicUsize::new(logs.len() - open.len());
    let session = Mutex::new(session);
    let computed = on_threads(threads, &open, |(path, hash)| {
        if (callbacks.is_interrupted)() {
            return None;
        }
        // The lock is held for a line of the journal, never during a computation.
        let begun = locked(&session).begin(&hash.sha256);
        if let Err(error) = begun {
            return Some(Err(error));
        }
        let row = compute(path, hash, callbacks.compute);
        if row.verdict == NOT_FINISHED && (callbacks.is_interrupted)() {
            return None;
        }
        (callbacks.finished)(&row, done.fetch_add(1, Ordering::Relaxed) + 1);
        let kept = locked(&session).record(row);
        Some(kept)
    });
    let session = session.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let computed = computed.into_iter().collect::<Result<Vec<()>, _>>()?.len();
    let rows = session.write_table(&logs, &failures, identities)?;
    let is_interrupted = rows.len() < paths.len();
    Ok(FleetRun { rows, logs: paths.len(), computed, is_interrupted })
}

/// The row of a log; a panic of the computation is an error of this log alone.
pub fn compute(path: &str, hash: &FileHash, row: &dyn Fn(&Path, &FileHash) -> Row) -> Row {
    catch_unwind(AssertUnwindSafe(|| row(Path::new(path), hash))).unwrap_or_else(|_| {
        let message = "internal error of the program; standard error has its message".to_owned();
        Row::failed(path, Some((hash.sha256.clone(), hash.bytes)), message)
    })
}

fn locked(session: &Mutex<Session>) -> std::sync::MutexGuard<'_, Session> {
    session.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Applies `work` to all items on so many threads, each with its own pool of one thread: a search waits for no other, and its sums have one
/// order. Items for which it returns `None` are left out.
fn on_threads<I: Sync, T: Send>(threads: usize, items: &[I], work: impl Fn(&I) -> Option<T> + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(items.len()));
    let one = || {
        while let Some((k, item)) = Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|k| Some((k, items.get(k)?))) {
            if let Some(result) = work(item) {
                results.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((k, result));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            scope.spawn(|| on_one_thread(one));
        }
    });
    let mut results = results.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    results.sort_by_key(|(k, _)| *k);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Runs `work` where parallel loops have one thread.
pub fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}
