//! One check for each word of `calibrate`.

use std::path::Path;

use super::calibration::{SHORT, carrying};
use super::common::served::{Served, send_lines};
use super::{Check, help_everywhere, json, page, stand};
use identification::log::{Column, Log};
use serde_json::Value;
use stand_acquire::calibration_session::journal::sha256;

pub const WORDS: [(&str, Check); 14] = [
    ("calibrate --help", help_everywhere),
    ("calibrate <WHAT> --write-session", |f| {
        let sessions = ["gyro", "accel", "drive"].map(|what| {
            stand(f, &["calibrate", what, "--write-session", "usual.toml", "--force"]).succeeded();
            std::fs::read_to_string(f.join("usual.toml")).unwrap()
        });
        assert!(
            sessions[0].contains("what = \"gyro\"") && sessions[1].contains("what = \"accel\"") && sessions[2].contains("what = \"drive\"")
        );
    }),
    ("calibrate --session --out", |f| {
        let (one, other) = (run(f, "a", SHORT, &[]), run(f, "b", &SHORT.replace("amplitude = 4.0", "amplitude = 5.0"), &[]));
        assert!(f.join("a/record.json").exists() && f.join("b/01-one.parquet").exists());
        assert_ne!(one["scale"], other["scale"]);
    }),
    ("calibrate --serial --operator", |f| {
        let record = |name: &str, more: &[&str]| run(f, name, SHORT, more)["record"].clone();
        let (plain, named) = (record("a", &[]), record("b", &["--serial", "X-9", "--operator", "Ada"]));
        assert_eq!((&plain["serial"], &plain["operator"]), (&"S-1".into(), &"".into()));
        assert_eq!((&named["serial"], &named["operator"]), (&"X-9".into(), &"Ada".into()));
    }),
    ("calibrate --stand", |f| {
        let measured = |bias: &str| {
            std::fs::write(f.join("stand.toml"), carrying(&format!("gyro_bias_rad_s = {bias}\n"))).unwrap();
            run(f, bias, SHORT, &["--stand", "stand.toml"])["bias_rad_s"]["value"].as_f64().unwrap()
        };
        assert!((measured("0.02") - measured("0.01") - 0.01).abs() < 1e-3);
    }),
    ("calibrate --seed", |f| {
        let [one, again, other] =
            [("a", "1"), ("b", "1"), ("c", "2")].map(|(name, seed)| run(f, name, SHORT, &["--seed", seed])["scale"].clone());
        assert!(one == again && one != other);
    }),
    ("calibrate --resume", |f| {
        let before = run(f, "a", SHORT, &[]);
        // As if the second step were not yet done.
        let mut journal: Value = serde_json::from_slice(&std::fs::read(f.join("a/journal.json")).unwrap()).unwrap();
        journal["steps"].as_array_mut().unwrap().pop();
        std::fs::write(f.join("a/journal.json"), journal.to_string()).unwrap();
        std::fs::remove_file(f.join("a/02-two.parquet")).unwrap();
        let after = json(f, &["calibrate", "gyro", "--out", "a", "--resume"]);
        assert!(f.join("a/02-two.parquet").exists());
        assert_eq!(before["record"]["steps"][0], after["record"]["steps"][0]);
    }),
    ("calibrate --from", |f| {
        let answer = run(f, "a", SHORT, &[]);
        assert_eq!(json(f, &["calibrate", "gyro", "--from", "a"])["scale"], answer["scale"]);
    }),
    ("calibrate --map --unit --sample-rate --note", |f| {
        let answer = run(f, "a", SHORT, &[]);
        let journal = f.join("a/journal.json");
        let mut steps: Value = serde_json::from_slice(&std::fs::read(&journal).unwrap()).unwrap();
        // The raw logs as another program writes them: degrees per second, other names, no time.
        for step in steps["steps"].as_array_mut().unwrap() {
            let path = f.join("a").join(step["log"].as_str().unwrap());
            let log = Log::read_all(&path).unwrap();
            let columns = log.columns().iter().filter(|c| c.name != "t_s").map(|c| match c.name.as_str() {
                "gyro_rad_s" => Column { name: "dut".to_owned(), values: c.values.iter().map(|v| v.to_degrees()).collect() },
                _ => c.clone(),
            });
            let rows = Column { name: "t_s".to_owned(), values: (0..log.len()).map(|k| k as f64).collect() };
            let foreign = Log::new("foreign.parquet", std::iter::once(rows).chain(columns).collect(), log.notes().clone()).unwrap();
            let name = step["log"].as_str().unwrap().replace(".parquet", "-foreign.parquet");
            foreign.write(f.join("a").join(&name)).unwrap();
            step["sha256"] = sha256(&f.join("a").join(&name)).unwrap().into();
            step["log"] = name.into();
        }
        std::fs::write(&journal, steps.to_string()).unwrap();
        let stated =
            ["--map", "t_s=-", "--sample-rate", "1000", "--map", "dut=gyro_rad_s", "--unit", "dut=deg/s", "--note", "operator=Ada"];
        let again = json(f, &[&["calibrate", "gyro", "--from", "a"], &stated[..]].concat());
        let value = |answer: &Value| answer["scale"]["value"].as_f64().unwrap();
        assert!((value(&again) / value(&answer) - 1.0).abs() < 1e-9, "{again} {answer}");
        assert_eq!(json(f, &["calibrate", "gyro", "--from", "a"])["scale"], again["scale"], "the options are remembered");
        let refused = stand(f, &["calibrate", "gyro", "--out", "b", "--unit", "dut=deg/s"]);
        assert!(refused.status == Some(2) && refused.err.contains("--from"), "{}", refused.err);
    }),
    #[cfg(unix)]
    ("calibrate --port --into-stand", |f| {
        let one = Served::new(f, &["--speed", "4"]);
        std::fs::write(f.join("own.toml"), format!("column = \"omega_rad_s\"\n{SHORT}")).unwrap();
        let scale = || send_lines(f, &one.port, "SETTings:rate_rad_s_per_code?\n").succeeded().out;
        let before = scale();
        let words = ["calibrate", "gyro", "--session", "own.toml", "--port", &one.port, "--out"];
        stand(f, &[&words[..], &["a"]].concat()).succeeded();
        assert_eq!(scale(), before);
        stand(f, &[&words[..], &["b", "--into-stand"]].concat()).succeeded();
        assert_ne!(scale(), before);
    }),
    ("calibrate --into-model", |f| {
        std::fs::write(f.join("own.toml"), format!("column = \"omega_rad_s\"\n{SHORT}")).unwrap();
        let before = std::fs::read(f.join("model.toml")).unwrap();
        stand(f, &["calibrate", "gyro", "--session", "own.toml", "--out", "a"]).succeeded();
        assert_eq!(before, std::fs::read(f.join("model.toml")).unwrap());
        stand(f, &["calibrate", "gyro", "--from", "a", "--into-model", "model.toml"]).succeeded();
        assert!(std::fs::read_to_string(f.join("model.toml")).unwrap().contains("rate_scale"));
    }),
    ("calibrate --json", |f| {
        run(f, "a", SHORT, &[]);
        let printed = json(f, &["calibrate", "gyro", "--from", "a"]);
        stand(f, &["calibrate", "gyro", "--from", "a", "--json", "a.json"]).succeeded();
        let written: Value = serde_json::from_slice(&std::fs::read(f.join("a.json")).unwrap()).unwrap();
        assert_eq!(printed["scale"], written["scale"]);
    }),
    ("calibrate --html --plots", |f| {
        run(f, "a", SHORT, &[]);
        page(f, &["calibrate", "gyro", "--from", "a"]);
    }),
    ("calibrate", |f| assert!(stand(f, &["calibrate"]).err.contains("<WHAT>"))),
];

/// Runs this session with additional options `more` into the folder `out`; returns its JSON output.
pub fn run(folder: &Path, out: &str, session: &str, more: &[&str]) -> Value {
    std::fs::write(folder.join("short.toml"), session).unwrap();
    json(folder, &[&["calibrate", "gyro", "--session", "short.toml", "--out", out], more].concat())
}
