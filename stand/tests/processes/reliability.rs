//! What a failure at any moment leaves: complete files or none, whole rows up to the last second, one clear line, a stand that has stopped.
//!
//! `STAND_MOMENTS` is the number of moments of each failure (a few in the tests, 200 in `scripts/full-benches.sh`); with `--nocapture` the
//! table of docs/reliability.md is printed.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use calibration::{SHORT, carrying, quantity};
use common::served::{Served, send_lines};
use common::{MODEL, RunOutput, command, stand};
use identification::log::{Log, LogWarning};
use identification::model::Model;
use tempfile::TempDir;

/// Moments of each failure without `STAND_MOMENTS`.
const SAMPLE: usize = 4;
/// Moments that are tried at the same time.
const AT_ONCE: usize = 8;
/// Time that a recording is behind its stand, s: rows are flushed each second, and a read of the line takes a tenth.
const BEHIND_S: f64 = 1.6;
/// Time after which a stand without a client has stopped, s: 2 s of silence, then braking.
const STOPPED_S: u64 = 4;

/// The tests of this file measure times; they run one after another.
static ALONE: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

fn moments() -> usize {
    std::env::var("STAND_MOMENTS").ok().and_then(|n| n.parse().ok()).unwrap_or(SAMPLE)
}

/// Result of one moment.
#[derive(Debug, Default)]
struct Outcome {
    /// Rows that are not on the disk although the stand had sent them, s.
    lost_s: f64,
    /// Line on standard error; empty where the program was killed.
    message: String,
}

/// Tries a failure at each moment, as a share of the work from 0 to 1, and prints a line of the table.
fn campaign(command: &str, failure: &str, stand: &str, try_at: impl Fn(f64) -> Outcome + Sync) {
    let count = moments();
    let next = AtomicUsize::new(0);
    let outcomes = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE.min(count) {
            scope.spawn(|| {
                loop {
                    let k = next.fetch_add(1, Ordering::Relaxed);
                    if k >= count {
                        break;
                    }
                    let outcome = try_at((k as f64 + 0.5) / count as f64);
                    outcomes.lock().unwrap().push(outcome);
                }
            });
        }
    });
    let outcomes = outcomes.into_inner().unwrap();
    let lost_s = outcomes.iter().map(|outcome| outcome.lost_s).fold(0.0, f64::max);
    let lost = if lost_s > 0.0 { format!("at most {lost_s:.1} s of rows") } else { "nothing".to_owned() };
    let message = outcomes
        .iter()
        .map(|outcome| outcome.message.trim_start_matches("stand: "))
        .find(|message| !message.is_empty())
        .unwrap_or("(killed)");
    println!("| `{command}` | {failure} | {count} | {lost} | {stand} | {message} |");
}

/// A folder with a model, and a log of three seconds.
fn folder() -> TempDir {
    common::folder()
}

/// The time that a command takes, s.
fn duration_s(folder: &Path, words: &[&str]) -> f64 {
    let begun = Instant::now();
    stand(folder, words).succeeded();
    begun.elapsed().as_secs_f64()
}

fn spawn(folder: &Path, words: &[&str]) -> Child {
    command(folder, words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn kill_after(mut child: Child, seconds: f64) -> bool {
    std::thread::sleep(Duration::from_secs_f64(seconds));
    let running = child.try_wait().unwrap().is_none();
    child.kill().unwrap();
    child.wait().unwrap();
    running
}

/// The command with files limited to `blocks` of 512 or 1024 bytes: writing more fails, as on a full disk.
fn on_full_disk(folder: &Path, words: &[&str], blocks: usize) -> RunOutput {
    let words = words.join(" ");
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec {} {words}", env!("CARGO_BIN_EXE_stand"));
    Command::new("sh").args(["-c", &script]).current_dir(folder).stdin(Stdio::null()).output().unwrap().into()
}

/// Asserts the status of a failure in operation and one line on standard error, behind at most one on what became of the drive; the line.
#[track_caller]
fn failed_in_operation(ran: &RunOutput, names: &str) -> String {
    assert_eq!(ran.status, Some(1), "{ran:?}");
    let lines: Vec<&str> = ran.err.lines().collect();
    let (line, before) = lines.split_last().unwrap();
    assert!(line.contains(names), "{ran:?}");
    assert!(before.len() <= 1 && before.iter().all(|line| line.starts_with("stand: the drive ")), "{ran:?}");
    (*line).to_owned()
}

/// A file is absent, or a complete log of `rows` rows.
#[track_caller]
fn absent_or_whole(path: &Path, rows: usize) {
    if path.exists() {
        let log = Log::read(path).unwrap();
        assert!(log.len() == rows && log.warnings().is_empty(), "{} rows, {:?}", log.len(), log.warnings());
    }
}

/// The largest file of `folder`, in blocks of 512 bytes.
fn blocks(path: &Path) -> usize {
    std::fs::metadata(path).unwrap().len() as usize / 512
}

#[test]
fn killed_or_full_sim_and_fit_leave_a_complete_file_or_none() {
    let _alone = alone();
    let main = folder();
    let path = main.path();
    for (out, rows) in [("long.csv", 8000), ("long.parquet", 8000)] {
        let words = ["sim", "--out", out, "--seconds", "8", "--force"];
        let whole_s = duration_s(path, &words);
        let size = blocks(&path.join(out));
        campaign(&format!("sim --out {out}"), "kill −9", "–", |share| {
            let folder = tempfile::tempdir().unwrap();
            kill_after(spawn(folder.path(), &words), share * whole_s);
            absent_or_whole(&folder.path().join(out), rows);
            Outcome::default()
        });
        campaign(&format!("sim --out {out}"), "disk full", "–", |share| {
            let folder = tempfile::tempdir().unwrap();
            std::fs::copy(path.join("log.csv"), folder.path().join("log.csv")).unwrap();
            let before = common::files(folder.path());
            let ran = on_full_disk(folder.path(), &words, (share * 0.45 * size as f64) as usize);
            assert_eq!(common::files(folder.path()), before, "no file is left behind");
            Outcome { lost_s: 0.0, message: failed_in_operation(&ran, out) }
        });
    }
    let words = ["fit", "log.csv", "--model", "model.toml", "--out", "fitted.toml", "--force"];
    let whole_s = duration_s(path, &words);
    campaign("fit --out fitted.toml", "kill −9", "–", |share| {
        let folder = tempfile::tempdir().unwrap();
        for file in ["log.csv", "model.toml"] {
            std::fs::copy(path.join(file), folder.path().join(file)).unwrap();
        }
        std::fs::copy(path.join("model.toml"), folder.path().join("fitted.toml")).unwrap();
        kill_after(spawn(folder.path(), &words), share * whole_s);
        Model::read(folder.path().join("fitted.toml")).unwrap();
        Outcome::default()
    });
    campaign("fit --out fitted.toml", "disk full", "–", |_| {
        let folder = tempfile::tempdir().unwrap();
        for file in ["log.csv", "model.toml"] {
            std::fs::copy(path.join(file), folder.path().join(file)).unwrap();
        }
        std::fs::write(folder.path().join("fitted.toml"), MODEL).unwrap();
        let ran = on_full_disk(folder.path(), &words, 0);
        assert_eq!(std::fs::read_to_string(folder.path().join("fitted.toml")).unwrap(), MODEL, "the previous model");
        Outcome { lost_s: 0.0, message: failed_in_operation(&ran, "fitted.toml") }
    });
}

/// Asserts that the drive of the served stand is off, once the stand had the time to notice its silence.
#[track_caller]
fn drive_is_off(folder: &Path, port: &str, after_s: u64) {
    // The time of a simulated stand stands still while the machine has none for it: on a busy one the silence is asked for again.
    let state = |_| {
        std::thread::sleep(Duration::from_secs(after_s));
        send_lines(folder, port, "OUTPut?;:FAULt?\n")
    };
    let states: Vec<RunOutput> = (0..if after_s > 0 { 4 } else { 1 })
        .map(state)
        .scan(false, |is_off, state| (!std::mem::replace(is_off, state.out.starts_with("0;"))).then_some(state))
        .collect();
    assert!(states.last().is_some_and(|state| state.out.starts_with("0;")), "{states:?}");
}

/// The rows of the interrupted recording `log.part.csv`, s; none before its first whole row.
#[track_caller]
fn kept_s(folder: &Path) -> f64 {
    let part = folder.join("log.part.csv");
    let text = std::fs::read_to_string(&part).unwrap_or_default();
    if text.split_inclusive('\n').filter(|line| !line.starts_with('#') && line.ends_with('\n')).count() < 2 {
        return 0.0;
    }
    let log = Log::read(&part).unwrap();
    let cut = if text.ends_with('\n') { None } else { Some(LogWarning::RowCutShort { line: text.lines().count() }) };
    let expected: Vec<_> = cut.into_iter().chain([LogWarning::EndMissing { rows: log.len() }]).collect();
    assert_eq!(log.warnings(), expected);
    log.duration_s()
}

/// Asserts that `log.part.csv` ends with a whole row, if there is one.
#[track_caller]
fn ends_with_a_whole_row(folder: &Path) {
    let text = std::fs::read_to_string(folder.join("log.part.csv")).unwrap_or_default();
    assert!(text.is_empty() || text.ends_with('\n'), "{:?}", text.lines().last());
}

#[test]
fn failed_recording_leaves_its_rows_and_a_stopped_stand() {
    let _alone = alone();
    let seconds = 4.0;
    let words = |port: &str| {
        ["record", "--port", port, "--out", "log.csv", "--profile", "constant", "--amplitude", "2", "--seconds", "4"].map(str::to_owned)
    };
    /// A recording, and the moment at which its file appeared.
    fn begun(folder: &Path, words: &[String; 11]) -> (Child, Instant) {
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let child = spawn(folder, &words);
        let asked = Instant::now();
        while !folder.join("log.part.csv").exists() {
            assert!(asked.elapsed() < Duration::from_secs(20), "the recording does not begin");
            std::thread::sleep(Duration::from_millis(5));
        }
        (child, Instant::now())
    }
    campaign("record --out log.csv", "kill −9", "drive off by the stand after 2 s", |share| {
        let folder = tempfile::tempdir().unwrap();
        let served = Served::new(folder.path(), &[]);
        let (child, from) = begun(folder.path(), &words(&served.port));
        kill_after(child, share * seconds * 0.9);
        let recorded_s = from.elapsed().as_secs_f64();
        let lost_s = recorded_s - kept_s(folder.path());
        assert!(lost_s < BEHIND_S, "{lost_s} of {recorded_s} s");
        assert!(!folder.path().join("log.csv").exists(), "nothing that looks complete");
        drive_is_off(folder.path(), &served.port, STOPPED_S);
        // The rows are not destroyed by a second attempt.
        let again = words(&served.port);
        let ran = stand(folder.path(), &again.each_ref().map(String::as_str));
        assert!(ran.status == Some(2) && ran.err.contains("log.part.csv: the file exists; --force"), "{ran:?}");
        Outcome { lost_s, message: String::new() }
    });
    campaign("record --out log.csv", "Ctrl-C", "drive off by the recorder", |share| {
        let folder = tempfile::tempdir().unwrap();
        let served = Served::new(folder.path(), &[]);
        let (child, from) = begun(folder.path(), &words(&served.port));
        std::thread::sleep(Duration::from_secs_f64(0.5 + share * (seconds - 1.0)));
        assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
        let recorded_s = from.elapsed().as_secs_f64();
        let ran: RunOutput = child.wait_with_output().unwrap().into();
        let log = Log::read(folder.path().join("log.csv")).unwrap();
        assert!(log.warnings().is_empty() && log.note("ended").is_some(), "{:?}", log.notes());
        drive_is_off(folder.path(), &served.port, 0);
        Outcome { lost_s: (recorded_s - log.duration_s()).max(0.0), message: failed_in_operation(&ran, "interrupted") }
    });
    campaign("record --out log.csv", "port pulled", "(the simulated stand ends with its port)", |share| {
        let folder = tempfile::tempdir().unwrap();
        let served = Served::new(folder.path(), &[]);
        let (child, from) = begun(folder.path(), &words(&served.port));
        std::thread::sleep(Duration::from_secs_f64(0.5 + share * (seconds - 1.0)));
        drop(served);
        let recorded_s = from.elapsed().as_secs_f64();
        let ran: RunOutput = child.wait_with_output().unwrap().into();
        let log = Log::read(folder.path().join("log.csv")).unwrap();
        assert!(log.warnings().is_empty() && log.note("ended").is_some(), "{:?}", log.notes());
        Outcome { lost_s: (recorded_s - log.duration_s()).max(0.0), message: failed_in_operation(&ran, "unplugged") }
    });
    campaign("record --out log.csv", "disk full", "drive off by the recorder", |share| {
        let folder = tempfile::tempdir().unwrap();
        let served = Served::new(folder.path(), &[]);
        // Notes take a kilobyte; four seconds take some 300.
        let words = words(&served.port);
        let ran = on_full_disk(folder.path(), &words.each_ref().map(String::as_str), 4 + (share * 200.0) as usize);
        let message = failed_in_operation(&ran, "log.part.csv: cannot write");
        kept_s(folder.path());
        ends_with_a_whole_row(folder.path());
        assert!(!folder.path().join("log.csv").exists(), "nothing that looks complete");
        drive_is_off(folder.path(), &served.port, 0);
        Outcome { lost_s: 0.0, message }
    });
}

#[test]
fn killed_calibration_resumes() {
    let _alone = alone();
    let main = tempfile::tempdir().unwrap();
    let prepare = |folder: &Path| {
        std::fs::write(folder.join("s.toml"), SHORT).unwrap();
        std::fs::write(folder.join("stand.toml"), carrying("")).unwrap();
    };
    prepare(main.path());
    let words = ["calibrate", "gyro", "--session", "s.toml", "--stand", "stand.toml", "--out", "g"];
    let whole_s = duration_s(main.path(), &words);
    let scale = |folder: &Path| {
        let record: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("g/record.json")).unwrap()).unwrap();
        assert_eq!(record["record"]["whole"], true);
        quantity(&record, "scale")
    };
    let uninterrupted = scale(main.path());
    campaign("calibrate gyro", "kill −9, then --resume", "simulated", |share| {
        let folder = tempfile::tempdir().unwrap();
        prepare(folder.path());
        kill_after(spawn(folder.path(), &words), share * whole_s);
        if !folder.path().join("g/journal.json").exists() {
            stand(folder.path(), &words).succeeded();
        } else if !folder.path().join("g/record.json").exists() {
            stand(folder.path(), &["calibrate", "gyro", "--out", "g", "--resume", "--stand", "stand.toml"]).succeeded();
        }
        assert!((scale(folder.path()) - uninterrupted).abs() < 1e-3);
        Outcome::default()
    });
}

#[test]
fn folder_that_cannot_be_written_is_named_before_the_work() {
    let folder = folder();
    for words in [
        &["sim", "--out", "/sys/log.csv"][..],
        &["sim", "--out", "/sys/log.parquet", "--seconds", "1"],
        &["fit", "log.csv", "--model", "model.toml", "--out", "/sys/fitted.toml"],
        &["model", "new", "/sys/model.toml"],
        &["fit", "log.csv", "--model", "model.toml", "--json", "/sys/a.json"],
    ] {
        let ran = stand(folder.path(), words);
        failed_in_operation(&ran, "/sys/");
    }
}

#[test]
fn nothing_is_overwritten_without_force() {
    let folder = folder();
    let path = folder.path();
    stand(path, &["model", "new", "new.toml"]).succeeded();
    for file in ["s.toml", "drift.csv", "settings.toml", "rec.csv", "rec.parquet", "cut.part.csv"] {
        std::fs::write(path.join(file), "precious").unwrap();
    }
    let elsewhere = tempfile::tempdir().unwrap();
    let served = Served::new(elsewhere.path(), &[]);
    let before = common::files(path);
    for (words, file) in [
        (&["sim", "--out", "log.csv"][..], "log.csv"),
        (&["fit", "log.csv", "--model", "model.toml", "--out", "new.toml"], "new.toml"),
        (&["explain", "log.csv", "--model", "model.toml", "--out", "new.toml"], "new.toml"),
        (&["model", "new", "new.toml"], "new.toml"),
        (&["calibrate", "gyro", "--write-session", "s.toml"], "s.toml"),
        (&["drift", "run", "--out", "drift.csv"], "drift.csv"),
        (&["settings", "export", "--file", "settings.toml", "--port", &served.port], "settings.toml"),
        (&["record", "--port", &served.port, "--out", "rec.csv"], "rec.csv"),
        (&["record", "--port", &served.port, "--out", "rec.parquet"], "rec.parquet"),
        (&["record", "--port", &served.port, "--out", "cut.csv"], "cut.part.csv"),
    ] {
        let ran = stand(path, words);
        assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{words:?}: {ran:?}");
        assert_eq!(ran.err.trim(), format!("stand: {file}: the file exists; --force overwrites it"), "{words:?}");
    }
    assert!(common::files(path) == before, "a file was changed");
    stand(path, &["model", "new", "new.toml", "--force"]).succeeded();
    stand(path, &["record", "--port", &served.port, "--out", "cut.csv", "--seconds", "1", "--force"]).succeeded();
    assert!(Log::read(path.join("cut.csv")).unwrap().warnings().is_empty() && !path.join("cut.part.csv").exists());
}

#[test]
fn parallel_edits_of_a_model_are_all_kept() {
    let folder = folder();
    let children: Vec<Child> = (0..6).map(|_| spawn(folder.path(), &["model", "add", "model.toml", "cogging"])).collect();
    for child in children {
        RunOutput::from(child.wait_with_output().unwrap()).succeeded();
    }
    let model = Model::read(folder.path().join("model.toml")).unwrap();
    assert_eq!(model.effect_names().iter().filter(|name| name.starts_with("cogging")).count(), 6, "{:?}", model.effect_names());
}

#[test]
fn log_without_its_end_is_not_read_as_whole() {
    let folder = folder();
    let text = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    assert!(Log::read(folder.path().join("log.csv")).unwrap().warnings().is_empty());
    let cut = folder.path().join("cut.csv");
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    let rows = |log: &Log| log.len();
    for keep in [lines.len() / 2, lines.len() - 3, lines.len() - 2, lines.len() - 1] {
        std::fs::write(&cut, lines[..keep].concat()).unwrap();
        let log = Log::read(&cut).unwrap();
        assert_eq!(log.warnings(), [LogWarning::EndMissing { rows: rows(&log) }], "{keep} lines");
    }
    // Within a row, as a killed recorder may leave it: the rows before it are kept.
    let half = lines.len() / 2;
    let whole = lines[..half].concat();
    std::fs::write(&cut, &whole).unwrap();
    let kept = rows(&Log::read(&cut).unwrap());
    for bytes in 1..lines[half].len() {
        std::fs::write(&cut, format!("{whole}{}", &lines[half][..bytes])).unwrap();
        let log = Log::read(&cut).unwrap();
        assert_eq!(log.warnings(), [LogWarning::RowCutShort { line: half + 1 }, LogWarning::EndMissing { rows: kept }], "{bytes} bytes");
        assert_eq!(rows(&log), kept);
    }
    let shown = stand(folder.path(), &["compare", "cut.csv", "--model", "model.toml"]);
    assert!(shown.out.contains(&format!("the last row (line {}) is cut short and left out", half + 1)), "{shown:?}");
    // A row that was taken out, and a digit that was changed.
    let whole = lines.len() - lines.iter().filter(|line| line.starts_with('#')).count() - 1;
    let changed = format!("{}1\n", lines[40].trim_end());
    for edited in [[&lines[..40], &[changed.as_str()], &lines[41..]].concat(), [&lines[..40], &lines[41..]].concat()] {
        std::fs::write(&cut, edited.concat()).unwrap();
        let log = Log::read(&cut).unwrap();
        assert_eq!(log.warnings(), [LogWarning::RowsChanged { rows: rows(&log), written: whole.to_string() }]);
    }
    let shown = stand(folder.path(), &["compare", "cut.csv", "--model", "model.toml"]);
    assert!(shown.out.contains("that were written"), "{}", shown.out);
}
