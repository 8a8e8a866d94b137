//! `stand settings export|import`: settings of one simulated stand in another, over their serial lines.
#![cfg(unix)]
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use common::served::{Served, send_lines};
use common::{RunOutput, stand};
use stand_acquire::link::SerialLink;
use stand_acquire::serve::Pty;
use stand_acquire::settings::{StandSettings, read};
use stand_firmware::settings::{FIELDS, Kept};

fn settings_of(served: &Served) -> StandSettings {
    read(&mut SerialLink::open(Path::new(&served.port)).unwrap()).unwrap()
}

fn import(folder: &Path, port: &str, file: &str) -> RunOutput {
    stand(folder, &["settings", "import", "--port", port, "--file", file])
}

/// A file that changes every setting by 1 %, with two harmonics and an observer of two states.
fn all_changed() -> String {
    let [mut settings, mut scales] = ["[settings]\n", "[scales]\n"].map(str::to_owned);
    for field in FIELDS {
        let default = (field.read)(&Kept::default());
        // Some defaults are 0.
        let changed = if default == 0.0 { field.least + 0.01 * (field.greatest - field.least).min(1e-3) } else { 1.01 * default };
        let changed = if field.name == "duty_full_scale" { changed.round() } else { changed };
        let group = if field.is_scale { &mut scales } else { &mut settings };
        *group += &format!("{} = {changed:?}\n", field.name);
    }
    format!(
        "format = 1\n{settings}{scales}[compensation]\nharmonics = [{{ order = 7, torque_N_m = {:?}, phase_rad = -0.3 }}, \
         {{ order = 14, torque_N_m = 1e-4, phase_rad = {:?} }}]\n[observer]\nstates = 2\nmoment = false\n\
         phi = [[1.0, 1e-3], [{:?}, 0.97]]\ngamma = [1e-3, {:?}]\ngain = [0.1, 0.3]\nregulator = [-1e-7, 0.0]\ntorquer_N_m_A = 0.0137\n\
         settle_s = 0.7\nvibration = [1.5, 0.1, 0.2]\n",
        1.0 / 3e4,
        1.0 / 7.0,
        -1.0 / 3.0,
        2.0 / 3.0
    )
}

/// The lines of an export without the identity of the stand and the date.
fn lines(export: &str) -> Vec<&str> {
    export.lines().filter(|line| !["model", "serial", "firmware", "exported"].iter().any(|key| line.starts_with(key))).collect()
}

#[test]
fn every_setting_passes_from_one_stand_to_another_and_survives_its_power_off() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("changed.toml"), all_changed()).unwrap();
    let a = Served::new(path, &[]);
    let defaults = settings_of(&a);
    let ran = import(path, &a.port, "changed.toml").succeeded();
    assert!(ran.out.contains(&format!("{} differences:", FIELDS.len() + 3)), "{}", ran.out);
    assert!(ran.out.contains("harmonic of order 7: none → ") && ran.out.contains("observer: none → 2 states"), "{}", ran.out);
    assert!(ran.out.ends_with("scales changed: switch the stand off and on, they act from the next power-on on\n"), "{}", ran.out);
    let changed = settings_of(&a);
    assert_eq!(defaults.differences(&changed).len(), FIELDS.len() + 3, "the file changes all of them");
    let exported = stand(path, &["settings", "export", "--port", &a.port, "--file", "a.toml"]).succeeded();
    assert!(exported.out.contains("2 harmonics") && exported.out.contains("an observer of 2 states"), "{}", exported.out);
    drop(a);

    let mut b = Served::new(path, &["--seed", "2", "--flash", "b.bin"]);
    assert_eq!(settings_of(&b).differences(&defaults), [], "a fresh stand");
    let ran = import(path, &b.port, "a.toml").succeeded();
    let firmware = stand_firmware::VERSION;
    let identities = format!("settings of  simulated,SIM-1,{firmware}\nstand        simulated,SIM-2,{firmware}\n");
    assert!(ran.out.starts_with(&identities), "{}", ran.out);
    assert_eq!(changed.differences(&settings_of(&b)), []);
    assert!(import(path, &b.port, "a.toml").succeeded().out.contains("nothing differs"));
    b.signal("INT");
    assert!(b.child.wait().unwrap().success());

    let b = Served::new(path, &["--seed", "2", "--flash", "b.bin"]);
    assert_eq!(changed.differences(&settings_of(&b)), [], "from its flash");
    let text = stand(path, &["settings", "export", "--port", &b.port]).succeeded().out;
    assert_eq!(lines(&text), lines(&std::fs::read_to_string(path.join("a.toml")).unwrap()));
    // And back to none: the defaults of the first stand delete harmonics and observer.
    let a = Served::new(path, &[]);
    let text = stand(path, &["settings", "export", "--port", &a.port]).succeeded().out;
    std::fs::write(path.join("defaults.toml"), text).unwrap();
    import(path, &b.port, "defaults.toml").succeeded();
    assert_eq!(defaults.differences(&settings_of(&b)), []);
}

/// The mean of a few replies to a query, as a number without its unit.
fn measured(served: &Served, query: &str) -> f64 {
    let mut link = SerialLink::open(Path::new(&served.port)).unwrap();
    link.query(query).unwrap().split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn the_drive_follows_imported_settings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let a = Served::new(path, &[]);
    send_lines(path, &a.port, "SETTings:voltage_limit_V 0.4\nCOMPensation:COULomb 9E-4 N.M\n").succeeded();
    stand(path, &["settings", "export", "--port", &a.port, "--file", "a.toml"]).succeeded();
    let b = Served::new(path, &[]);
    let drive = || {
        send_lines(path, &b.port, "HOST:UNATTended 60;:SOURce:MODE VOLTage;VOLTage 0.9 V\n").succeeded();
        std::thread::sleep(Duration::from_millis(300));
        let voltage_V = measured(&b, "MEASure:VOLTage?");
        send_lines(path, &b.port, "OUTPut OFF\n").succeeded();
        voltage_V
    };
    let before = drive();
    assert!((before - 0.9).abs() < 0.02, "{before}");
    import(path, &b.port, "a.toml").succeeded();
    let after = drive();
    assert!((after - 0.4).abs() < 0.02, "limited as on the first stand: {after}");
    send_lines(path, &b.port, "HOST:UNATTended 60;:SOURce:MODE RATE;RATE 1\n").succeeded();
    std::thread::sleep(Duration::from_millis(300));
    let active = send_lines(path, &b.port, "COMPensation:STATe?\n").succeeded().out;
    assert!(active.trim().split(',').any(|part| part == "friction"), "{active}");
}

#[test]
fn import_is_refused_while_the_drive_is_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let served = Served::new(path, &[]);
    let before = settings_of(&served);
    // The file also removes the compensation, which the console would accept while the drive is on.
    std::fs::write(path.join("slip.toml"), "format = 1\n[settings]\ncoulomb_N_m = 1e-4\n").unwrap();
    send_lines(path, &served.port, "HOST:UNATTended 60;:SOURce:MODE RATE;RATE 1\n").succeeded();
    let ran = import(path, &served.port, "slip.toml");
    assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{ran:?}");
    assert!(ran.err.contains("the drive is on; nothing was written") && ran.err.lines().count() == 1, "{}", ran.err);
    assert_eq!(before.differences(&settings_of(&served)), []);
    assert_eq!(send_lines(path, &served.port, "OUTPut?\n").succeeded().out, "1\n", "the drive is still on");
}

#[test]
fn a_bad_file_is_status_2_and_nothing_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let served = Served::new(path, &[]);
    let before = settings_of(&served);
    let refused = |text: &str, port: &str, expected: &str| {
        std::fs::write(path.join("bad.toml"), text).unwrap();
        let ran = import(path, port, "bad.toml");
        assert_eq!((ran.status, ran.out.as_str()), (Some(2), ""), "{text}: {ran:?}");
        assert!(ran.err.starts_with("stand: bad.toml: ") && ran.err.lines().count() == 1, "{}", ran.err);
        assert!(ran.err.contains(expected), "{expected}: {}", ran.err);
    };
    // The first value is good, and is not sent.
    let wrong = "format = 1\n[settings]\nslip_rad = 0.07\ncurrent_limit_A = -1\n";
    refused(wrong, &served.port, "settings.current_limit_A = -1: expected a number from 0.001");
    refused(wrong, "/dev/ttyABSENT7", "settings.current_limit_A = -1");
    refused("format = 1\n[settings]\nslip_rad = \n", &served.port, "line 3: ");
    // Each value is in its range, but not with the others.
    let torque = "format = 1\n[compensation]\nharmonics = [{ order = 7, torque_N_m = 0.1, phase_rad = 0.0 }]\n";
    refused(torque, &served.port, "compensation.harmonics.torque_N_m = 0.1 is above the maximum");
    assert_eq!(before.differences(&settings_of(&served)), []);
    let absent = import(path, &served.port, "absent.toml");
    assert!(absent.status == Some(2) && absent.err.starts_with("stand: absent.toml: cannot read"), "{absent:?}");
}

/// A device that identifies itself as a stand and is silent from `*LRN?` on, until it is identified again.
fn silent_from_the_list_on(mut pty: Pty, stopped: &Receiver<()>) {
    let (mut heard, mut is_silent) = (Vec::new(), false);
    while stopped.try_recv().is_err() {
        pty.exchange(&mut Vec::new(), &mut heard).unwrap();
        while let Some(end) = heard.iter().position(|byte| *byte == b'\n') {
            let line: Vec<u8> = heard.drain(..=end).collect();
            is_silent = line.starts_with(b"*LRN?") || is_silent && !line.starts_with(b"*IDN?");
            let reply: &[u8] = match &line {
                _ if is_silent => b"",
                line if line.starts_with(b"*IDN?") => b"Rotary Stand,other,1,0.1.0\r\n",
                line if line.starts_with(b"SYSTem:ERRor?") => b"0,\"No error\";1999.0\r\n",
                _ => b"",
            };
            pty.exchange(&mut reply.to_vec(), &mut heard).unwrap();
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_port_that_fails_is_status_1() {
    let folder = tempfile::tempdir().unwrap();
    let pty = Pty::open(None).unwrap();
    let port = pty.path().to_str().unwrap().to_owned();
    let (stop, stopped) = channel();
    let device = std::thread::spawn(move || silent_from_the_list_on(pty, &stopped));
    std::fs::write(folder.path().join("slip.toml"), "format = 1\n[settings]\nslip_rad = 0.07\n").unwrap();
    for words in [["export", "--file", "a.toml"], ["import", "--file", "slip.toml"]] {
        let ran = stand(folder.path(), &[&["settings"], &words[..], &["--port", &port]].concat());
        assert_eq!((ran.status, ran.out.as_str()), (Some(1), ""), "{ran:?}");
        assert!(ran.err.contains("no reply to `*LRN?`") && ran.err.lines().count() == 1, "{}", ran.err);
    }
    assert!(!folder.path().join("a.toml").exists());
    stop.send(()).unwrap();
    device.join().unwrap();
}
