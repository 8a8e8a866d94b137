//! The panel without a browser: the three dead-man switches, the stop, one driver, recordings, the loop of identification.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use crate::common::panel;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use common::served::{Served, send_lines};
use common::{command, folder, stand};
use identification::log::Log;
use panel::{Page, Panel, STOP, TAKE};
use serde_json::{Value, json};

const MS: Duration = Duration::from_millis(1);

fn sleep_with_beats(page: &mut Page, duration: Duration) {
    let until = Instant::now() + duration;
    while Instant::now() < until {
        page.say(panel::BEAT);
        page.read();
    }
}

#[test]
fn page_that_freezes_loses_the_drive_within_1500_ms_and_never_regains_it_by_itself() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut page = panel.page();
    page.drive(&panel);
    let took = page.until(Page::is_off_with_fault, false);
    assert!(took > 500 * MS && took < 1500 * MS, "{took:?}");
    // Late beats resume nothing: the fault is latched and the control is gone.
    sleep_with_beats(&mut page, 600 * MS);
    assert!(page.is_off_with_fault() && page.state["driver"].is_null(), "{}", page.state);
    let (status, _) = panel.request("POST", "command", &json!({"client": page.client(), "line": "OUTPut ON"}).to_string());
    assert_eq!(status, 409);
    page.say(TAKE);
    page.until(|page| page.state["driver"] == page.state["client"], true);
    let refused = page.command(&panel, "OUTPut ON");
    assert!(refused["errors"][0].as_str().unwrap().contains("FAULt:CLEar"), "{refused}");
    assert_eq!(page.state["drive"]["stopped_because"]["kind"], "silent");
    page.command(&panel, "FAULt:CLEar");
    page.until(|page| page.state["drive"]["stopped_because"].is_null(), true);
    page.drive(&panel);
    page.say(STOP);
    page.until(Page::is_off_with_fault, false);
}

#[test]
fn any_page_stops_the_drive_within_50_ms_and_only_the_driver_drives() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let (mut driver, mut viewer) = (panel.page(), panel.page());
    let mut delays: Vec<Duration> = Vec::new();
    for _ in 0..5 {
        driver.drive(&panel);
        viewer.say(TAKE);
        viewer.read();
        let (status, answer) = panel.request("POST", "command", &json!({"client": viewer.client(), "line": "SOURce:RATE 9"}).to_string());
        assert_eq!(status, 409, "{answer}");
        // The control is revoked when 0x18 has been requested; the byte follows within the wait of the line's thread.
        let begun = Instant::now();
        viewer.say(STOP);
        // A query that the stop overtook is answered `stopped`.
        let query = json!({"client": viewer.client(), "line": "OUTPut?"}).to_string();
        while panel.request("POST", "command", &query).1["replies"][0] != "0" {}
        delays.push(begun.elapsed());
        driver.until(Page::is_off_with_fault, true);
        assert!(driver.state["drive"]["fault"].as_str().unwrap().contains("stop"), "{}", driver.state);
        driver.say(TAKE);
        driver.until(|page| page.state["driver"] == page.state["client"], true);
        driver.command(&panel, "FAULt:CLEar");
    }
    delays.sort();
    assert!(delays[2] < 50 * MS, "{delays:?}");
}

#[test]
fn hidden_page_and_closed_page_stop_the_drive() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut viewer = panel.page();
    for close in [false, true] {
        let mut page = panel.page();
        page.drive(&panel);
        if close {
            drop(page);
        } else {
            page.say(panel::LEAVE);
        }
        let took = viewer.until(Page::is_off_with_fault, false);
        assert!(took < 1000 * MS, "{took:?}");
        viewer.say(TAKE);
        viewer.until(|page| page.state["driver"] == page.state["client"], true);
        viewer.command(&panel, "FAULt:CLEar");
        // Until the stand has reported its drive off, every farewell stops it.
        sleep_with_beats(&mut viewer, 1500 * MS);
        viewer.say(panel::LEAVE);
        viewer.until(|page| page.state["driver"].is_null() && page.state["drive"]["fault"] == "", false);
    }
}

#[test]
fn server_that_is_killed_loses_the_drive_within_700_ms_by_the_firmware_alone() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    let mut panel = Panel::new(folder.path(), &["--port", &served.port]);
    let mut page = panel.page();
    page.drive(&panel);
    sleep_with_beats(&mut page, 300 * MS);
    panel.child.kill().unwrap();
    panel.child.wait().unwrap();
    std::thread::sleep(700 * MS);
    let said = send_lines(folder.path(), &served.port, "OUTPut?\nFAULt?\n");
    assert!(said.out.starts_with("0\n") && said.out.contains("host silent"), "{said:?}");
}

#[test]
fn server_that_hangs_loses_the_drive_and_does_not_resume_it() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let served = Served::new(folder.path(), &[]);
    let outside = Panel::new(folder.path(), &["--port", &served.port, "--folder", "outside"]);
    let mut page = outside.page();
    page.drive(&outside);
    let signal = |name: &str| {
        assert!(std::process::Command::new("kill").args(["-s", name, &outside.child.id().to_string()]).status().unwrap().success())
    };
    signal("STOP");
    std::thread::sleep(1500 * MS);
    signal("CONT");
    page.until(Page::is_off_with_fault, true);
    drop(panel);
}

#[test]
fn line_that_is_pulled_is_reported_and_the_server_lives() {
    let folder = folder();
    let mut served = Served::new(folder.path(), &[]);
    let panel = Panel::new(folder.path(), &["--port", &served.port]);
    let mut page = panel.page();
    page.drive(&panel);
    served.child.kill().unwrap();
    served.child.wait().unwrap();
    let took = page.until(|page| page.state["drive"]["line_error"] != "", true);
    assert!(took < 700 * MS, "{took:?}");
    assert!(page.state["driver"].is_null());
    let (status, answer) = panel.request("POST", "command", &json!({"client": page.client(), "line": "*IDN?"}).to_string());
    assert_eq!((status, answer["error"].as_str().unwrap().lines().count()), (502, 1));
    assert_eq!(panel.request("GET", "session", "").0, 200);
}

fn record(panel: &Panel, page: &mut Page, seconds: f64, more: &Value) -> Value {
    page.say(TAKE);
    page.until(|page| page.state["driver"] == page.state["client"], true);
    let mut request =
        json!({"client": page.client(), "profile": "multi-step", "mode": "rate", "amplitude": 15.0, "seconds": seconds, "seed": 1});
    for (key, value) in more.as_object().unwrap() {
        request[key] = value.clone();
    }
    panel.post("record", &request)
}

#[test]
fn recording_with_a_frozen_viewer_loses_no_row_and_unattended_needs_no_page() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    // It never reads.
    let frozen = panel.page();
    let mut page = panel.page();
    page.until(|page| page.columns >= 10 && page.times.len() > 500, false);
    let started = record(&panel, &mut page, 3.0, &json!({"unattended": true}));
    let (status, _) = panel.request("POST", "command", &json!({"client": page.client(), "line": "SOURce:RATE 9"}).to_string());
    assert_eq!(status, 409, "the stand is the recording's");
    drop(page);
    let mut other = panel.page();
    let job = other.finish(&started);
    assert_eq!((job["error"].as_str(), job["answer"].as_str()), (Some(""), Some("run-1.parquet")), "{job}");
    let log = Log::read(folder.path().join("panel/run-1.parquet")).unwrap();
    assert_eq!((log.len(), log.note("lost_rows")), (3000, Some("0")));
    assert_eq!(other.state["drive"]["fault"], "", "a recording that ended is no loss of the page");
    drop(frozen);
}

#[test]
fn typed_stop_is_accepted_during_a_recording() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut page = panel.page();
    page.until(|page| page.columns >= 10, false);
    let started = record(&panel, &mut page, 3.0, &json!({"unattended": true}));
    let (status, answer) = panel.request("POST", "command", &json!({"client": page.client(), "line": "OUTP OFF"}).to_string());
    assert_eq!(status, 200, "{answer}");
    page.finish(&started);
    page.until(|page| page.state["drive"]["mode"] == "OFF", false);
}

#[test]
fn recording_ends_with_the_lease_and_keeps_every_row_until_then() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut page = panel.page();
    let started = record(&panel, &mut page, 20.0, &json!({}));
    sleep_with_beats(&mut page, 1500 * MS);
    page.until(|page| page.is_off_with_fault() && page.state["job"]["is_running"] == false, false);
    let job = page.finish(&started);
    assert!(job["error"].as_str().unwrap().contains("run-1.parquet"), "{job}");
    let log = Log::read(folder.path().join("panel/run-1.parquet")).unwrap();
    assert!(log.len() > 1500 && log.note("lost_rows") == Some("0"), "{} {:?}", log.len(), log.note("lost_rows"));
}

#[test]
fn loop_finds_a_hidden_effect_and_its_files_are_those_of_the_command_line() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &["--hidden", "cogging"]);
    let mut page = panel.page();
    let started = record(&panel, &mut page, 10.0, &json!({"find_index": true}));
    let log = page.answer_of(&started);
    let words = json!({"log": log, "model": "model.toml"});
    let worst = |page: &mut Page, fit: bool| {
        let mut words = words.clone();
        words["fit"] = fit.into();
        let job = page.finish(&panel.post("compare", &words));
        assert_eq!(job["error"], "", "{job}");
        let answer = panel.request("GET", &format!("answer?name={}", job["answer"].as_str().unwrap()), "").1;
        answer["outputs"].as_object().unwrap().values().map(|output| output["ratio"].as_f64().unwrap()).fold(0.0, f64::max)
    };
    let before = worst(&mut page, true);
    let job = page.finish(&panel.post("explain", &words));
    let answer = panel.request("GET", &format!("answer?name={}", job["answer"].as_str().unwrap()), "").1;
    assert_eq!((answer["verdict"].as_str(), answer["missing"][0].as_str()), (Some("effect-found"), Some("cogging")), "{job}");
    panel.post("model", &json!({"name": "model.toml", "add": "cogging"}));
    let candidate = answer["candidates"].as_array().unwrap().iter().find(|c| c["effect"] == "cogging").unwrap();
    let values: serde_json::Map<String, Value> =
        candidate["parameters"].as_object().unwrap().iter().map(|(name, p)| (name.clone(), p["value"].clone())).collect();
    panel.post("model", &json!({"name": "model.toml", "set": values}));
    let after = worst(&mut page, true);
    assert!(before > 3.0 && after < 1.5, "{before} -> {after}");
    let session = folder.path().join("panel");
    stand(&session, &["compare", &log, "--model", "model.toml"]).succeeded();
    let commands = std::fs::read_to_string(session.join("commands.txt")).unwrap();
    assert!(commands.contains("stand record --port") && commands.contains("stand model add model.toml cogging"), "{commands}");
}

/// The log of the folder as another program writes it, with a column whose name says nothing.
fn foreign(folder: &std::path::Path) -> String {
    let log = Log::read(folder.join("log.csv")).unwrap();
    let column = |name: &str| log.column(name).unwrap();
    let mut text = "Zeit [ms];Spannung [V];Strom [mA];Kanal 4;Winkel [°]\n".to_owned();
    for k in 0..log.len() {
        let rpm = column("omega_rad_s")[k] * 60.0 / std::f64::consts::TAU;
        let cells = [1e3 * column("t_s")[k], column("u_V")[k], 1e3 * column("i_A")[k], rpm, column("theta_rad")[k].to_degrees()];
        text += &(cells.map(|cell| cell.to_string().replace('.', ",")).join(";") + "\n");
    }
    text
}

#[test]
fn log_of_another_program_is_uploaded_mapped_by_consent_and_compared() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let mut page = panel.page();
    let session = folder.path().join("panel");
    assert_eq!(panel.request("POST", "upload?name=fremd.txt", &foreign(folder.path())).0, 200);
    let listed = || {
        let names = panel.request("GET", "session", "").1;
        let of = |key: &str| names[key].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>();
        (of("logs"), of("models"))
    };
    assert_eq!(listed(), (vec![], vec!["model.toml".to_owned()]), "without consent it is no log");
    let believed = panel.post("inspect", &json!({"name": "fremd.txt"}));
    let is = |answer: &Value| {
        answer["columns"].as_array().unwrap().iter().map(|c| c["is"].as_str().unwrap_or("-").to_owned()).collect::<Vec<_>>()
    };
    let names = is(&believed);
    assert_eq!(
        (&names[0], &names[1], &names[2], &names[4]),
        (&"t_s".into(), &"u_V".into(), &"i_A".into(), &"theta_rad".into()),
        "{believed}"
    );
    assert_eq!((believed["rows"].as_u64(), believed["gaps"].as_u64(), believed["decimal"].as_str()), (Some(3000), Some(0), Some(",")));
    assert!(believed["columns"][0]["why"].as_str().is_some_and(|why| !why.is_empty()) && believed["known"].as_array().unwrap().len() > 10);
    let rpm =
        |unit: &str| json!({"name": "fremd.txt", "columns": [["Kanal 4", "omega_rad_s"]], "units": [["Kanal 4", unit]], "accept": true});
    let (status, refused) = panel.request("POST", "inspect", &rpm("banana").to_string());
    assert!(status == 422 && refused["error"].as_str().unwrap().contains("banana"), "{refused}");
    let unread = json!({"name": "fremd.txt", "notes": [["u_V", "magnitud"]]}).to_string();
    assert!(panel.request("POST", "inspect", &unread).1["error"].as_str().unwrap().contains("magnitud"));
    assert!(!session.join("fremd.import.toml").exists(), "what is refused is not remembered");
    panel.post("inspect", &rpm("rpm"));
    assert_eq!(listed(), (vec!["fremd.txt".to_owned()], vec!["model.toml".to_owned()]));
    let (own, imported) = (Log::read(folder.path().join("log.csv")).unwrap(), Log::read(session.join("fremd.txt")).unwrap());
    for (a, b) in own.column("omega_rad_s").unwrap().iter().zip(imported.column("omega_rad_s").unwrap()) {
        assert!((a - b).abs() < 1e-9 * a.abs().max(1.0), "{a} {b}");
    }
    let job = page.finish(&panel.post("compare", &json!({"log": "fremd.txt", "model": "model.toml"})));
    assert_eq!(job["error"], "");
    let answer = panel.request("GET", &format!("answer?name={}", job["answer"].as_str().unwrap()), "").1;
    let rate = &answer["profiles"]["omega_rad_s"];
    let over: Vec<&str> = rate["coordinates"].as_array().unwrap().iter().map(|c| c["coordinate"].as_str().unwrap()).collect();
    assert!(["theta", "omega", "current", "time"].iter().all(|name| over.contains(name)), "{over:?}");
    for coordinate in rate["coordinates"].as_array().unwrap() {
        let bins = coordinate["bins"].as_array().unwrap();
        let excess = |bin: &Value| bin[1].as_f64().unwrap().abs() - bin[2].as_f64().unwrap();
        let largest = bins.iter().map(excess).fold(0.0, f64::max);
        assert_eq!(coordinate["worst"].as_u64().map_or(0.0, |k| excess(&bins[k as usize])), largest, "{coordinate}");
    }
    // The same command in a shell is that of the list.
    let commands = std::fs::read_to_string(session.join("commands.txt")).unwrap();
    assert!(commands.contains("stand log inspect fremd.txt --map 'Kanal 4=omega_rad_s' --unit 'Kanal 4=rpm' --accept\n"), "{commands}");
    // A file of the same stem has no mapping of its own to lose, and takes none.
    std::fs::copy(folder.path().join("log.csv"), session.join("fremd.csv")).unwrap();
    let before = std::fs::read(session.join("fremd.import.toml")).unwrap();
    let other = json!({"name": "fremd.csv", "units": [["u_V", "mV"]], "accept": true}).to_string();
    assert_eq!(panel.request("POST", "inspect", &other).0, 409);
    assert_eq!(std::fs::read(session.join("fremd.import.toml")).unwrap(), before);
}

#[test]
fn file_without_a_time_is_accepted_once_its_row_rate_is_stated() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let session = folder.path().join("panel");
    let text: String = (0..500).map(|k| format!("{};{}\n", f64::from(k).sin(), 100.0 * f64::from(k).cos()).replace('.', ",")).collect();
    assert_eq!(panel.request("POST", "upload?name=ohne.csv", &format!("Spannung [V];Drehzahl [rpm]\n{text}")).0, 200);
    let open = panel.post("inspect", &json!({"name": "ohne.csv"}));
    assert!(open["open"].as_str().unwrap().contains("--sample-rate"), "{open}");
    let (status, refused) = panel.request("POST", "inspect", r#"{"name":"ohne.csv","accept":true}"#);
    assert!(status == 422 && refused["error"].as_str().unwrap().contains("--sample-rate"), "{refused}");
    let stated = json!({"name": "ohne.csv", "sample_rate_Hz": 500.0, "notes": [["u_V", "terminal"]], "accept": true});
    panel.post("inspect", &stated);
    let log = Log::read(session.join("ohne.csv")).unwrap();
    assert_eq!((log.t_s()[1], log.note("u_V")), (0.002, Some("terminal")));
    // A later statement changes what it states; the rest stays.
    panel.post("inspect", &json!({"name": "ohne.csv", "units": [["Spannung [V]", "mV"]], "accept": true}));
    let again = Log::read(session.join("ohne.csv")).unwrap();
    assert_eq!((again.t_s()[1], again.note("u_V")), (0.002, Some("terminal")));
    assert_eq!(again.column("u_V").unwrap()[1], 1e-3 * log.column("u_V").unwrap()[1]);
}

#[test]
fn visible_range_is_exported_as_a_log_that_the_command_line_reads() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let session = folder.path().join("panel");
    let body = |format: &str, of: &str| {
        let head = json!({"format": format, "of": of, "columns": ["t_s", "omega_rad_s", "temp_C"], "rows": 500}).to_string();
        let mut bytes = (head.len() as u32).to_le_bytes().to_vec();
        bytes.extend(head.as_bytes());
        let time = (0..500).map(|k| 17.0 + f64::from(k) / 1000.0);
        let rate = (0..500).map(|k| if k == 7 { f64::NAN } else { f64::from(k).sin() });
        time.chain(rate).chain((0..500).map(|_| f64::NAN)).for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes
    };
    for format in ["parquet", "csv", "csv"] {
        let (status, answer) = panel.request_bytes("POST", "export", &body(format, "live"));
        assert_eq!((status, answer["rows"].as_u64(), answer["left_out"].as_u64()), (200, Some(499), Some(1)), "{answer}");
        let name = answer["name"].as_str().unwrap();
        let inspected = stand(&session, &["log", "inspect", name, "--json", "-"]).succeeded().json();
        assert_eq!((inspected["is_own"].as_bool(), inspected["rows"].as_u64()), (Some(true), Some(499)), "{inspected}");
        let log = Log::read(session.join(name)).unwrap();
        assert_eq!((log.t_s()[0], log.column("omega_rad_s").unwrap()[498]), (17.0, 499_f64.sin()));
        assert!(log.note("export_of").unwrap().starts_with("stream of ") && log.notes().has_provenance("omega_rad_s"), "{:?}", log.notes());
    }
    assert!(session.join("export-2.csv").exists() && session.join("export-1.csv").exists());
    for (format, of) in [("exe", "live"), ("csv", "../log.csv"), ("csv", "absent.parquet")] {
        let (status, answer) = panel.request_bytes("POST", "export", &body(format, of));
        assert!(status == 422 && answer["error"].as_str().unwrap().lines().count() == 1, "{answer}");
    }
}

#[test]
fn explanation_is_cancelled_within_seconds_and_the_next_job_starts() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &["--hidden", "cogging"]);
    let mut page = panel.page();
    let started = record(&panel, &mut page, 20.0, &json!({}));
    let log = page.answer_of(&started);
    let words = json!({"log": log, "model": "model.toml"});
    let started = panel.post("explain", &words);
    let (status, _) = panel.request("POST", "compare", &words.to_string());
    assert_eq!(status, 422, "one job at a time");
    std::thread::sleep(300 * MS);
    panel.post("cancel", &json!({}));
    let begun = Instant::now();
    let job = page.finish(&started);
    assert!(job["error"] == "" && job["is_cancelled"] == true, "{job}");
    assert!(begun.elapsed() < Duration::from_secs(10), "{:?}", begun.elapsed());
    let started = panel.post("compare", &words);
    page.answer_of(&started);
}

#[test]
fn one_press_of_stop_is_one_byte_on_the_line_by_whichever_way_it_comes() {
    let folder = folder();
    let relay = Relay::new(folder.path());
    let panel = Panel::new(folder.path(), &["--port", &format!("tcp:{}", relay.port)]);
    let mut page = panel.page();
    let press = |number: u64| [&[STOP][..], &number.to_le_bytes()].concat();
    let by_request = |number: u64| panel.request("POST", "stop", &json!({"press": number}).to_string()).0;
    let mut expected = 0;
    let mut stops = |page: &mut Page, count: usize, what: &str| {
        expected += count;
        page.until(|_| relay.stops() >= expected, true);
        sleep_with_beats(page, 300 * MS);
        assert_eq!(relay.stops(), expected, "{what}");
    };
    page.drive(&panel);
    page.say_bytes(&press(7));
    assert_eq!(by_request(7), 200);
    stops(&mut page, 1, "the socket is first");
    assert_eq!(page.state["drive"]["stopped_because"]["kind"], "pressed");
    assert_eq!(by_request(8), 200);
    page.say_bytes(&press(8));
    stops(&mut page, 1, "the request is first");
    page.say_bytes(&press(9));
    stops(&mut page, 1, "the request does not arrive");
    // Without a number, and with a body that is no JSON, each is a press of its own.
    page.say(STOP);
    stops(&mut page, 1, "no number");
    assert_eq!(panel.request("POST", "stop", "{{{").0, 200);
    stops(&mut page, 1, "a broken body");
}

#[test]
fn note_on_a_column_is_stated_removed_and_forgotten_with_consent() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &[]);
    let (session, rate) = (folder.path().join("panel"), "encoder, mean over 20 ms before t");
    assert_eq!(panel.request("POST", "upload?name=fremd.txt", &foreign(folder.path())).0, 200);
    let inspect = |notes: Value, accept: bool| {
        let columns = json!([["Kanal 4", "omega_rad_s"]]);
        let request = json!({"name": "fremd.txt", "columns": columns, "units": [["Kanal 4", "rpm"]], "notes": notes, "accept": accept});
        panel.post("inspect", &request)["notes"].clone()
    };
    assert_eq!(inspect(json!([["u_V", "at t"], ["omega_rad_s", rate]]), true), json!({"omega_rad_s": rate, "u_V": "at t"}));
    assert_eq!(inspect(json!([["u_V", ""]]), false), json!({"omega_rad_s": rate}), "without consent the file keeps it");
    assert_eq!(Log::read(session.join("fremd.txt")).unwrap().note("u_V"), Some("at t"));
    inspect(json!([["u_V", ""]]), true);
    let log = Log::read(session.join("fremd.txt")).unwrap();
    assert_eq!((log.note("u_V"), log.note("omega_rad_s")), (None, Some(rate)));
    stand(&session, &["log", "inspect", "fremd.txt", "--note", "omega_rad_s=", "--accept"]).succeeded();
    assert_eq!(Log::read(session.join("fremd.txt")).unwrap().note("omega_rad_s"), None);
    let blank = json!({"name": "fremd.txt", "notes": [["u_V", " "]]}).to_string();
    assert_eq!(panel.request("POST", "inspect", &blank).0, 422);
}

#[test]
fn signature_of_an_effect_is_what_it_explains_of_the_residual() {
    let folder = folder();
    let panel = Panel::new(folder.path(), &["--hidden", "cogging"]);
    let mut page = panel.page();
    let started = record(&panel, &mut page, 10.0, &json!({"find_index": true}));
    let log = page.answer_of(&started);
    let session = folder.path().join("panel");
    let model = std::fs::read_to_string(session.join("model.toml")).unwrap();
    let starts = json!({"cogging_order": 8.0});
    let signature = |page: &mut Page, effect: &str, parameters: &Value| {
        let words = json!({"log": log, "model": "model.toml", "effect": effect, "parameters": parameters});
        let job = page.finish(&panel.post("signature", &words));
        assert_eq!(job["error"], "", "{job}");
        panel.request("GET", &format!("answer?name={}", job["answer"].as_str().unwrap()), "").1
    };
    let rms = |answer: &Value, model: &str| {
        let series = Log::read_all(session.join(answer["series"].as_str().unwrap())).unwrap();
        let column = |name: &str| series.column(name).unwrap_or_else(|| panic!("{name}")).to_vec();
        let residual = column("omega_rad_s").iter().zip(column(model)).map(|(y, modelled)| (y - modelled).powi(2)).sum::<f64>();
        (residual / series.len() as f64).sqrt()
    };
    let with = signature(&mut page, "cogging", &starts);
    let [without, explained] = ["omega_rad_s_model", "omega_rad_s_model_with"].map(|model| rms(&with, model));
    assert!(without > 1.5 * explained, "{without} {explained}");
    assert_eq!((&with["coordinate"], with["model_effects"].as_array().unwrap().contains(&"cogging".into())), (&"theta".into(), false));
    assert!(with["profiles"]["omega_rad_s"].is_object() && with["profiles_with"]["omega_rad_s"].is_object());
    // Of an effect of the model it is the same, with the effect taken out.
    panel.post("model", &json!({"name": "model.toml", "add": "cogging"}));
    panel.post("model", &json!({"name": "model.toml", "set": {"cogging_order": 8.0}}));
    let of_model = signature(&mut page, "cogging", &json!({}));
    assert!((rms(&of_model, "omega_rad_s_model_with") / explained - 1.0).abs() < 0.02, "{of_model}");
    panel.post("model", &json!({"name": "model.toml", "remove": "cogging"}));
    assert_eq!(std::fs::read_to_string(session.join("model.toml")).unwrap().contains("cogging\""), model.contains("cogging\""));
    for effect in ["absent", "cogging\nreboot", "", "../cogging"] {
        let words = json!({"log": log, "model": "model.toml", "effect": effect});
        let (status, refused) = panel.request("POST", "signature", &words.to_string());
        assert!(status == 422 && refused["error"].as_str().unwrap().lines().count() == 1, "{effect:?} {refused}");
    }
    let logs = panel.request("GET", "session", "").1["logs"].clone();
    assert_eq!(logs.as_array().unwrap().len(), 1, "a series of an answer is no log: {logs}");
}

/// A relay before a served stand, which counts the stops on the line.
struct Relay {
    stand: std::process::Child,
    port: u16,
    stops: Arc<AtomicUsize>,
}

impl Relay {
    fn new(folder: &std::path::Path) -> Self {
        let mut stand = command(folder, &["sim", "--serve", "tcp:0"]).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut address = String::new();
        BufReader::new(stand.stdout.take().unwrap()).read_line(&mut address).unwrap();
        let target: u16 = address.trim().rsplit(':').next().unwrap().parse().unwrap();
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let stops = Arc::new(AtomicUsize::new(0));
        let counted = stops.clone();
        std::thread::spawn(move || {
            while let Ok((client, _)) = listener.accept() {
                let line = TcpStream::connect(("127.0.0.1", target)).unwrap();
                for (from, to, counted) in
                    [(client.try_clone().unwrap(), line.try_clone().unwrap(), Some(counted.clone())), (line, client, None)]
                {
                    std::thread::spawn(move || copy(from, to, counted.as_deref()));
                }
            }
        });
        Relay { stand, port, stops }
    }

    fn stops(&self) -> usize {
        self.stops.load(Ordering::SeqCst)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        let _ = self.stand.kill();
        let _ = self.stand.wait();
    }
}

/// Copies until an end closes.
fn copy(mut from: TcpStream, mut to: TcpStream, counted: Option<&AtomicUsize>) {
    to.set_nodelay(true).unwrap();
    let mut bytes = [0; 4096];
    while let Ok(count @ 1..) = from.read(&mut bytes) {
        let stops = bytes[..count].iter().filter(|byte| **byte == STOP).count();
        if let Some(counted) = counted {
            counted.fetch_add(stops, Ordering::SeqCst);
        }
        if to.write_all(&bytes[..count]).is_err() {
            break;
        }
    }
    let _ = to.shutdown(Shutdown::Both);
}
