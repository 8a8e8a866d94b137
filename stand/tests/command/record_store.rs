//! The record store: what was acknowledged is kept, whatever happens to the program that adds.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use calibration::{SHORT, carrying};
use common::stand;
use serde_json::Value;

/// Sessions `s1` … of different seeds in this folder.
fn sessions(folder: &Path, count: usize) {
    std::fs::write(folder.join("s.toml"), SHORT).unwrap();
    std::fs::write(folder.join("stand.toml"), carrying("gyro_bias_rad_s = 0.01\n")).unwrap();
    stand(folder, &["calibrate", "gyro", "--session", "s.toml", "--stand", "stand.toml", "--out", "s1"]).succeeded();
    for k in 2..=count {
        // Another session with the same raw logs: only its record differs.
        let (from, to) = (folder.join("s1"), folder.join(format!("s{k}")));
        std::fs::create_dir(&to).unwrap();
        for entry in std::fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
        let record = to.join("record.json");
        let mut json: Value = serde_json::from_slice(&std::fs::read(&record).unwrap()).unwrap();
        json["record"]["began"] = format!("2026-03-{k:02}T12:00:00+00:00").into();
        std::fs::write(&record, json.to_string()).unwrap();
    }
}

fn begun(folder: &Path, words: &[&str]) -> std::process::Child {
    Command::new(env!("CARGO_BIN_EXE_stand")).current_dir(folder).args(words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

fn listed(folder: &Path) -> usize {
    stand(folder, &["records", "list", "store", "--json", "-"]).succeeded().json()["records"].as_array().unwrap().len()
}

#[test]
fn store_lists_shows_trends_evaluates_and_exports() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    sessions(path, 3);
    let added = stand(path, &["records", "add", "store", "s1", "s2", "s3"]).succeeded().out;
    assert!(added.contains("s3: session 3 of store"), "{added}");
    let none = stand(path, &["records", "add", "store", "none"]);
    assert!(none.status == Some(2) && none.err.starts_with("stand: none: not the folder of a calibration session"), "{none:?}");
    // The same session again keeps its number.
    assert!(stand(path, &["records", "add", "store", "s2"]).succeeded().out.contains("session 2"));
    assert_eq!(listed(path), 3);
    let shown = stand(path, &["records", "show", "store", "--session", "1"]).succeeded().out;
    assert!(shown.contains("computed again from these logs: same results"), "{shown}");
    let trend = stand(path, &["records", "trend", "store", "--serial", "S-1", "--quantity", "scale"]).succeeded().out;
    assert!(trend.contains("3 records"), "{trend}");
    let csv = path.join("all.csv");
    stand(path, &["records", "export", "store", "--out", "all.csv"]).succeeded();
    let text = std::fs::read_to_string(csv).unwrap();
    assert!(text.starts_with("session,kind,serial,began,quantity,value,u,dof,k,U,unit,temperature_C\n"), "{text}");
    assert_eq!(text.lines().filter(|line| line.contains(",scale,")).count(), 3, "{text}");
    let value = stand(path, &["records", "evaluate", "store", "--session", "1", "--rate", "-4,0,4", "--json", "-"]).succeeded().json();
    let of = |k: usize, name: &str| value[k][name].as_f64().unwrap();
    assert!((of(2, "value") - of(0, "value") - 8.0).abs() < 0.5 && of(1, "U") > 0.0, "{value}");
    let refused = stand(path, &["records", "evaluate", "s1", "--rate", "500"]);
    assert!(refused.status == Some(2) && refused.err.contains("beyond the calibrated range"), "{refused:?}");
    // One copy of each raw log.
    let logs = std::fs::read_dir(path.join("store/logs")).unwrap().count();
    let recorded =
        std::fs::read_dir(path.join("s1")).unwrap().filter(|e| e.as_ref().unwrap().path().extension().is_some_and(|e| e == "parquet"));
    assert_eq!(logs, recorded.count());
}

#[test]
fn sessions_that_are_added_at_the_same_time_are_all_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    sessions(path, 6);
    let children: Vec<_> = (1..=6).map(|k| begun(path, &["records", "add", "store", &format!("s{k}")])).collect();
    for child in children {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{output:?}");
    }
    assert_eq!(listed(path), 6);
}

#[test]
fn killed_programs_lose_nothing_that_was_acknowledged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    sessions(path, 8);
    stand(path, &["records", "add", "store", "s1"]).succeeded();
    let mut acknowledged = 1;
    for (k, delay_ms) in [(2, 0), (3, 3), (4, 8), (5, 15), (6, 30), (7, 60), (8, 400)] {
        let mut child = begun(path, &["records", "add", "store", &format!("s{k}")]);
        std::thread::sleep(Duration::from_millis(delay_ms));
        // SIGKILL.
        let _ = child.kill();
        let output = child.wait_with_output().unwrap();
        acknowledged += usize::from(String::from_utf8_lossy(&output.stdout).contains("session"));
        let count = listed(path);
        assert!(count >= acknowledged, "{count} sessions, {acknowledged} acknowledged");
    }
    // The store goes on.
    stand(path, &["records", "add", "store", "s2", "s3", "s4", "s5", "s6", "s7", "s8"]).succeeded();
    assert_eq!(listed(path), 8);
}

#[test]
fn full_disk_leaves_the_store_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    sessions(path, 2);
    stand(path, &["records", "add", "store", "s1"]).succeeded();
    for blocks in [0, 1, 8, 40] {
        let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec {} records add store s2", env!("CARGO_BIN_EXE_stand"));
        let output = Command::new("sh").current_dir(path).args(["-c", &script]).output().unwrap();
        let acknowledged = String::from_utf8_lossy(&output.stdout).contains("session 2");
        assert_eq!(acknowledged, output.status.success(), "{output:?}");
        assert_eq!(listed(path), if acknowledged { 2 } else { 1 }, "{output:?}");
    }
    stand(path, &["records", "add", "store", "s2"]).succeeded();
    assert_eq!(listed(path), 2);
}
