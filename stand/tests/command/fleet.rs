//! `stand explain FOLDER --table` and `stand fleet report`: many logs, killed runs, broken logs.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use common::{MODEL, RunOutput, command, stand};
use stand_analysis::fleet::row::microseconds_of;
use stand_analysis::fleet::session::{FileHash, Session, Settings, journal_of};
use stand_analysis::fleet::{ParameterValue, Row, table};
use tempfile::TempDir;

/// A folder with a model and `logs/`: five different logs, one of them twice, a corrupt and an empty file.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("model.toml"), MODEL).unwrap();
    std::fs::create_dir_all(path.join("logs/second stand")).unwrap();
    for (seed, name) in ["logs/a.csv", "logs/b.parquet", "logs/second stand/c.csv", "logs/d.csv"].into_iter().enumerate() {
        let seed = seed.to_string();
        let mut words = vec!["sim", "--out", name, "--seconds", "2", "--seed", &seed];
        if name == "logs/a.csv" {
            words.extend(["--hidden", "load"]);
        }
        stand(path, &words).succeeded();
    }
    std::fs::copy(path.join("logs/a.csv"), path.join("logs/a again.csv")).unwrap();
    std::fs::write(path.join("logs/corrupt.csv"), "t_s,u_V,omega_rad_s\n0,1,2\n0.001,1,nonsense\n").unwrap();
    std::fs::write(path.join("logs/empty.csv"), "").unwrap();
    folder
}

/// The rows of a table without the computing time.
fn rows(path: &Path) -> Vec<Row> {
    let rows = table::read(&[path.to_owned()]).unwrap();
    rows.into_iter().map(|row| Row { seconds: 0.0, ..row }).collect()
}

/// Answers in the journal of a table.
fn answers(table: &Path) -> usize {
    let journal = std::fs::read(journal_of(table)).unwrap_or_default();
    journal.split_inclusive(|byte| *byte == b'\n').filter(|line| line.starts_with(b"{\"key\"") && line.ends_with(b"\n")).count()
}

fn run(folder: &Path, table: &str, threads: &str) -> RunOutput {
    let words = ["explain", "logs", "--model", "model.toml", "--table", table];
    command(folder, &words).env("RAYON_NUM_THREADS", threads).output().unwrap().into()
}

#[test]
fn table_has_each_log_whatever_breaks() {
    let folder = folder();
    let path = folder.path();
    let first = run(path, "one.parquet", "1");
    assert!(first.status == Some(2) && first.err.contains("2 of 7 logs could not be compared"), "{first:?}");
    assert!(first.out.ends_with("one.parquet: 7 of 7 logs done, 6 of them computed now, 2 without an explanation\n"), "{}", first.out);
    let one = rows(&path.join("one.parquet"));
    let verdicts: Vec<(&str, &str)> = one.iter().map(|row| (row.path.as_str(), row.verdict.as_str())).collect();
    assert_eq!(
        verdicts,
        [
            ("logs/a again.csv", "effect-found"),
            ("logs/a.csv", "effect-found"),
            ("logs/b.parquet", "adequate"),
            ("logs/corrupt.csv", "error"),
            ("logs/d.csv", "adequate"),
            ("logs/empty.csv", "error"),
            ("logs/second stand/c.csv", "adequate"),
        ]
    );
    assert!(one[3].error.as_ref().unwrap().contains("nonsense") && one[5].bytes == Some(0), "{one:?}");
    let load = &one[1];
    assert!(load.effects.len() == 1 && !load.not_distinguishable.is_empty() && load.stand.is_some() && load.began_us.is_some(), "{load:?}");
    let inertia = load.parameters.iter().find(|p| p.name == "inertia_kg_m2").unwrap();
    assert!(
        (inertia.value / 2.5e-4 - 1.0).abs() < 0.02 && inertia.standard_uncertainty.unwrap() > 0.0 && inertia.unit == "kg m²",
        "{inertia:?}"
    );
    assert!(load.outputs.iter().all(|o| o.ratio < 1.2) && load.outputs.iter().any(|o| o.ratio_given > 2.0), "{:?}", load.outputs);

    assert_eq!(run(path, "two.parquet", "2").status, Some(2));
    assert_eq!(rows(&path.join("two.parquet")), one, "two cores");

    // Killed after the first answers, then continued: nothing is computed twice.
    let killed = path.join("killed.parquet");
    let words = ["explain", "logs", "--model", "model.toml", "--table", "killed.parquet"];
    let mut child = command(path, &words).env("RAYON_NUM_THREADS", "1").stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while answers(&killed) < 2 {
        assert!(child.try_wait().unwrap().is_none(), "killed too late");
        std::thread::sleep(Duration::from_millis(2));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = answers(&killed);
    assert!(before < 6 && !killed.exists(), "{before} answers");
    // A power cut may leave half a line.
    let mut journal = std::fs::read(journal_of(&killed)).unwrap();
    journal.extend_from_slice(b"{\"be");
    std::fs::write(journal_of(&killed), journal).unwrap();
    let resumed = run(path, "killed.parquet", "1");
    assert!(resumed.out.contains(&format!("{} of them computed now", 6 - before)), "{resumed:?}");
    assert_eq!((answers(&killed), rows(&killed)), (6, one));
    let again = run(path, "killed.parquet", "1");
    assert!(again.out.contains(" 0 of them computed now"), "{again:?}");
}

#[cfg(unix)]
#[test]
fn interrupted_run_writes_what_it_has_and_continues() {
    let folder = folder();
    let path = folder.path();
    let table = path.join("a.parquet");
    let words = ["explain", "logs", "--model", "model.toml", "--table", "a.parquet"];
    let child = command(path, &words).env("RAYON_NUM_THREADS", "1").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    while answers(&table) < 1 {
        std::thread::sleep(Duration::from_millis(2));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let ended = RunOutput::from(child.wait_with_output().unwrap());
    assert!(ended.status == Some(1) && ended.err.contains("the same command continues"), "{ended:?}");
    let kept = rows(&table).len();
    assert!((1..7).contains(&kept), "{kept}");
    assert_eq!(run(path, "a.parquet", "2").status, Some(2));
    assert_eq!(rows(&table).len(), 7);
}

#[test]
fn stands_are_stated_by_a_table_and_wrong_options_refused() {
    let folder = folder();
    let path = folder.path();
    let at = |name: &str| path.join(name);
    for name in ["a again.csv", "corrupt.csv", "empty.csv", "b.parquet", "second stand/c.csv"] {
        std::fs::remove_file(at("logs").join(name)).unwrap();
    }
    std::fs::write(at("stands.csv"), "path,stand,date,batch\nlogs/a.csv,A,2026-10-01,7\nlogs/d.csv,B,2026-11-01,8\n").unwrap();
    let words = ["explain", "logs", "--model", "model.toml", "--table", "a.parquet", "--stands", "stands.csv"];
    let answer = stand(path, &[&words[..], &["--json", "-"]].concat()).succeeded().json();
    assert_eq!((answer["logs"].as_u64(), answer["failed"].as_u64(), answer["verdicts"]["adequate"].as_u64()), (Some(2), Some(0), Some(1)));
    let found = rows(&at("a.parquet"));
    let identity = |row: &Row| (row.stand.clone().unwrap(), row.batch.clone().unwrap(), row.began_us);
    assert_eq!(identity(&found[0]), ("A".to_owned(), "7".to_owned(), microseconds_of("2026-10-01")));
    std::fs::write(at("stands.csv"), "path,stand\nlogs/other.csv,A\n").unwrap();
    let unmatched = stand(path, &words);
    assert!(unmatched.status == Some(2) && unmatched.err.contains("the first is line 2"), "{unmatched:?}");
    for (words, expected) in [
        (&["explain", "logs/a.csv", "--model", "model.toml", "--table", "a.parquet"][..], "name a folder"),
        (&["explain", "logs", "--model", "model.toml", "--table", "a.csv"][..], "must end in .parquet"),
        (&["fleet", "report", "logs/a.csv"][..], "cannot be read as Parquet"),
        (&["fleet", "report", "a.parquet", "--since", "lately"][..], "--since lately"),
    ] {
        let refused = stand(path, words);
        assert!(refused.status == Some(2) && refused.err.contains(expected), "{words:?}: {refused:?}");
    }
}

#[test]
fn log_that_ends_the_program_is_skipped() {
    let folder = folder();
    let path = folder.path();
    let table = path.join("a.parquet");
    let model = identification::model::Model::read(path.join("model.toml")).unwrap();
    let settings = Settings {
        model_name: "model.toml".to_owned(),
        model: model.to_toml(),
        effort_limit_passes: Some(400_000),
        build: stand_firmware::VERSION.to_owned(),
        time_limit_s: Some(60.0),
    };
    let hash = FileHash::of(&path.join("logs/d.csv")).unwrap();
    for _ in 0..3 {
        Session::open(&table, settings.clone()).unwrap().begin(&hash.sha256).unwrap();
    }
    run(path, "a.parquet", "2");
    let row = rows(&table).into_iter().find(|row| row.path == "logs/d.csv").unwrap();
    assert!(row.error.unwrap().contains("ended 3 times"));
}

/// A table of 12 stands in two batches: stand 3 has another inertia since October and cogging, the stands of batch B have a load, stand 9
/// an outlying friction.
fn fleet_table(folder: &Path) -> PathBuf {
    let mut rows = Vec::new();
    for stand in 0..12_i32 {
        for (month, is_since) in [("09", false), ("10", true)] {
            for day in 1..=4_i32 {
                let wobble = f64::from((7 * stand + 3 * day + i32::from(is_since)) % 5 - 2);
                let mut effects = Vec::new();
                effects.extend((stand == 3 && is_since).then(|| "cogging".to_owned()));
                effects.extend((stand >= 6).then(|| "load".to_owned()));
                let value = |name: &str, value: f64, u: f64, unit: &str| ParameterValue {
                    name: name.to_owned(),
                    value,
                    standard_uncertainty: Some(u),
                    unit: unit.to_owned(),
                };
                rows.push(Row {
                    path: format!("logs/stand {stand} {month} {day}.parquet"),
                    stand: Some(format!("RS-{stand}")),
                    batch: Some(if stand < 6 { "A" } else { "B" }.to_owned()),
                    began_us: microseconds_of(&format!("2026-{month}-0{day}")),
                    verdict: if effects.is_empty() { "adequate" } else { "effect-found" }.to_owned(),
                    effects,
                    parameters: vec![
                        value("inertia_kg_m2", 2.5e-4 + 1e-7 * wobble + if stand == 3 && is_since { 5e-6 } else { 0.0 }, 1e-7, "kg m²"),
                        value(
                            "coulomb_N_m",
                            8.6e-4 + 1e-6 * f64::from(stand % 4) + 2e-7 * wobble + if stand == 9 { 1e-4 } else { 0.0 },
                            2e-7,
                            "N m",
                        ),
                    ],
                    ..Row::default()
                });
            }
        }
    }
    rows.push(Row::failed("logs/broken.csv", None, "logs/broken.csv: the file is empty".to_owned()));
    let path = folder.join("answers.parquet");
    table::write(&path, &rows).unwrap();
    path
}

#[test]
fn report_names_changes_batches_and_outliers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fleet_table(path);
    let words = ["fleet", "report", "answers.parquet", "--since", "2026-10-01", "--html", "fleet.html", "--json", "fleet.json"];
    let text = stand(path, &words).succeeded().out;
    assert!(text.contains("1 stand changed since 2026-10-01") && text.contains("RS-3: inertia_kg_m2"), "{text}");
    let answer: serde_json::Value = serde_json::from_slice(&std::fs::read(path.join("fleet.json")).unwrap()).unwrap();
    let significant = |key: &str, name: &str| -> Vec<String> {
        let all = answer[key].as_array().unwrap().iter();
        all.filter(|entry| entry["significant"] == true).map(|entry| entry[name].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(significant("parameter_changes", "stand"), ["RS-3"]);
    assert_eq!(significant("batch_effects", "effect"), ["load"]);
    // Four logs without and four with cogging: 1 of 70, too few beside the other stands.
    assert_eq!(answer["finding_changes"][0]["finding"], "cogging");
    assert!(significant("finding_changes", "stand").is_empty());
    let outliers: Vec<&str> = (answer["parameters"].as_array().unwrap().iter().flat_map(|p| p["stands"].as_array().unwrap()))
        .filter(|stand| stand["significant"] == true)
        .map(|stand| stand["stand"].as_str().unwrap())
        .collect();
    assert!(outliers.contains(&"RS-9"), "{outliers:?}");
    assert_eq!(answer["failed"][0]["path"], "logs/broken.csv");
    let page = std::fs::read_to_string(path.join("fleet.html")).unwrap();
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() }).unwrap();

    // Half of the month has no change to show, and one log of a stand none that could be tested.
    let none = stand(path, &["fleet", "report", "answers.parquet", "--since", "2026-12-01"]).succeeded().out;
    assert!(none.contains("No stand has a usable log both before and since the date"), "{none}");
}
