//! Compensation and the other measurements of the panel: each job runs, can be cancelled, and leaves files that the command line reads.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::panel;
use std::time::{Duration, Instant};

use common::served::Served;
use common::{folder, stand};
use identification::deadline::Deadline;
use identification::log::Log;
use panel::{Page, Panel, STOP, TAKE};
use serde_json::{Value, json};
use stand_analysis::allan::{AllanError, Request, Taus};
use stand_analysis::calibrate::CalibrateError;
use stand_analysis::drift::DriftError;
use stand_analysis::drift::compute::{DriftSettings, measurement};
use stand_records::record::{RecordError, compute_until};

fn take(page: &mut Page) {
    page.say(TAKE);
    page.until(|page| page.state["driver"] == page.state["client"], true);
}

/// Answer of a job that has succeeded.
fn answer(panel: &Panel, page: &mut Page, path: &str, body: &Value) -> Value {
    let started = panel.post(path, body);
    panel.request("GET", &format!("answer?name={}", page.answer_of(&started)), "").1
}

/// A panel on a stand with cogging, whose model has it, fitted to a log.
fn fitted(panel: &Panel, page: &mut Page) -> String {
    take(page);
    let request = json!({"client": page.client(), "profile": "multi-step", "mode": "rate", "amplitude": 15.0, "seconds": 10.0, "seed": 1, "find_index": true});
    let log = page.answer_of(&panel.post("record", &request));
    panel.post("model", &json!({"name": "model.toml", "add": "cogging"}));
    // The order of the hidden effect, as `explain` finds it; amplitude and phase are fitted.
    panel.post("model", &json!({"name": "model.toml", "set": {"cogging_order": 8.0}}));
    answer(panel, page, "compare", &json!({"log": log, "model": "model.toml", "fit": true}));
    log
}

fn in_force(panel: &Panel, page: &Page) -> Value {
    page.command(panel, "COMPensation:LIST?")["replies"].clone()
}

#[test]
fn learnt_cogging_is_compensated_and_the_ripple_falls() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &["--hidden", "cogging"]);
    let mut page = panel.page();
    let log = fitted(&panel, &mut page);
    let (mut viewer, request) = (panel.page(), json!({"model": "model.toml", "log": log}));
    viewer.read();
    let of = |client: u64| {
        let mut request = request.clone();
        request["client"] = client.into();
        request
    };
    let (status, refused) = panel.request("POST", "compensate", &of(viewer.client()).to_string());
    assert!(status == 422 && refused["error"].as_str().unwrap().contains("drives"), "{status} {refused}");
    let before = in_force(&panel, &page);
    let client = page.client();

    // A stop while the platform turns: the drive is off, a fault is latched, the previous compensation is in force.
    let started = panel.post("compensate", &of(client));
    page.until(|page| page.state["drive"]["is_on"] == true, true);
    page.say(STOP);
    page.until(Page::is_off_with_fault, true);
    let job = page.finish(&started);
    assert!(job["error"].as_str().unwrap().contains("previous compensation is in force"), "{job}");
    take(&mut page);
    page.command(&panel, "FAULt:CLEar");
    assert_eq!(in_force(&panel, &page), before);

    // Cancelled: the same without a fault.
    let started = panel.post("compensate", &of(client));
    page.until(|page| page.state["drive"]["is_on"] == true, true);
    panel.post("cancel", &json!({}));
    let job = page.finish(&started);
    assert!(job["error"].as_str().unwrap().contains("the compensation was not changed"), "{job}");
    page.until(|page| page.state["drive"]["is_on"] == false && page.state["drive"]["fault"] == "", true);

    let compensated = answer(&panel, &mut page, "compensate", &of(client));
    let orders = compensated["ripple"]["orders"].as_array().unwrap();
    let total = |key: &str| orders.iter().map(|order| order[key].as_f64().unwrap().powi(2)).sum::<f64>().sqrt();
    assert!(total("before_rad_s") > 3.0 * total("after_rad_s"), "{}", compensated["ripple"]);
    let order = orders[0]["order"].as_u64().unwrap() as usize;
    assert_eq!(compensated["spectrum"]["before_rad_s"][order - 1], orders[0]["before_rad_s"]);
    assert_ne!(in_force(&panel, &page), before);
    let commands = std::fs::read_to_string(folder.path().join("panel/commands.txt")).unwrap();
    assert!(commands.contains(&format!("--model model.toml --log {log}")) && commands.contains("stand compensate --port"), "{commands}");
}

#[test]
fn stop_after_the_change_restores_the_previous_compensation() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &["--hidden", "cogging"]);
    let mut page = panel.page();
    let log = fitted(&panel, &mut page);
    let before = in_force(&panel, &page);
    let started = panel.post("compensate", &json!({"client": page.client(), "model": "model.toml", "log": log}));
    // The second run is the one with the new compensation.
    for is_on in [true, false, true] {
        page.until(|page| page.state["drive"]["is_on"] == is_on, true);
    }
    page.until(|page| in_force(&panel, page) != before, true);
    page.say(STOP);
    let job = page.finish(&started);
    assert!(job["error"].as_str().unwrap().contains("previous compensation is in force"), "{job}");
    assert_eq!(in_force(&panel, &page), before);
}

#[test]
fn allan_deviation_of_a_still_log_is_that_of_the_command() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &[]);
    let mut page = panel.page();
    take(&mut page);
    let request = json!({"client": page.client(), "profile": "constant", "mode": "voltage", "amplitude": 0.0, "seconds": 5.0});
    let log = page.answer_of(&panel.post("record", &request));
    let columns = panel.request("GET", &format!("columns?name={log}"), "").1;
    assert!(columns["columns"].as_array().unwrap().contains(&json!("supply_V")), "{columns}");
    let found = answer(&panel, &mut page, "allan", &json!({"log": log, "column": "supply_V"}));
    let session = folder.path().join("panel");
    let same = stand(&session, &["allan", &log, "--column", "supply_V", "--json", "-"]).succeeded().json();
    assert_eq!((&found["oadev"], &found["coefficients"]), (&same["oadev"], &same["coefficients"]));
    let request = Request {
        log: session.join(&log),
        column: "supply_V".to_owned(),
        from_s: None,
        to_s: None,
        taus: Taus::Octave,
        interpretation: None,
    };
    let ended = request.analyse(request.read().unwrap(), Deadline::after_s(Some(0.0))).err().unwrap();
    assert!(matches!(ended, AllanError::Interrupted), "{ended}");
    let reasons = found["coefficients"].as_object().unwrap().values().filter(|c| c["value"].is_null());
    assert!(reasons.clone().count() > 0 && reasons.clone().all(|c| c["reason"]["kind"].is_string()), "{}", found["coefficients"]);
    let pictures = panel.request("GET", "pictures?name=allan-1.html", "").1;
    assert!(pictures["plots"][0]["svg"].as_str().unwrap().starts_with("<svg"), "{pictures}");
    let commands = std::fs::read_to_string(session.join("commands.txt")).unwrap();
    assert!(commands.contains(&format!("stand allan {log} --column supply_V")), "{commands}");
    let (status, refused) = panel.request("POST", "allan", &json!({"log": log, "column": "absent\u{1b}"}).to_string());
    assert_eq!(status, 200, "{refused}");
    assert!(page.finish(&refused)["error"].as_str().unwrap().lines().count() == 1);
}

#[test]
fn simulated_drift_session_measures_the_drift_and_its_log_gives_it_again() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &[]);
    let mut page = panel.page();
    let request = json!({"client": page.client(), "place": "simulated", "cycles": 8, "pulse_s": 5.0, "rest_s": 4.0, "rates_deg_s": [0.05, 0.02], "positions_deg": [0.0, 180.0], "latitude_deg": null, "seed": 1});
    let started = panel.post("drift", &request);
    page.until(|page| page.state["job"]["stage"]["kind"] == "visit", false);
    panel.post("cancel", &json!({}));
    let job = page.finish(&started);
    assert_eq!((&job["error"], &job["is_cancelled"]), (&"".into(), &true.into()));
    let found = answer(&panel, &mut page, "drift", &request);
    let own = &found["quantities"][0];
    // The simulated gyroscope drifts by 1.5 °/h.
    let (value, expanded) = (own["value"].as_f64().unwrap(), own["U"].as_f64().unwrap());
    assert!((value - 1.5).abs() < 2.0 * expanded && expanded < 0.1, "{own}");
    let session = folder.path().join("panel");
    let again = stand(&session, &["drift", "compute", "drift-1.parquet", "--json", "-"]).succeeded().json();
    let computed = again["quantities"][0]["value"].as_f64().unwrap();
    assert!((computed - value).abs() < expanded, "{value} {computed}");
    let log = Log::read_all(session.join("drift-1.parquet")).unwrap();
    let measured = measurement(&[log], &DriftSettings::default()).unwrap();
    assert_eq!(measured.clone().evaluate_until(Deadline::after_s(Some(0.0))).err(), Some(DriftError::Interrupted));
    assert!(measured.evaluate_until(Deadline::NEVER).is_ok());
    assert!(found["notes"].as_array().unwrap().iter().any(|note| note["kind"] == "taken-as-exact"), "{}", found["notes"]);
    for (key, wrong) in [
        ("cycles", json!(0)),
        ("pulse_s", json!(-1)),
        ("rates_deg_s", json!([])),
        ("positions_deg", json!([1e9])),
        ("place", json!("stand")),
    ] {
        let mut request = request.clone();
        request[key] = wrong;
        let (status, refused) = panel.request("POST", "drift", &request.to_string());
        assert!(status == 422 && refused["error"].as_str().unwrap().lines().count() == 1, "{key} {status} {refused}");
    }
}

#[test]
fn simulated_calibration_session_writes_the_record_of_the_command() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &[]);
    let mut page = panel.page();
    let request = json!({"client": page.client(), "place": "simulated", "kind": "drive", "serial": "A'1", "operator": "", "seed": 3});
    let steps = panel.request("GET", "steps?kind=drive", "").1;
    assert!(steps["steps"].as_array().unwrap().len() >= 5, "{steps}");
    let started = panel.post("calibrate", &request);
    page.until(|page| page.state["job"]["stage"]["number"].as_u64() >= Some(2), false);
    panel.post("cancel", &json!({}));
    let begun = Instant::now();
    let job = page.finish(&started);
    assert!(job["error"].as_str().unwrap().contains("--out calibrate-1 --resume") && begun.elapsed() < Duration::from_secs(10), "{job}");
    let found = answer(&panel, &mut page, "calibrate", &request);
    assert_eq!(found["folder"], "calibrate-2");
    let session = folder.path().join("panel");
    let again = stand(&session, &["calibrate", "drive", "--from", "calibrate-2", "--json", "-"]).succeeded().json();
    assert_eq!(found["inertia_kg_m2"]["value"], again["inertia_kg_m2"]["value"]);
    let commands = std::fs::read_to_string(session.join("commands.txt")).unwrap();
    assert!(commands.contains(r"--serial 'A'\''1'"), "{commands}");
    assert!(found["absent"].as_array().unwrap().iter().all(|absent| absent["reason"]["kind"].is_string()) && found["remarks"].is_array());
    let passed = Deadline::after_s(Some(0.0));
    let ended = compute_until(&session.join("calibrate-2"), passed).err().unwrap();
    assert!(matches!(ended, RecordError::Calibrate(CalibrateError::Interrupted)), "{ended}");
    // The interrupted one is listed, and goes on with the device of its seed.
    let listed = panel.request("GET", "session", "").1["interrupted"].clone();
    assert_eq!((listed.as_array().unwrap().len(), &listed[0]["name"], &listed[0]["simulated_seed"]), (1, &"calibrate-1".into(), &3.into()));
    let wrong = stand(&session, &["calibrate", "drive", "--out", "calibrate-1", "--resume", "--seed", "4"]);
    assert!(wrong.status == Some(2) && wrong.err.contains("SIM-3") && wrong.err.contains("SIM-4"), "{}", wrong.err);
    let resume = json!({"client": page.client(), "name": "calibrate-1"});
    let resumed = answer(&panel, &mut page, "resume", &resume);
    assert_eq!((&resumed["folder"], &resumed["record"]["whole"]), (&"calibrate-1".into(), &true.into()));
    assert_eq!(resumed["record"]["steps"].as_array().unwrap().len(), steps["steps"].as_array().unwrap().len());
    assert_eq!(resumed["record"]["serial"], "A'1");
    assert_eq!(panel.request("GET", "session", "").1["interrupted"], json!([]));
    let commands = std::fs::read_to_string(session.join("commands.txt")).unwrap();
    assert!(commands.contains("stand calibrate drive --out calibrate-1 --resume --seed 3 "), "{commands}");
    for name in ["calibrate-1", "calibrate-9", "../panel", ""] {
        let (status, refused) = panel.request("POST", "resume", &json!({"client": page.client(), "name": name}).to_string());
        assert!(status == 422 && refused["error"].as_str().unwrap().contains("no interrupted"), "{name} {status} {refused}");
    }
}

#[test]
fn cancel_acts_during_the_search_of_the_index() {
    let folder = folder();
    let panel = Panel::alone(folder.path(), &[]);
    let mut page = panel.page();
    take(&mut page);
    let started = panel.post("calibrate", &json!({"client": page.client(), "place": "stand", "kind": "drive"}));
    // The first motion of a session is the search.
    page.until(|page| page.state["drive"]["is_on"] == true, true);
    panel.post("cancel", &json!({}));
    let begun = Instant::now();
    let job = page.finish(&started);
    assert!(job["is_cancelled"] == true && job["error"].as_str().unwrap().contains("interrupted by the user"), "{job}");
    assert!(begun.elapsed() < Duration::from_secs(5), "{:?}", begun.elapsed());
    page.until(|page| page.state["drive"]["is_on"] == false, true);
    assert_eq!(page.state["drive"]["fault"], "", "a cancelled session is no stop");
    let files: Vec<_> = std::fs::read_dir(folder.path().join("panel/calibrate-1")).unwrap().map(|file| file.unwrap().file_name()).collect();
    assert!(files.iter().all(|name| !name.to_string_lossy().contains("parquet")), "nothing was recorded: {files:?}");
}

#[test]
fn session_at_the_stand_waits_for_the_person_and_uses_the_gyroscope_of_the_stand() {
    let folder = folder();
    let served = Served::new(folder.path(), &["--gyro"]);
    let panel = Panel::alone(folder.path(), &["--port", &served.port]);
    let mut page = panel.page();
    take(&mut page);
    let request = json!({"client": page.client(), "place": "stand", "cycles": 4, "pulse_s": 0.5, "rest_s": 0.2, "rates_deg_s": [0.05], "positions_deg": [0.0, 180.0], "latitude_deg": 50.0});
    let started = panel.post("drift", &request);
    let mut asked = 0;
    while page.state["job"]["number"] != started["job"] || page.state["job"]["is_running"] == true {
        if let Some(asks) = page.state["job"]["asks"].get(0) {
            assert!(
                asks["kind"] == "turn-gyroscope" && asks["turned_deg"].as_f64().is_some_and(|deg| deg == 0.0 || (deg - 180.0).abs() < 1e-9),
                "{asks}"
            );
            asked += 1;
            panel.post("reply", &json!({"text": "done"}));
            page.until(|page| page.state["job"]["asks"] == json!([]), true);
        }
        page.say(panel::BEAT);
        page.read();
    }
    // A B B A A B B A: from 0° to 180° and back, twice.
    assert_eq!((&page.state["job"]["error"], asked), (&"".into(), 4), "{}", page.state["job"]);
    assert!(folder.path().join("panel/drift-1.parquet").is_file());
}
