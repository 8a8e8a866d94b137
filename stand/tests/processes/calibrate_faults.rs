//! Faults during a calibration: the recorded rows are complete, the journal has the reason, and the session resumes at the step.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use calibration::{SHORT, carrying, fault, quantity};
use common::served::{Served, send_lines};
use common::{MODEL, RunOutput, command, stand};
use identification::log::Log;
use serde_json::Value;
use tempfile::TempDir;

/// A folder with a session, a fault-free stand, and a stand with this fault.
fn folder(session: &str, breaks: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("s.toml", session), ("healthy.toml", &carrying("")), ("faulty.toml", &carrying(breaks))] {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

/// The short session with a third step that is long enough to be interrupted.
fn long() -> String {
    SHORT.to_owned()
        + "[[steps]]\nname = \"three\"\nmode = \"rate\"\nprofile = \"staircase\"\namplitude = 2.0\nlevels = 2\ndwell_s = 2.0\nseconds = 20.0\n"
}

fn journal(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("g/journal.json")).unwrap()).unwrap()
}

/// Number of rows of an interrupted step's log.
#[track_caller]
fn rows(folder: &Path, file: &str) -> usize {
    let log = Log::read(folder.join("g").join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
    assert!(log.column("gyro_rad_s").is_some());
    log.len()
}

/// Resumes on the fault-free stand; the complete result equals that of an uninterrupted session.
#[track_caller]
fn resumed(folder: &Path, words: &[&str], done: usize, message: &str) {
    let whole: Vec<Vec<u8>> =
        (1..=done).map(|n| std::fs::read(folder.join(format!("g/0{n}-{}.parquet", ["one", "two", "three"][n - 1]))).unwrap()).collect();
    let ran = stand(folder, &[&["calibrate", "gyro", "--out", "g", "--resume"], words].concat()).succeeded();
    assert!(ran.out.contains("3 of 3 steps") && ran.out.contains(message), "{message}: {}", ran.out);
    for (n, before) in whole.iter().enumerate() {
        let now = std::fs::read(folder.join(format!("g/0{}-{}.parquet", n + 1, ["one", "two", "three"][n]))).unwrap();
        assert!(&now == before, "a step that was done stays as it is");
    }
    let record: Value = serde_json::from_slice(&std::fs::read(folder.join("g/record.json")).unwrap()).unwrap();
    assert_eq!(record["record"]["whole"], true);
    assert!(record["record"]["interruptions"].to_string().contains(message), "{}", record["record"]["interruptions"]);
    assert!((quantity(&record, "scale") - 1.0).abs() < 1e-3);
    // Backticks are markup in the report.
    let page = std::fs::read_to_string(folder.join("g/record.html")).unwrap().replace("<code>", "`").replace("</code>", "`");
    assert!(page.contains(message), "{message}");
    assert!(stand(folder, &["records", "show", "g"]).succeeded().out.contains("same results"));
}

#[test]
fn faults_leave_complete_rows_and_the_session_resumes_at_the_step() {
    // The third step runs from about 20 s to 40 s after power-on.
    let cases = [
        ("line-off", "", "step `three`: the stand sends no rows"),
        ("sensor-silent", "", "step `three`: the stand switched off"),
        ("winding-hot", "", "step `three`: the stand switched off"),
        ("encoder-a-off", "", "step `three`: the stand switched off"),
        ("power-cut", "for_s = 0.5", "step `three`: the stand has restarted"),
    ];
    for (what, more, message) in cases {
        let folder = folder(&long(), &fault(what, 30.0, more));
        let path = folder.path();
        let ran = stand(path, &["calibrate", "gyro", "--session", "s.toml", "--stand", "faulty.toml", "--out", "g"]);
        assert_eq!((ran.status, ran.out.as_str()), (Some(1), ""), "{what}: {ran:?}");
        assert!(ran.err.lines().count() == 1 && ran.err.contains(message) && ran.err.contains("--resume"), "{what}: {}", ran.err);
        let recorded = journal(path);
        assert_eq!(
            (recorded["steps"].as_array().unwrap().len(), recorded["interruptions"].as_array().unwrap().len()),
            (2, 1),
            "{what}: {recorded}"
        );
        assert!(recorded["interruptions"][0].as_str().unwrap().contains(message), "{what}: {recorded}");
        let there = rows(path, "03-three.parquet.csv");
        assert!((2000..19_000).contains(&there), "{what}: {there}");
        assert!(!path.join("g/record.json").exists(), "an incomplete session has no record");
        // The recorded steps can be computed; the result is marked as incomplete.
        let part = stand(path, &["calibrate", "gyro", "--from", "g"]).succeeded().out;
        assert!(part.contains("2 of 3 steps") && part.contains(message), "{part}");
        resumed(path, &["--stand", "healthy.toml"], 2, message);
        assert_eq!(rows(path, "03-three.attempt-1.csv"), there, "the attempt is kept");
    }
}

#[test]
fn short_loss_of_rows_is_reported_and_does_not_end_the_session() {
    let folder = folder(&long(), &fault("line-off", 30.0, "for_s = 1.0"));
    let path = folder.path();
    let ran = stand(path, &["calibrate", "gyro", "--session", "s.toml", "--stand", "faulty.toml", "--out", "g"]).succeeded();
    let lost = journal(path)["steps"][2]["lost_rows"].as_u64().unwrap();
    assert!((900..1200).contains(&lost), "{lost}");
    assert!(ran.out.contains(&format!("Step `three`: {lost} rows were lost on the serial line")), "{}", ran.out);
}

#[test]
fn full_disk_leaves_complete_rows() {
    let folder = folder(&long(), "");
    let path = folder.path();
    // File size limit of 1000 blocks (of 512 or 1024 bytes): the journal fits, the third step's rows do not.
    let words = format!(
        "trap '' XFSZ; ulimit -f 1000; exec {} calibrate gyro --session s.toml --stand healthy.toml --out g",
        env!("CARGO_BIN_EXE_stand")
    );
    let ran: RunOutput = Command::new("sh").args(["-c", &words]).current_dir(path).stdin(Stdio::null()).output().unwrap().into();
    assert_eq!((ran.status, ran.out.as_str()), (Some(1), ""), "{ran:?}");
    assert!(ran.err.contains("03-three.parquet: cannot write") && ran.err.contains("--resume"), "{}", ran.err);
    let text = std::fs::read_to_string(path.join("g/03-three.parquet.csv")).unwrap();
    assert!(text.ends_with('\n') && text.len() > 400_000, "{}", text.len());
    let there = rows(path, "03-three.parquet.csv");
    assert!(there > 3000, "{there}");
    resumed(path, &["--stand", "healthy.toml"], 2, "cannot write");
    assert_eq!(rows(path, "03-three.attempt-1.csv"), there);
}

/// A session over a port, in its step `n`, with rows on disk.
fn running(folder: &Path, port: &str, file: &str) -> Child {
    let words = ["calibrate", "gyro", "--session", "s.toml", "--port", port, "--out", "g"];
    let mut child = command(folder, &words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let begun = Instant::now();
    while std::fs::metadata(folder.join("g").join(file)).map_or(0, |m| m.len()) < 50_000 {
        assert!(begun.elapsed() < Duration::from_secs(90) && child.try_wait().unwrap().is_none(), "the step {file} does not begin");
        std::thread::sleep(Duration::from_millis(20));
    }
    child
}

#[test]
fn killed_program_resumes_at_the_step_over_a_real_line() {
    let folder = folder(&long().replace("seconds = 20.0", "seconds = 6.0"), "");
    let path = folder.path();
    let served = Served::new(path, &["--stand", "healthy.toml"]);
    let mut child = running(path, &served.port, "02-two.parquet.csv");
    child.kill().unwrap();
    child.wait().unwrap();
    let recorded = journal(path);
    assert_eq!((recorded["steps"].as_array().unwrap().len(), &recorded["under_way"]), (1, &"two".into()), "{recorded}");
    assert!(recorded["interruptions"].as_array().unwrap().is_empty(), "nobody was left to write it");
    let there = rows(path, "02-two.parquet.csv");
    assert!(there > 500, "{there}");
    // Without a host, the stand has switched its drive off.
    std::thread::sleep(Duration::from_secs(6));
    let words = ["calibrate", "gyro", "--out", "g", "--resume", "--port", &served.port];
    let ran = stand(path, &words);
    assert!(ran.status == Some(2) && ran.err.contains("host silent") && ran.err.contains("FAULt:CLEar"), "{ran:?}");
    send_lines(path, &served.port, "FAULt:CLEar\n").succeeded();
    resumed(path, &["--port", &served.port], 1, "step `two`: the program ended without an entry");
    assert_eq!(rows(path, "02-two.attempt-1.csv"), there);
}

#[test]
fn unplugged_line_and_ctrl_c_are_reported() {
    let folder = folder(&long(), "");
    let path = folder.path();
    let served = Served::new(path, &["--stand", "healthy.toml"]);
    let child = running(path, &served.port, "01-one.parquet.csv");
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let ran: RunOutput = child.wait_with_output().unwrap().into();
    assert!(ran.status == Some(1) && ran.err.contains("interrupted by the user") && ran.err.contains("--resume"), "{ran:?}");
    assert_eq!(send_lines(path, &served.port, "STReam?;OUTPut?;PROFile:STATe?\n").succeeded().out.trim(), "0;0;STOPPED");
    std::fs::rename(path.join("g"), path.join("first")).unwrap();
    let child = running(path, &served.port, "01-one.parquet.csv");
    drop(served);
    let ran: RunOutput = child.wait_with_output().unwrap().into();
    assert!(ran.status == Some(1) && ran.err.contains("unplugged") && ran.err.contains("--resume"), "{ran:?}");
    assert!(journal(path)["interruptions"][0].as_str().unwrap().contains("step `one`: ") && rows(path, "01-one.parquet.csv") > 100);
    resumed(path, &["--stand", "healthy.toml"], 0, "unplugged");
}

#[test]
fn stand_behind_a_port_keeps_a_drives_result() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let session = "what = \"drive\"\nserial = \"D-1\"\n[[steps]]\nname = \"steps\"\nmode = \"voltage\"\nprofile = \"multi-step\"\namplitude = 0.8\n\
        dwell_s = 0.4\nseconds = 8.0\n";
    std::fs::write(path.join("s.toml"), session).unwrap();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    let served = Served::new(path, &["--flash", "flash.bin", "--speed", "4"]);
    let words = ["calibrate", "drive", "--session", "s.toml", "--port", &served.port, "--out", "d", "--into-stand", "--json", "d.json"];
    let text = stand(path, &words).succeeded().out;
    assert!(text.contains("saved in the stand: resistance_ohm "), "{text}");
    let answer: Value = serde_json::from_slice(&std::fs::read(path.join("d.json")).unwrap()).unwrap();
    served.signal("TERM");
    let mut served = served;
    assert!(served.child.wait().unwrap().success());
    // After a power cycle the result is still stored.
    let again = Served::new(path, &["--flash", "flash.bin", "--speed", "4"]);
    for name in ["resistance_ohm", "motor_constant_N_m_A", "inertia_kg_m2"] {
        let reply = send_lines(path, &again.port, &format!("SETTings:{name}?\n")).succeeded().out;
        let value: f64 = reply.split([' ', ',', '\n']).next().unwrap().parse().unwrap();
        assert!((value / quantity(&answer, name) - 1.0).abs() < 1e-5, "{name}: {reply} {}", answer[name]);
    }
}
