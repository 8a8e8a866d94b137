//! Options about logs of other programs, of every command that reads a log.

use std::path::Path;

use super::common::stand;
use super::{Check, help_everywhere, json_in_both_places, stdout_of};
use identification::log::Log;

pub const WORDS: [(&str, Check); 17] = [
    ("log", |_| ()),
    ("log --help", help_everywhere),
    ("log inspect --help", help_everywhere),
    ("log inspect <FILE> --map --unit --sample-rate --note --accept", |f| {
        foreign(f);
        assert!(stdout_of(f, &["log", "inspect", "log.csv"]).contains("no import is needed"));
        let open = stdout_of(f, &["log", "inspect", "foreign.csv"]);
        assert!(open.contains("Open: no column is known to be the time"), "{open}");
        reads(f, &["log", "inspect"], &["--accept"]);
        assert_eq!(Log::read(f.join("foreign.csv")).unwrap().note("u_V"), Some("terminal"));
    }),
    ("log inspect --json", |f| json_in_both_places(f, &["log", "inspect", "log.csv"])),
    ("compare --map --unit --sample-rate --note", |f| reads(f, &["compare"], &["--model", "model.toml"])),
    ("fit --map --unit --sample-rate --note", |f| reads(f, &["fit"], &["--model", "model.toml"])),
    ("explain --map --unit --sample-rate --note", |f| reads(f, &["explain"], &["--model", "model.toml"])),
    ("allan --map --unit --sample-rate --note", |f| reads(f, &["allan"], &["--column", "omega_rad_s"])),
    ("convert --map --unit --sample-rate --note", |f| reads(f, &["convert"], &["new.parquet"])),
    ("vibration compensate --map --unit --sample-rate --note", |f| is_imported(f, &["vibration", "compensate"], &[])),
    ("observer track --map --unit --sample-rate --note", |f| is_imported(f, &["observer", "track"], &[])),
    ("compensate --map --unit --sample-rate --note", |f| {
        foreign(f);
        let words = ["compensate", "--model", "model.toml", "--stand", "imported.toml", "--log", "foreign.csv"];
        stand(f, &[&words[..], &STATED].concat()).succeeded();
        assert_eq!(Log::read(f.join("foreign.csv")).unwrap().note("u_V"), Some("terminal"));
        assert_eq!(stand(f, &[&words[..], &["--unit", "drive=rpm"]].concat()).status, Some(2));
    }),
    ("drift compute --map --unit --sample-rate --note", |f| is_imported(f, &["drift", "compute"], &[])),
    ("drift advise --map --unit --sample-rate --note", |f| is_imported(f, &["drift", "advise"], &[])),
    ("drift platform --map --unit --sample-rate --note", |f| is_imported(f, &["drift", "platform"], &[])),
    ("stability --map --unit --sample-rate --note", |f| is_imported(f, &["stability"], &[])),
];

/// The log of the folder without its time, the voltage in mV, the rate in rpm: `foreign.csv`.
fn foreign(folder: &Path) {
    let log = Log::read(folder.join("log.csv")).unwrap();
    let column = |name: &str| log.column(name).unwrap();
    let mut text = "drive;turning\n".to_owned();
    for (u, w) in column("u_V").iter().zip(column("omega_rad_s")) {
        text += &format!("{};{}\n", u * 1e3, w * 60.0 / std::f64::consts::TAU).replace('.', ",");
    }
    std::fs::write(folder.join("foreign.csv"), text).unwrap();
}

const STATED: [&str; 12] = [
    "--map",
    "drive=u_V",
    "--unit",
    "drive=mV",
    "--map",
    "turning=omega_rad_s",
    "--unit",
    "turning=rpm",
    "--sample-rate",
    "1000",
    "--note",
    "u_V=terminal",
];

/// The command reads the file with the options, and refuses it without them and with each half of them.
#[track_caller]
fn reads(folder: &Path, command: &[&str], more: &[&str]) {
    is_imported(folder, command, more);
    std::fs::remove_file(folder.join("foreign.import.toml")).unwrap();
    let without_time: Vec<&str> = STATED.iter().copied().filter(|w| !["--sample-rate", "1000"].contains(w)).collect();
    for part in [&[][..], &without_time] {
        assert_eq!(stand(folder, &[command, &["foreign.csv"], more, part].concat()).status, Some(2), "{command:?} {part:?}");
    }
    stand(folder, &[command, &["foreign.csv"], more, &STATED].concat()).succeeded();
}

/// The options are remembered, and the file has the numbers of the log.
#[track_caller]
fn is_imported(folder: &Path, command: &[&str], more: &[&str]) {
    foreign(folder);
    let _ = stand(folder, &[command, &["foreign.csv"], more, &STATED].concat());
    let (own, read) = (Log::read(folder.join("log.csv")).unwrap(), Log::read(folder.join("foreign.csv")).unwrap());
    for name in ["u_V", "omega_rad_s"] {
        let pairs = own.column(name).unwrap().iter().zip(read.column(name).unwrap());
        assert!(pairs.clone().all(|(a, b)| (a - b).abs() < 1e-9), "{command:?}: {name}");
    }
    let _ = std::fs::remove_file(folder.join("new.parquet"));
}
