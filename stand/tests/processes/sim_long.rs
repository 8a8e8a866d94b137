//! Logs of `stand sim` that are longer than a block of its memory.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{command, folder, stand};
use identification::log::Log;
use std::process::{Command, Stdio};
use std::time::Duration;

/// Rows in memory at once.
const BLOCK_ROWS: usize = 1 << 17;

#[test]
fn log_of_several_blocks_has_all_rows_and_notes_in_both_formats() {
    let folder = folder();
    let path = folder.path();
    let words =
        |out: &'static str| ["sim", "--out", out, "--seconds", "140", "--profile", "multi-step", "--mode", "voltage", "--amplitude", "0.7"];
    let out = stand(path, &words("long.csv")).succeeded().out;
    assert!(out.starts_with("long.csv: 140000 rows, 140 s at 1000 Hz"), "{out}");
    stand(path, &words("long.parquet")).succeeded();
    let [csv, parquet] = ["long.csv", "long.parquet"].map(|name| Log::read_all(path.join(name)).unwrap());
    assert!(csv.warnings().is_empty(), "{:?}", csv.warnings());
    let without_date = |log: &Log| -> Vec<_> { log.notes().iter().filter(|(key, _)| key != "date").cloned().collect() };
    assert_eq!((without_date(&csv), csv.columns()), (without_date(&parquet), parquet.columns()));
    assert_eq!(csv.len(), 140_000);
    // The first block alone is the short log of the same seed.
    let words: Vec<&str> = words("short.csv").into_iter().map(|word| if word == "140" { "130" } else { word }).collect();
    stand(path, &words).succeeded();
    let short = Log::read_all(path.join("short.csv")).unwrap();
    assert!(short.len() < BLOCK_ROWS && csv.len() > BLOCK_ROWS);
    for column in short.columns() {
        assert_eq!(csv.column(&column.name).unwrap()[..short.len()], column.values[..], "{}", column.name);
    }
    let dt = csv.t_s().windows(2).map(|pair| pair[1] - pair[0]);
    assert!(dt.clone().all(|dt| (dt - 1e-3).abs() < 1e-6), "no gap between blocks");
}

#[test]
fn interrupted_simulation_leaves_its_rows_and_says_so() {
    let folder = folder();
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    let before = files();
    let words = ["sim", "--out", "a.csv", "--seconds", "900000"];
    let mut child = command(folder.path(), &words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(2500));
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(1));
    let ended = child.wait_with_output().unwrap();
    let err = String::from_utf8(ended.stderr).unwrap();
    assert!(err.contains("ended by hand, at") && err.contains("the rows until then are in a.csv"), "{err}");
    let log = Log::read(folder.path().join("a.csv")).unwrap();
    assert!(log.warnings().is_empty() && log.len() > 100 && log.note("ended").unwrap().starts_with("by hand, at "), "{:?}", log.notes());
    assert_eq!(files(), before + 1, "no temporary file remains");
}
