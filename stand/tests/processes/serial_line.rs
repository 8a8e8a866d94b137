//! The served stand behind a pseudo-terminal, in real time.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use common::served::{Served, send_lines};
use common::{MODEL, RunOutput, command, stand};
use identification::log::Log;
use identification::model::Model;
use stand_acquire::link::SerialLink;
use stand_acquire::serve::Pty;
use stand_firmware::telemetry::frame::MAX_FRAME;
use stand_firmware::telemetry::message::PROTOCOL;
use stand_firmware::telemetry::{Body, Hello, encode};
use tempfile::TempDir;

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("model.toml"), MODEL).unwrap();
    folder
}

fn record(folder: &Path, port: &str, more: &[&str]) -> RunOutput {
    stand(folder, &[&["record", "--port", port], more].concat())
}

#[test]
fn piped_console_reports_a_rejected_line_and_continues() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    let identity = format!("Rotary Stand,simulated,SIM-1,{}\n", stand_firmware::VERSION);
    // Clients connect and disconnect; the second name works too.
    for port in [served.port.as_str(), "port", "port"] {
        assert_eq!(send_lines(folder.path(), port, "*IDN?\n").succeeded().out, identity);
    }
    let bad = send_lines(folder.path(), "port", "*IDN?\nSOURce:RAET 5\nSOURce:RATE?\n");
    assert_eq!(bad.status, Some(2));
    assert!(bad.out.starts_with(&identity) && bad.out.lines().count() == 2, "the later query was answered: {}", bad.out);
    let mut lines = bad.err.lines();
    assert!(lines.next().is_some_and(|line| line.starts_with("stand: line 2: `SOURce:RAET 5`: -113,\"Undefined header")), "{}", bad.err);
    assert_eq!(lines.next(), Some("stand: the stand rejected one command; see standard error"));
    assert_eq!(lines.next(), None);
    let help = send_lines(folder.path(), "port", "HELP?\n").succeeded().out;
    assert!(help.lines().count() > 50 && help.contains("STReam:CHANnels"));
}

#[test]
fn unusable_port_gives_one_line_and_status_2() {
    let folder = folder();
    let refused = |port: &str, expected: &str| {
        for words in [vec!["console", "--port", port], vec!["record", "--port", port, "--out", "x.csv"]] {
            let ran = stand(folder.path(), &words);
            assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{ran:?}");
            assert!(ran.err.lines().count() == 1 && ran.err.contains(expected), "{expected}: {}", ran.err);
        }
    };
    refused("/dev/ttyABSENT7", "no such port");
    refused("model.toml", "not a serial port");
    refused(".", "not a serial port");
    for words in [vec!["console"], vec!["record", "--out", "x.csv"]] {
        let ran = stand(folder.path(), &words);
        assert!(ran.status == Some(2) && ran.err.starts_with("stand: --port is missing"), "{ran:?}");
    }
    let silent = Pty::open(None).unwrap();
    refused(silent.path().to_str().unwrap(), "no reply; check");
    let served = Served::new(folder.path(), &[]);
    let holder = stand_acquire::link::Port::open(Path::new(&served.port)).unwrap();
    refused(&served.port, "another program uses this port");
    drop(holder);
    send_lines(folder.path(), &served.port, "*IDN?\n").succeeded();
    assert!(!folder.path().join("x.csv").exists(), "nothing was begun");
}

/// A line that is off for the first 0.7 s, and a line that flips a bit in one of 200 bytes: a single query is lost at first, or in one of
/// eight connections.
#[test]
fn identification_is_repeated_after_damaged_lines() {
    let folder = folder();
    let fault = |what: &str, more: &str| format!("[[faults]]\nwhat = \"{what}\"\nfrom_s = 0.0\n{more}\n");
    std::fs::write(folder.path().join("off.toml"), fault("line-off", "for_s = 0.7")).unwrap();
    std::fs::write(folder.path().join("flips.toml"), fault("line-flips", "size = 0.005")).unwrap();
    let served = Served::new(folder.path(), &["--stand", "off.toml"]);
    assert!(SerialLink::open(Path::new(&served.port)).unwrap().identity().starts_with("Rotary Stand,"));
    drop(served);
    let served = Served::new(folder.path(), &["--stand", "flips.toml"]);
    for opening in 0..24 {
        SerialLink::open(Path::new(&served.port)).unwrap_or_else(|e| panic!("opening {opening}: {e}"));
    }
}

#[test]
fn incomplete_line_of_an_earlier_client_is_ignored() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    for half in ["SOURce:RATE 7", "nonsense", "SOURce:RATE 7~12AB"] {
        let mut port = stand_acquire::link::Port::open(Path::new(&served.port)).unwrap();
        port.write(half.as_bytes()).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        drop(port);
        let ran = send_lines(folder.path(), &served.port, "SOURce:RATE?\n").succeeded();
        assert!(ran.out == "0\n", "{half}: {}", ran.out);
    }
}

#[test]
fn other_device_at_the_port_is_reported() {
    let mut pty = Pty::open(None).unwrap();
    let path = pty.path().to_owned();
    let (stop, stopped) = std::sync::mpsc::channel::<()>();
    let other = std::thread::spawn(move || {
        let mut heard = Vec::new();
        while stopped.try_recv().is_err() {
            pty.exchange(&mut Vec::new(), &mut heard).unwrap();
            if heard.ends_with(b"\n") && heard.len() > 4 {
                heard.clear();
                pty.exchange(&mut b"ACME,voltmeter,7,1.0\r\n".to_vec(), &mut heard).unwrap();
            }
            std::thread::sleep(Duration::from_millis(2));
        }
    });
    let ran = stand(Path::new("."), &["console", "--port", path.to_str().unwrap()]);
    stop.send(()).unwrap();
    other.join().unwrap();
    assert_eq!(ran.status, Some(2));
    assert!(ran.err.contains("the connected device is not a stand; it replied `ACME,voltmeter,7,1.0`"), "{}", ran.err);
}

#[test]
fn recording_of_a_served_stand_reveals_its_cogging() {
    let folder = folder();
    // The served stand's disc starts away from its index: a phase is correct only if the log's angles count from the index.
    let phase_rad = 1.0;
    let cogging = format!("[effects.cogging]\ncogging_N_m = 1.5e-3\ncogging_order = 12\ncogging_phase_rad = {phase_rad}\n");
    std::fs::write(folder.path().join("stand.toml"), cogging).unwrap();
    let served = Served::new(folder.path(), &["--stand", "stand.toml", "--speed", "4"]);
    let ran = record(folder.path(), &served.port, &["--out", "log.parquet", "--seconds", "15", "--find-index", "--json", "-"]);
    assert_eq!((ran.status, ran.err.as_str()), (Some(0), ""), "{ran:?}");
    let answer = ran.json();
    assert_eq!(answer["lost_rows"], 0, "{answer}");
    assert_eq!((&answer["samples"], &answer["theta_zero"], &answer["ended"]), (&15_000.into(), &"index".into(), &serde_json::Value::Null));
    let log = Log::read(folder.path().join("log.parquet")).unwrap();
    assert!(log.warnings().is_empty(), "{:?}", log.warnings());
    assert_eq!(log.segments().len(), 1);
    assert!(!folder.path().join("log.parquet.csv").exists());
    let explained =
        stand(folder.path(), &["explain", "log.parquet", "--model", "model.toml", "--out", "explained.toml", "--json", "-"]).json();
    assert_eq!(explained["verdict"], "effect-found", "{explained}");
    assert_eq!(explained["missing"][0], "cogging", "{explained}");
    let found_rad = Model::read(folder.path().join("explained.toml")).unwrap().value("cogging_phase_rad").unwrap();
    assert!((found_rad - phase_rad).abs() < 0.05, "{found_rad}");
}

/// A recording in progress.
fn recording(folder: &Path, port: &str, out: &str) -> Child {
    let words = ["record", "--port", port, "--out", out, "--seconds", "60"];
    let child = command(folder, &words).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let meanwhile = PathBuf::from(out.replace(".parquet", ".parquet.csv").replace("log.csv", "log.part.csv"));
    let begun = Instant::now();
    // Flushed each second, so the file has content after some seconds.
    while std::fs::metadata(folder.join(&meanwhile)).map_or(0, |m| m.len()) < 20_000 {
        assert!(begun.elapsed() < Duration::from_secs(20), "the recording does not begin");
        std::thread::sleep(Duration::from_millis(50));
    }
    child
}

#[test]
fn unplugged_port_leaves_a_complete_log() {
    for out in ["log.csv", "log.parquet"] {
        let folder = folder();
        let served = Served::new(folder.path(), &[]);
        let child = recording(folder.path(), &served.port, out);
        drop(served);
        let ran: RunOutput = child.wait_with_output().unwrap().into();
        assert_eq!(ran.status, Some(1));
        assert!(ran.err.contains("the port was unplugged") && ran.err.contains(out), "{}", ran.err);
        let log = Log::read(folder.path().join(out)).unwrap();
        assert!(log.len() > 500, "{}", log.len());
        assert!(log.note("ended").is_some_and(|note| note.contains("unplugged")), "{:?}", log.notes());
        assert_eq!(log.note("lost_rows"), Some("0"));
    }
}

#[test]
fn ctrl_c_ends_a_recording_with_a_complete_log() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    let child = recording(folder.path(), &served.port, "log.csv");
    assert!(Command::new("kill").args(["-s", "INT", &child.id().to_string()]).status().unwrap().success());
    let ran: RunOutput = child.wait_with_output().unwrap().into();
    assert_eq!(ran.status, Some(1));
    assert!(ran.err.contains("interrupted; the rows until then are in log.csv"), "{}", ran.err);
    assert!(ran.out.starts_with("ended early: by hand"), "{}", ran.out);
    assert!(Log::read(folder.path().join("log.csv")).unwrap().len() > 500);
    let after = send_lines(folder.path(), "port", "STReam?;OUTPut?;PROFile:STATe?\n").succeeded().out;
    assert_eq!(after.trim(), "0;0;STOPPED");
}

#[test]
fn losses_of_a_bad_line_are_counted() {
    let folder = folder();
    let faults = "[[faults]]\nwhat = \"line-flips\"\nfrom_s = 6\nsize = 0.0003\n";
    std::fs::write(folder.path().join("stand.toml"), faults).unwrap();
    let served = Served::new(folder.path(), &["--stand", "stand.toml"]);
    let ran = record(folder.path(), &served.port, &["--out", "log.csv", "--seconds", "12", "--json", "-"]);
    let answer = ran.json();
    let (rows, lost) = (answer["samples"].as_u64().unwrap(), answer["lost_rows"].as_u64().unwrap());
    assert!(lost > 5, "some 70 bytes a row, 3 in 10 000 of them: {answer}");
    assert!((11_990..=12_010).contains(&(rows + lost)), "{answer}");
    let log = Log::read(folder.path().join("log.csv")).unwrap();
    assert_eq!(log.note("lost_rows"), Some(lost.to_string().as_str()));
    assert!(log.segments().len() > 3, "each loss is a gap");
}

#[test]
fn compensation_needs_the_index() {
    let folder = folder();
    let path = folder.path();
    let with_cogging = MODEL.replace("\"inductance\"]", "\"inductance\", \"cogging\"]")
        + "cogging_N_m = 1.5e-3\ncogging_order = 7\ncogging_phase_rad = 0.4\n";
    std::fs::write(path.join("explained.toml"), with_cogging).unwrap();
    std::fs::write(path.join("zero.csv"), "# theta_zero: index\nt_s,theta_rad\n0,0\n0.001,0\n").unwrap();
    let cogging = "[effects.coulomb]\n[effects.cogging]\ncogging_N_m = 1.5e-3\ncogging_order = 7\ncogging_phase_rad = 0.4\n";
    std::fs::write(path.join("stand.toml"), cogging).unwrap();
    let served = Served::new(path, &["--stand", "stand.toml", "--speed", "4"]);
    let words = ["compensate", "--model", "explained.toml", "--log", "zero.csv", "--port", &served.port];
    let early = stand(path, &words);
    assert_eq!(early.status, Some(2));
    assert!(early.err.contains("has not seen its index"), "{}", early.err);
    assert!(send_lines(path, "port", "COMPensation:COULomb?\n").out == "0\n", "and nothing was written");
    send_lines(path, "port", "HOST:UNATTended 60;:SOURce:RATE 5 RAD/S;:SOURce:MODE RATE\n").succeeded();
    std::thread::sleep(Duration::from_millis(1500));
    send_lines(path, "port", "OUTPut OFF\n").succeeded();
    let done = stand(path, &words).succeeded().out;
    assert!(done.contains("order 7: 0.0015") && done.contains("coulomb 0.00086"), "{done}");
    let list = send_lines(path, "port", "COMPensation:LIST?\n").succeeded().out;
    assert!(list.contains("order 7: 0.0015, 0.4"), "{list}");
    // The ripple that it took away; and a compensation of another motor is withdrawn, with the harmonics of before in force again.
    let line = done.lines().find(|line| line.contains("harmonic   7")).unwrap();
    let reduction: f64 = line.split_whitespace().rev().nth(1).unwrap().parse().unwrap();
    assert!(reduction > 30.0, "{done}");
    let other = std::fs::read_to_string(path.join("explained.toml")).unwrap().replace("cogging_order = 7", "cogging_order = 14");
    std::fs::write(path.join("explained.toml"), other).unwrap();
    let worse = stand(path, &[&words[..], &["--json", "worse.json", "--save"]].concat());
    assert_eq!(worse.status, Some(1), "{worse:?}");
    assert!(worse.out.contains("was withdrawn") && worse.out.contains("larger at 100 °/s: order 14"), "{worse:?}");
    assert!(
        worse.err.contains("makes the ripple of the rate larger") && worse.err.contains("previous compensation was restored"),
        "{worse:?}"
    );
    let answer: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(path.join("worse.json")).unwrap()).unwrap();
    assert_eq!((&answer["withdrawn"], &answer["saved"]), (&true.into(), &false.into()));
    assert_eq!(send_lines(path, "port", "COMPensation:LIST?\n").succeeded().out, list);
    // Without a run it is believed.
    let believed = stand(path, &[&words[..], &["--no-trial"]].concat()).succeeded().out;
    assert!(believed.contains("order 14: 0.0015") && !believed.contains("Ripple"), "{believed}");
}

/// A console that has set the drive to 5 rad/s and waits for further lines.
fn driving_console(folder: &Path) -> Child {
    let mut console = command(folder, &["console", "--port", "port"]);
    let mut child = console.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.as_mut().unwrap().write_all(b"SOURce:RATE 5;MODE RATE\n").unwrap();
    // Longer than the 2 s of silence that the stand allows.
    std::thread::sleep(Duration::from_millis(3500));
    child
}

/// Whether the drive is on, its fault, and the rate of the platform, rad/s. A client that only looks.
fn state(folder: &Path) -> (bool, String, f64) {
    let out = send_lines(folder, "port", "OUTPut?;:FAULt?;:MEASure:RATE?\n").succeeded().out;
    let parts: Vec<&str> = out.trim().split(';').collect();
    (parts[0] == "1", parts[1].split(',').nth(1).unwrap().to_owned(), parts[2].split(' ').next().unwrap().parse().unwrap())
}

#[test]
fn killed_console_leaves_nothing_turning() {
    let folder = folder();
    let _served = Served::new(folder.path(), &[]);
    let mut console = driving_console(folder.path());
    console.kill().unwrap();
    console.wait().unwrap();
    let (is_on, fault, rate_rad_s) = state(folder.path());
    assert!(is_on && fault == "none" && (rate_rad_s - 5.0).abs() < 0.2, "the console was alive: {is_on}, {fault}, {rate_rad_s}");
    // Clients that look do not keep the drive on.
    for _ in 0..6 {
        state(folder.path());
        std::thread::sleep(Duration::from_millis(400));
    }
    let (is_on, fault, rate_rad_s) = state(folder.path());
    assert!(!is_on && fault == "host silent" && rate_rad_s.abs() < 4.0, "{is_on}, {fault}, {rate_rad_s}");
}

#[test]
fn console_that_ends_or_gets_a_signal_stops_the_drive_and_says_so() {
    let folder = folder();
    let _served = Served::new(folder.path(), &[]);
    for signal in [None, Some("INT"), Some("TERM")] {
        let mut console = driving_console(folder.path());
        match signal {
            None => drop(console.stdin.take()),
            Some(name) => assert!(Command::new("kill").args(["-s", name, &console.id().to_string()]).status().unwrap().success()),
        }
        let stdin = console.stdin.take();
        let ended: RunOutput = console.wait_with_output().unwrap().into();
        drop(stdin);
        assert!(ended.err.contains("the drive was on and has been switched off"), "{signal:?}: {}", ended.err);
        assert_eq!(ended.status, Some(i32::from(signal.is_some())), "{signal:?}: {}", ended.err);
        let (is_on, fault, _) = state(folder.path());
        assert!(!is_on && fault == "none", "{signal:?}: {is_on}, {fault}");
    }
    // Unless it runs unattended.
    let armed = send_lines(folder.path(), "port", "HOST:UNATTended 60;:SOURce:RATE 5;MODE RATE\n").succeeded();
    assert_eq!(armed.err, "");
    std::thread::sleep(Duration::from_millis(2500));
    assert!(state(folder.path()).0);
}

#[test]
fn plain_client_is_answered_right_after_a_tool_has_used_the_line() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    send_lines(folder.path(), "port", "*IDN?\n").succeeded();
    let mut port = std::fs::OpenOptions::new().read(true).write(true).open(&served.port).unwrap();
    port.write_all(b"SYSTem:VERSion?\n").unwrap();
    let mut reply = [0; 8];
    port.read_exact(&mut reply).unwrap();
    assert_eq!(&reply, b"1999.0\r\n");
}

#[test]
fn recording_that_a_fault_cuts_short_fails_says_so_first_and_keeps_its_rows() {
    let folder = folder();
    let faults = "[[faults]]\nwhat = \"supply-dip\"\nfrom_s = 4\nfor_s = 1\nsize = 6.0\n";
    std::fs::write(folder.path().join("stand.toml"), faults).unwrap();
    let served = Served::new(folder.path(), &["--stand", "stand.toml"]);
    let ran = record(folder.path(), &served.port, &["--out", "run.csv", "--profile", "constant", "--amplitude", "5", "--seconds", "20"]);
    assert_eq!(ran.status, Some(1), "{ran:?}");
    assert!(ran.out.starts_with("ended early: fault 6,supply low"), "{}", ran.out);
    assert!(ran.err.contains("switched off because of a fault") && ran.err.contains("run.csv"), "{}", ran.err);
    let log = Log::read(folder.path().join("run.csv")).unwrap();
    assert!(log.len() > 1000 && log.note("fault").is_some(), "{} rows", log.len());
}

/// A stand of another firmware: its stream is of the next version of the protocol.
fn next_protocol(mut pty: Pty, stopped: &Receiver<()>) {
    let hello = Hello {
        protocol: PROTOCOL + 1,
        identity: "",
        counts_per_turn: 4e4,
        row_Hz: 1000,
        decimation: 1,
        channels: 1,
        zero_is_index: false,
    };
    let mut buffer = [0; MAX_FRAME];
    let hello = encode(&Body::Hello(hello), 0, &mut buffer).unwrap();
    let mut heard = Vec::new();
    while stopped.try_recv().is_err() {
        pty.exchange(&mut Vec::new(), &mut heard).unwrap();
        while let Some(end) = heard.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = heard.drain(..=end).collect();
            let reply: &[u8] = match &line {
                line if line.starts_with(b"*IDN?") => b"Rotary Stand,other,1,9.0.0\r\n",
                line if line.starts_with(b"SYSTem:ERRor?") => b"0,\"No error\";1999.0\r\n",
                line if line.starts_with(b"STReam ON") => hello,
                _ => b"",
            };
            pty.exchange(&mut reply.to_vec(), &mut heard).unwrap();
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn stream_of_another_protocol_is_refused_with_both_versions() {
    let folder = folder();
    let pty = Pty::open(None).unwrap();
    let port = pty.path().to_str().unwrap().to_owned();
    let (stop, stopped) = channel();
    let device = std::thread::spawn(move || next_protocol(pty, &stopped));
    let ran = send_lines(folder.path(), &port, "STReam ON\n");
    assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{ran:?}");
    let expected = format!("the stand streams in version {} of the protocol, this program reads version {PROTOCOL}", PROTOCOL + 1);
    assert!(ran.err.contains(&expected) && ran.err.lines().count() == 1, "{}", ran.err);
    stop.send(()).unwrap();
    device.join().unwrap();
}

#[test]
fn signal_removes_the_link_and_saves_the_flash() {
    let folder = folder();
    let mut served = Served::new(folder.path(), &["--flash", "flash.bin"]);
    assert!(folder.path().join("port").exists());
    send_lines(folder.path(), "port", "SETTings:current_limit_A 1.25\nSETTings:SAVE\n").succeeded();
    served.signal("TERM");
    assert!(served.child.wait().unwrap().success());
    assert!(std::fs::symlink_metadata(folder.path().join("port")).is_err());
    // The saved settings are in the flash's file.
    let again = Served::new(folder.path(), &["--flash", "flash.bin"]);
    assert!(send_lines(folder.path(), &again.port, "SETTings:current_limit_A?\n").succeeded().out.starts_with("1.25"));
}

/// Runs a Python script that uses `module`.
fn python(module: &str, script: &str, port: &str) {
    let ran: RunOutput = Command::new("python3").args(["-c", script, port]).output().unwrap().into();
    assert_eq!(ran.status, Some(0), "{module}: {}", ran.err);
}

#[test]
#[ignore = "needs python3 with pyserial and pyvisa-py, and picocom"]
fn pyserial_pyvisa_and_picocom_work() {
    let folder = folder();
    let served = Served::new(folder.path(), &[]);
    let pyserial = r#"
import serial, sys
port = serial.Serial(sys.argv[1], 921600, timeout=2, exclusive=True)
port.write(b"*IDN?\n")
assert port.readline().startswith(b"Rotary Stand,"), "identity"
port.write(b"BOGUS\nsyst:err?\n")
assert port.readline().startswith(b'-113,"Undefined header'), "error"
port.write(b"STReam ON\n")
stream = port.read(20000)
assert stream.count(0) > 300, "frames"
port.write(b"\x18")
port.read_until(b"never", 100)
port.timeout = 0.3
while port.read(4096): pass
port.timeout = 2
port.write(b"*IDN?\n")
assert port.readline().startswith(b"Rotary Stand,"), "text again"
"#;
    python("serial", pyserial, &served.port);
    let visa = r#"
import pyvisa, sys, time
stand = pyvisa.ResourceManager("@py").open_resource(f"ASRL{sys.argv[1]}::INSTR", baud_rate=921600, read_termination="\r\n", write_termination="\n", timeout=2000)
assert stand.query("*IDN?").startswith("Rotary Stand,")
# The 0x18 before has latched a fault, which is also in the queue.
assert "emergency stop" in stand.query("FAULt?")
stand.write("FAULt:CLEar;*CLS")
time.sleep(0.1)
stand.write("SOURce:RATE 5 RAD/S;:SOURce:MODE RATE")
time.sleep(1.5)
rate = float(stand.query("MEASure:RATE?").split()[0])
assert abs(rate - 5) < 0.1, rate
stand.write("OUTPut OFF")
assert stand.query("SYSTem:ERRor?") == '0,"No error"', stand.query("SYSTem:ERRor?")
assert stand.query("*OPC?") == "1"
"#;
    python("pyvisa, pyvisa_py", visa, &served.port);
    let typed = format!("(printf '*IDN?\\r'; sleep 1) | picocom -q -b 921600 --noreset {}", served.port);
    let ran: RunOutput = Command::new("sh").args(["-c", &typed]).output().unwrap().into();
    assert!(ran.out.contains("Rotary Stand,simulated"), "{ran:?}");
    // The stand still identifies itself after all clients.
    send_lines(folder.path(), &served.port, "*IDN?\n").succeeded();
}

/// The image that scripts/build-firmware.sh has built.
fn image() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
    let built = ["firmware/thumbv7em-none-eabihf/chip/stand", "thumbv7em-none-eabihf/chip/stand"].map(|path| target.join(path));
    built.iter().find(|path| path.exists()).expect("the image is built").display().to_string()
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn emulated_chip_records_the_log_that_the_simulated_stand_records() {
    let folder = folder();
    let record = |name: &str, chip: &[&str]| {
        let options = ["sim", "--out", name, "--profile", "multi-step", "--mode", "voltage", "--amplitude", "2", "--seconds", "4"];
        stand(folder.path(), &[&options, chip].concat()).succeeded();
        Log::read(folder.path().join(name)).unwrap()
    };
    let (chip, simulated) = (record("chip.csv", &["--chip", &image()]), record("simulated.csv", &[]));
    assert_eq!(chip.note("mode"), simulated.note("mode"));
    assert_eq!(chip.note("lost_rows"), Some("0"));
    assert_eq!(chip.note("theta_zero"), simulated.note("theta_zero"));
    assert!(chip.len().abs_diff(simulated.len()) <= 1, "{} and {} rows", chip.len(), simulated.len());
    // The profile begins some milliseconds earlier or later, at another angle; the platform has been through the same.
    let rms = |log: &Log, name: &str| (log.column(name).unwrap().iter().map(|value| value * value).sum::<f64>() / log.len() as f64).sqrt();
    for (name, share) in [("u_V", 0.01), ("i_A", 0.05)] {
        let (chip, simulated) = (rms(&chip, name), rms(&simulated, name));
        assert!((chip / simulated - 1.0).abs() < share, "{name}: {chip} and {simulated}");
    }
    let turned = |log: &Log| log.column("theta_rad").unwrap().windows(2).map(|pair| (pair[1] - pair[0]).abs()).sum::<f64>();
    assert!((turned(&chip) / turned(&simulated) - 1.0).abs() < 0.02, "{} and {} rad", turned(&chip), turned(&simulated));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn emulated_chip_answers_at_a_port_and_keeps_its_settings() {
    let folder = folder();
    let image = image();
    let serve = || Served::new(folder.path(), &["--flash", "flash.bin", "--chip", &image]);
    let chip = serve();
    let asked = |line: &str| send_lines(folder.path(), "port", line).succeeded().out;
    assert!(asked("*IDN?\n").starts_with("Rotary Stand,NUCLEO-F446RE,"));
    asked("SETTings:slip_rad 0.07\nSETTings:SAVE\n");
    chip.signal("INT");
    let mut chip = chip;
    assert!(chip.child.wait().unwrap().success());
    let _again = serve();
    assert!(asked("SETTings:slip_rad?\n").starts_with("0.07"));
}
