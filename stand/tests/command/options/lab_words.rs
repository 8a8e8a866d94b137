//! One check for each word of `lab`.

use std::path::Path;
use std::sync::OnceLock;

use tempfile::TempDir;

use super::common::copy_folder;
use super::{Check, help_everywhere, json, json_in_both_places, stand, stdout_of};

/// A practice work of Anna's in `folder/name`. Its measurements are simulated for seconds: it is started once, and copied.
fn practice(folder: &Path, name: &str) {
    static WORK: OnceLock<TempDir> = OnceLock::new();
    let work = WORK.get_or_init(|| {
        let folder = super::folder();
        started(folder.path(), "w", &[]);
        folder
    });
    std::fs::create_dir(folder.join(name)).unwrap();
    copy_folder(&work.path().join("w"), &folder.join(name));
}

/// Starts the accelerometer's work, whose logs are the shortest, in `folder/name`.
fn started(folder: &Path, name: &str, words: &[&str]) -> serde_json::Value {
    let given = if words.contains(&"--student") { vec![] } else { vec!["--student", "anna"] };
    stand(folder, &[&["lab", "start", "accelerometer", "--out", name, "--json", "-"], &given[..], words].concat()).succeeded().json()
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join(name)).unwrap()
}

fn log(folder: &Path, work: &str) -> Vec<u8> {
    std::fs::read(folder.join(work).join("logs/01-outer.parquet")).unwrap()
}

pub const WORDS: [(&str, Check); 28] = [
    ("lab", |f| assert_eq!(stand(f, &["lab"]).status, Some(2))),
    ("lab --help", help_everywhere),
    ("lab list --help", help_everywhere),
    ("lab list", |f| assert!(stdout_of(f, &["lab", "list"]).contains("accelerometer"))),
    ("lab list --language", |f| assert!(stdout_of(f, &["lab", "list", "--language", "uk"]).contains("Полювання"))),
    ("lab list --json", |f| json_in_both_places(f, &["lab", "list"])),
    ("lab key --help", help_everywhere),
    ("lab key <FILE> --json", |f| {
        assert_eq!(json(f, &["lab", "key", "a.key"])["key"], "a.key");
        stand(f, &["lab", "key", "b.key"]).succeeded();
        assert_ne!(read(f, "a.key"), read(f, "b.key"));
        assert_eq!(stand(f, &["lab", "key", "a.key"]).status, Some(2), "a key is never overwritten");
    }),
    ("lab start --help", help_everywhere),
    ("lab start <LAB> --out --json", |f| {
        assert_eq!(stand(f, &["lab", "start", "acelerometer", "--student", "anna", "--out", "w"]).status, Some(2));
        assert_eq!(started(f, "w", &[])["lab"], "accelerometer");
        assert!(read(f, "w/answers.toml").contains("[quantities.scale]"));
    }),
    ("lab start --student --attempt", |f| {
        practice(f, "a");
        started(f, "b", &["--student", "borys"]);
        started(f, "c", &["--attempt", "2"]);
        started(f, "again", &[]);
        assert_eq!(log(f, "a"), log(f, "again"), "one attempt, one log, bit for bit");
        assert!(log(f, "a") != log(f, "b") && log(f, "a") != log(f, "c") && log(f, "b") != log(f, "c"));
    }),
    ("lab start --key", |f| {
        stand(f, &["lab", "key", "teacher.key"]).succeeded();
        assert_eq!(started(f, "sealed", &["--key", "teacher.key"])["sealed"], true);
        practice(f, "practice");
        assert_ne!(log(f, "sealed"), log(f, "practice"));
    }),
    // A recording takes minutes: tests/processes/lab_real_stand.rs. Here what is checked before the port is opened, and a port that is
    // none.
    ("lab start --port --reference --model", |f| {
        stand(f, &["lab", "key", "teacher.key"]).succeeded();
        let hunt = |present: &str| {
            let log = |name: &str, class: &str| format!("[hunt.{name}]\npresent = [\"{class}\"]\ndescription = \"d\"\n");
            let text = [log("A", present), log("B", "load"), log("C", "none"), log("D", "none")].concat();
            std::fs::write(f.join("r.toml"), format!("source = \"the teacher\"\n{text}")).unwrap();
        };
        let refused = |words: &[&str]| {
            let ran = stand(f, &[&["lab", "start", "hunt", "--student", "anna", "--key", "teacher.key", "--out", "w"], words].concat());
            assert!(ran.status == Some(2) && ran.err.lines().count() == 1, "{words:?}: {ran:?}");
            ran.err
        };
        hunt("load");
        assert!(refused(&["--port", "none"]).contains("--reference"), "a real stand needs a reference");
        assert!(refused(&["--reference", "r.toml"]).contains("--port"));
        let real = ["--port", "none", "--reference", "r.toml"];
        assert!(refused(&real).contains("--model"), "a hunt needs the model of the real drive");
        assert!(refused(&[&real[..], &["--model", "model.toml"]].concat()).contains("none"), "no such port");
        hunt("viscous");
        assert!(refused(&[&real[..], &["--model", "model.toml"]].concat()).contains("part of the model"));
    }),
    ("lab start --language", |f| {
        started(f, "w", &["--language", "uk"]);
        assert!(read(f, "w/instructions.md").contains("Порядок роботи"));
    }),
    ("lab check --help", help_everywhere),
    ("lab check <FOLDER> --json", |f| {
        practice(f, "w");
        let empty = json(f, &["lab", "check", "w"]);
        assert_eq!((empty["complete"].as_bool(), empty["before_complete"].as_bool()), (Some(false), Some(false)));
        assert_eq!(read(f, "w/lab-journal.jsonl").lines().count(), 2);
        let text = stdout_of(f, &["lab", "check", "w", "--json", "c.json"]);
        assert!(text.contains("not filled in") && read(f, "c.json").contains("\"kind\": \"empty\""), "{text}");
        assert!(text.contains("NOT complete"), "{text}");
        started(f, "uk", &["--language", "uk"]);
        assert!(stdout_of(f, &["lab", "check", "uk"]).contains("не заповнено"));
    }),
    ("lab report --help", help_everywhere),
    ("lab report <FOLDER> --html --zip --json", |f| {
        practice(f, "w");
        let report = json(f, &["lab", "report", "w", "--html", "r.html", "--zip", "w.zip"]);
        assert_eq!(report["student"], "anna");
        assert!(read(f, "r.html").contains("not filled in") && !read(f, "r.html").contains("true value of"));
        assert!(std::fs::read(f.join("w.zip")).unwrap().starts_with(b"PK"));
        std::fs::write(f.join("w/fit.py"), "print()").unwrap();
        assert!(stdout_of(f, &["lab", "report", "w", "--zip", "w.zip"]).contains("fit.py"));
        assert_eq!(stand(f, &["lab", "report", "w"]).status, Some(2), "a report needs a form");
    }),
    ("lab grade --help", help_everywhere),
    ("lab grade <FOLDER> --html --json", |f| {
        practice(f, "w");
        let grade = json(f, &["lab", "grade", "w", "--html", "g.html"]);
        assert_eq!(grade["criteria_met"], false, "nothing is answered");
        assert!(read(f, "g.html").contains("Objections"));
        assert_eq!(grade["quantities"][0]["mark"], "not-filled-in");
        assert!(stdout_of(f, &["lab", "grade", "w"]).contains("--attempt 2"));
        started(f, "uk", &["--language", "uk"]);
        assert!(stdout_of(f, &["lab", "grade", "uk", "--html", "u.html"]).contains("Числові критерії не виконано"));
        assert!(read(f, "u.html").contains("Зауваження"));
    }),
    ("lab grade --key", |f| {
        stand(f, &["lab", "key", "teacher.key"]).succeeded();
        stand(f, &["lab", "key", "other.key"]).succeeded();
        started(f, "w", &["--key", "teacher.key"]);
        assert_eq!(stand(f, &["lab", "grade", "w"]).status, Some(2), "a sealed work needs its key");
        let other_logs = |key: &str| {
            let says = json(f, &["lab", "grade", "w", "--key", key])["says"].to_string();
            says.contains("not the log of this student")
        };
        assert!(!other_logs("teacher.key") && other_logs("other.key"));
    }),
    ("lab grade --reference", |f| {
        practice(f, "w");
        std::fs::write(f.join("r.toml"), "source = \"the teacher\"\n").unwrap();
        let ran = stand(f, &["lab", "grade", "w", "--reference", "r.toml"]);
        assert!(ran.status == Some(2) && ran.err.contains("simulated stand"), "{ran:?}");
    }),
    ("lab grade --code", |f| {
        practice(f, "w");
        let code = json(f, &["lab", "check", "w"])["code"].as_str().unwrap()[..16].to_owned();
        let says = |code: &str| json(f, &["lab", "grade", "w", "--code", code])["says"].to_string();
        assert!(!says(&code).contains("noted code") && says("0123456789abcdef").contains("noted code"));
    }),
    ("lab start", |f| drop(started(f, "w", &[]))),
    ("lab check", |f| assert_eq!(stand(f, &["lab", "check", "."]).status, Some(2))),
    ("lab report", |f| assert_eq!(stand(f, &["lab", "report", "."]).status, Some(2))),
    ("lab grade", |f| assert_eq!(stand(f, &["lab", "grade", "."]).status, Some(2))),
    ("lab key", |f| assert_eq!(stand(f, &["lab", "key"]).status, Some(2))),
];
