//! `stand calibrate` and `stand records` refuse invalid input with status 2 and one line that names the file, step or parameter. They write
//! nothing.
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::calibration;
use std::path::Path;

use calibration::{SHORT, carrying};
use common::{files, stand};

/// The command fails with status 2 and one line that contains all `messages`; the folder is unchanged.
#[track_caller]
fn refused(folder: &Path, words: &[&str], messages: &[&str]) {
    let before = files(folder);
    let ran = stand(folder, words);
    assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{words:?}: {ran:?}");
    assert_eq!(ran.err.trim_end().lines().count(), 1, "{}", ran.err);
    messages.iter().for_each(|word| assert!(ran.err.contains(word), "{word}: {}", ran.err));
    assert!(before == files(folder), "{words:?}: a refused command must not change the folder");
}

/// A session file with `from` replaced by `to` is refused.
#[track_caller]
fn bad_session(from: &str, to: &str, messages: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let text = SHORT.replacen(from, to, 1);
    assert_ne!(text, SHORT, "{from}");
    std::fs::write(folder.path().join("s.toml"), text).unwrap();
    refused(folder.path(), &["calibrate", "gyro", "--session", "s.toml", "--out", "g"], &[&["s.toml"], messages].concat());
}

#[test]
fn invalid_session_is_refused_with_file_step_and_parameter() {
    bad_session("staircase", "stairs", &["step 1 `one`", "profile", "stairs"]);
    bad_session("levels", "level", &["step 1 `one`", "level", "did you mean levels?"]);
    bad_session("levels = 1", "turns = 1", &["step 1 `one`", "turns", "not a parameter of the profile staircase"]);
    bad_session("serial", "seriel", &["seriel"]);
    bad_session("seconds = 3.0", "seconds = -3.0", &["step 1 `one`", "seconds"]);
    bad_session("seconds = 3.0", "seconds = \"3\"", &["seconds"]);
    bad_session("name = \"two\"", "name = \"one\"", &["step 2 `one`", "another step has this name"]);
    bad_session("mode = \"rate\"", "mode = \"fast\"", &["fast"]);
    bad_session("what = \"gyro\"", "what = \"drive\"", &["what = \"drive\"", "expected \"gyro\""]);
    bad_session("[[steps]]", "[[steps", &["s.toml"]);
    bad_session("settle_s = 0.2", "settle_s = -1.0", &["settle_s"]);
    bad_session("settle_s = 0.2", "known = { crystal_ppm = -1.0 }", &["crystal_ppm"]);
    let folder = tempfile::tempdir().unwrap();
    refused(folder.path(), &["calibrate", "gyro", "--session", "nowhere.toml"], &["nowhere.toml"]);
}

#[test]
fn limits_of_the_stand_are_checked_before_it_moves() {
    let bad = |from: &str, to: &str, messages: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("s.toml"), SHORT.replacen(from, to, 1)).unwrap();
        refused(folder.path(), &["calibrate", "gyro", "--session", "s.toml", "--out", "g"], messages);
    };
    bad("amplitude = 4.0", "amplitude = 50.0", &["step 2 `two`", "95 % of the overspeed limit"]);
    bad("settle_s = 0.2", "limits = { rate_rad_s = 3.0 }", &["step 2 `two`", "the session's limit of 3 rad/s"]);
    let sine = "profile = \"sine\"\nfrequency_Hz = 60.0";
    bad(
        "profile = \"staircase\"\namplitude = 2.0\nlevels = 1\ndwell_s = 0.6",
        &format!("{sine}\namplitude = 2.0"),
        &["step 1 `one`", "754 rad/s²", "use mode = \"voltage\""],
    );
    // A stand with a low overspeed limit.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), SHORT).unwrap();
    std::fs::write(folder.path().join("weak.toml"), carrying("").replace("[imu]", "[firmware]\noverspeed_rad_s = 3.0\n[imu]")).unwrap();
    refused(
        folder.path(),
        &["calibrate", "gyro", "--session", "s.toml", "--stand", "weak.toml", "--out", "g"],
        &["step 2 `two`", "overspeed"],
    );
}

#[test]
fn invalid_session_folders_and_records_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("s.toml"), SHORT).unwrap();
    let words = ["calibrate", "gyro", "--session", "s.toml", "--out", "g"];
    stand(path, &words).succeeded();
    refused(path, &words, &["g", "the folder has a session already", "--resume"]);
    refused(path, &["calibrate", "gyro", "--out", "g", "--resume", "--seed", "9"], &["begun on the stand", "SIM-1", "SIM-9"]);
    refused(path, &["calibrate", "accel", "--from", "g"], &["g", "for gyro, not for accel"]);
    refused(path, &["calibrate", "accel", "--out", "g", "--resume"], &["g", "for gyro, not for accel"]);
    for words in [&["calibrate", "gyro", "--from", "."][..], &["calibrate", "gyro", "--out", ".", "--resume"]] {
        refused(path, words, &["journal.json", "the folder has no session"]);
    }
    refused(path, &["records", "show", "."], &["record.json", "cannot be read"]);
    refused(path, &["records", "show", "s.toml"], &["s.toml", "not a record of a calibration"]);
    refused(path, &["records", "list", "nowhere"], &["nowhere", "cannot be read"]);
    refused(path, &["records", "trend", ".", "--serial", "S-9"], &["no record of serial S-9", "S-1"]);
    refused(path, &["records", "trend", ".", "--serial", "S-1", "--quantity", "scael"], &["scael", "bias_rad_s, ", "scale"]);
    // A raw log with one changed byte.
    let log = path.join("g/01-one.parquet");
    let mut bytes = std::fs::read(&log).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&log, &bytes).unwrap();
    refused(path, &["calibrate", "gyro", "--from", "g"], &["01-one.parquet", "the log has changed since it was recorded", "SHA-256"]);
    refused(path, &["calibrate", "gyro", "--out", "g", "--resume"], &["01-one.parquet", "SHA-256"]);
    std::fs::remove_file(&log).unwrap();
    refused(path, &["calibrate", "gyro", "--from", "g"], &["01-one.parquet"]);
    std::fs::write(path.join("g/journal.json"), "{").unwrap();
    refused(path, &["calibrate", "gyro", "--from", "g"], &["journal.json"]);
}

#[test]
fn conflicting_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("s.toml"), SHORT).unwrap();
    for words in [
        &["calibrate", "moon"][..],
        &["calibrate", "gyro", "--resume"],
        &["calibrate", "gyro", "--into-stand"],
        &["calibrate", "gyro", "--out", "g", "--resume", "--session", "s.toml"],
        &["calibrate", "gyro", "--port", "nowhere", "--stand", "s.toml"],
        &["calibrate", "gyro", "--port", "nowhere"],
        &["calibrate", "gyro", "--into-model", "nowhere.toml", "--out", "g"],
        &["calibrate", "gyro", "--out", "g", "--html", "nowhere/x.html"],
        &["calibrate", "gyro", "--out", "g", "--json", "."],
        &["records"],
        &["records", "trend", "."],
    ] {
        refused(path, words, &[]);
    }
}
