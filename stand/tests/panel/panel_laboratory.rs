//! A laboratory work in the panel: its instructions, its answers as a form, check, report, and the rules of the course for `explain`.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::panel;
use std::path::Path;

use common::stand;
use panel::{Panel, TAKE};
use serde_json::{Value, json};
use stand_lab::answers::{ANSWERS_FILE, Answers};
use stand_lab::journal::{Event, Journal};
use tempfile::TempDir;

/// A folder with a practice work in `out`, in Ukrainian.
fn started(lab: &str, out: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    stand(folder.path(), &["lab", "start", lab, "--student", "Олена", "--language", "uk", "--out", out]).succeeded();
    folder
}

fn journal(work: &Path) -> Journal {
    Journal::read(work).unwrap().unwrap()
}

fn get(panel: &Panel, path: &str) -> Value {
    let (status, answer) = panel.request("GET", path, "");
    assert_eq!(status, 200, "{path}: {answer}");
    answer
}

#[test]
fn answers_are_loaded_saved_checked_and_reported_as_by_the_command_line() {
    let folder = started("accelerometer", "panel");
    let work = folder.path().join("panel");
    let panel = Panel::new(folder.path(), &[]);
    assert_eq!(get(&panel, "works"), json!({"works": ["."]}));
    let shown = get(&panel, "work?name=.");
    assert!(shown["instructions"].as_str().unwrap().contains("<h3>Порядок роботи</h3>"), "{shown}");
    assert_eq!((shown["student"].as_str(), shown["language"].as_str(), &shown["model"]), (Some("Олена"), Some("uk"), &Value::Null));
    let log = shown["logs"][0].as_str().unwrap();
    assert!(log.starts_with("logs/") && get(&panel, &format!("columns?name={log}"))["columns"][0] == "t_s", "{log}");
    let models = get(&panel, "session")["models"].clone();
    assert_eq!(models.as_array().unwrap().iter().map(|model| model["name"].as_str().unwrap()).collect::<Vec<_>>(), ["model.toml"]);

    let mut form = get(&panel, "lab-answers?name=.");
    let before = std::fs::read_to_string(work.join(ANSWERS_FILE)).unwrap();
    let quantity = shown["quantities"][0]["name"].as_str().unwrap();
    assert_eq!(form["answers"]["quantities"][quantity]["unit"], shown["quantities"][0]["unit"]);
    let words = |form: &Value| json!({"name": ".", "sha256": form["sha256"], "answers": form["answers"]});
    form["answers"]["quantities"][quantity]["value"] = "1.o2".into();
    let (status, refused) = panel.request("POST", "lab-answers", &words(&form).to_string());
    assert!(status == 422 && refused["error"].as_str().unwrap().contains(&format!("quantities.{quantity}.value: `1.o2`")), "{refused}");
    assert_eq!(std::fs::read_to_string(work.join(ANSWERS_FILE)).unwrap(), before);
    form["answers"]["quantities"][quantity]["value"] = "1,0200".into();
    form["answers"]["conclusion"] = "Масштаб 1,02.".into();
    form["sha256"] = panel.post("lab-answers", &words(&form))["sha256"].clone();
    let text = std::fs::read_to_string(work.join(ANSWERS_FILE)).unwrap();
    assert!(text.contains("value = 1.0200\n") && text.contains("# Після вимірювань."), "{text}");
    assert_eq!(Answers::parse(&text).unwrap().conclusion, "Масштаб 1,02.");

    // By hand, beside the page.
    std::fs::write(work.join(ANSWERS_FILE), text.replace("1.0200", "1.03")).unwrap();
    let (status, refused) = panel.request("POST", "lab-answers", &words(&form).to_string());
    assert!(status == 409 && refused["error"].as_str().unwrap().contains("answers.toml: the file was changed"), "{refused}");
    let loaded = get(&panel, "lab-answers?name=.");
    assert_eq!(loaded["answers"]["quantities"][quantity]["value"], "1.03");

    let checked = panel.post("lab-check", &json!({"name": ".", "language": "uk"}));
    let recorded = journal(&work);
    assert_eq!((checked["complete"].as_bool(), checked["code"].as_str()), (Some(false), Some(recorded.code())));
    assert_eq!(recorded.entries[1].event, Event::Checked { before_complete: false, complete: false });
    assert_eq!(recorded.entries[1].files[ANSWERS_FILE], loaded["sha256"]);
    let text = checked["text"].as_str().unwrap();
    let printed = stand(&work, &["lab", "check", "."]).succeeded().out;
    // The last line has the code of the entry, of which each check has its own.
    let (shown, printed) = (text.trim().rsplit_once('\n').unwrap(), printed.trim().rsplit_once('\n').unwrap());
    assert!(shown.1.ends_with(&recorded.code()[..16]) && shown.0 == printed.0, "{text}");

    let report = panel.text("lab-report?name=.");
    stand(&work, &["lab", "report", ".", "--html", "by-command.html"]).succeeded();
    let by_command = std::fs::read_to_string(work.join("by-command.html")).unwrap();
    assert!(report.contains("Масштаб 1,02.") && report == by_command);
    let commands = std::fs::read_to_string(work.join("commands.txt")).unwrap();
    assert!(commands.contains("stand lab check .\n"), "{commands}");
}

#[test]
fn explain_on_a_log_of_a_hunt_is_refused_before_the_own_answers_and_recorded_after() {
    let folder = started("hunt", "panel/olena");
    let work = folder.path().join("panel/olena");
    let panel = Panel::new(folder.path(), &[]);
    assert_eq!(get(&panel, "works"), json!({"works": ["olena"]}));
    let shown = get(&panel, "work?name=olena");
    assert_eq!((shown["logs"][0].as_str(), shown["model"].as_str()), (Some("olena/logs/A.parquet"), Some("olena/model.toml")));
    let classes = shown["hunt"]["classes"].as_array().unwrap();
    let class = |name: &str| classes.iter().find(|class| class["class"] == name).map(|class| class["effects"].clone());
    assert_eq!((class("none"), class("late-rate"), class("viscous")), (Some(json!([])), Some(json!(["sensor-lag", "time-skew"])), None));
    let files = get(&panel, "session");
    let names = |key: &str| files[key].as_array().unwrap().iter().map(|file| file["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>();
    assert_eq!((names("logs").len(), names("models")), (4, vec!["olena/model.toml".to_owned(), "model.toml".to_owned()]));

    let explain = json!({"log": "olena/logs/A.parquet", "model": "olena/model.toml"});
    let (status, refused) = panel.request("POST", "explain", &explain.to_string());
    assert!(status == 422 && refused["error"].as_str().unwrap().contains("work `hunt`"), "{refused}");
    assert_eq!(journal(&work).entries.len(), 1);
    // The same log by a link in the session.
    std::os::unix::fs::symlink("olena/logs/A.parquet", folder.path().join("panel/A.parquet")).unwrap();
    let by_link = json!({"log": "A.parquet", "model": "model.toml"});
    assert_eq!(panel.request("POST", "explain", &by_link.to_string()).0, 422);
    assert!(!std::fs::read_to_string(folder.path().join("panel/commands.txt")).unwrap().contains("stand explain"));

    let mut form = get(&panel, "lab-answers?name=olena");
    let entries = form["answers"].as_object_mut().unwrap();
    for question in shown["questions"].as_array().unwrap().iter().filter(|question| question["when"] == "before") {
        entries["questions"][question["id"].as_str().unwrap()] = "відповідь".into();
    }
    for given in entries["hunt"].as_object_mut().unwrap().values_mut() {
        given["reason"] = "немає структури".into();
        given["before"] = json!({"none": "0,4", "load": "0.6", "cogging": ""});
    }
    panel.post("lab-answers", &json!({"name": "olena", "sha256": form["sha256"], "answers": form["answers"]}));
    let checked = panel.post("lab-check", &json!({"name": "olena", "language": "en"}));
    assert!(checked["before_complete"] == true && checked["text"].as_str().unwrap().contains("`stand explain` may be run"), "{checked}");
    let text = std::fs::read_to_string(work.join(ANSWERS_FILE)).unwrap();
    assert!(text.contains("before = { load = 0.6, none = 0.4 }\n"), "{text}");

    let mut page = panel.page();
    let number = panel.post("explain", &explain)["job"].clone();
    assert_eq!(journal(&work).entries[2].event, Event::Explained { log: "A.parquet".to_owned() });
    panel.post("cancel", &json!({}));
    page.say(TAKE);
    page.until(|page| page.state["job"]["number"] == number && page.state["job"]["is_running"] == false, true);
    assert_eq!(page.state["job"]["is_cancelled"], true, "{}", page.state);
}
