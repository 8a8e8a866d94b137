//! Every option of the command line changes an output. The table has a line for each option and is compared with `--help`.
#![allow(clippy::unwrap_used)]

mod allan_words;
mod calibrate_words;
mod drift_words;
mod fleet_words;
mod import_words;
mod lab_words;
mod observer_words;
mod records_words;
mod stability_words;

use crate::common;
use crate::common::calibration;
use crate::common::panel;
use std::collections::BTreeSet;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::served::{self, Served};
use common::{folder, stand, with_plots};
use identification::log::Log;
use serde_json::Value;
use tempfile::TempDir;

/// Checks that one word changes an output, in a folder with a log and a model.
type Check = fn(&Path);

/// `command word` as in the help; commands by name alone.
const WORDS: [(&str, Check); 125] = [
    (" --help", help_everywhere),
    (" --version", |f| assert!(stdout_of(f, &["--version"]).starts_with("stand "))),
    ("sim", |f| drop(session(f, &[]))),
    ("sim --help", help_everywhere),
    ("sim --out", |f| {
        let (csv, parquet) = (session(f, &[]), session_in(f, "other.parquet", &[]));
        assert_eq!(csv.columns(), parquet.columns(), "the same numbers, the other form");
        assert!(std::fs::read(f.join("other.parquet")).unwrap().starts_with(b"PAR1"));
    }),
    ("sim --profile", |f| {
        let logs = ["constant", "multi-step", "multisine", "prbs", "chirp", "staircase", "trapezoid", "s-curve", "sine", "turns"]
            .map(|p| session(f, &["--profile", p, "--seconds", "2"]));
        for (k, log) in logs.iter().enumerate() {
            assert!(logs[..k].iter().all(|other| other.columns() != log.columns()), "{:?}", log.note("profile"));
        }
    }),
    ("sim --seconds", |f| assert_eq!((session(f, &[]).len(), session(f, &["--seconds", "0.5"]).len()), (1000, 500))),
    ("sim --mode", |f| {
        let [voltage, rate] = ["voltage", "rate"].map(|m| session(f, &["--mode", m]));
        assert_eq!((voltage.note("mode"), rate.note("mode")), (Some("voltage"), Some("rate")));
        assert_ne!(voltage.column("u_V"), rate.column("u_V"));
    }),
    ("sim --amplitude", |f| {
        let greatest = |log: &Log| log.column("rate_cmd_rad_s").unwrap().iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        let [slow, fast] = ["1", "10"].map(|a| greatest(&session(f, &["--amplitude", a])));
        assert!(slow <= 1.0 && fast > 1.0, "{slow} {fast}");
    }),
    ("sim --offset", |f| {
        let last = *command(f, &["--profile", "constant", "--amplitude", "1", "--offset", "2"]).last().unwrap();
        assert!((last - 3.0).abs() < 1e-8, "within the rounding of a tick's counts: {last}");
    }),
    ("sim --dwell-s --cycles", |f| {
        // One cycle of two dwells of 0.1 s with 0.1 s of slopes ends after 0.4 s.
        let words = ["--profile", "trapezoid", "--amplitude", "1", "--acceleration", "10", "--dwell-s", "0.1", "--cycles"];
        let [once, on] = ["1", "0"].map(|n| command(f, &[&words[..], &[n]].concat()));
        assert!(once[500..].iter().all(|v| *v == 0.0) && on[500..].iter().any(|v| *v > 0.9));
    }),
    ("sim --levels", |f| {
        let words = ["--profile", "staircase", "--amplitude", "4", "--dwell-s", "0.4", "--levels"];
        let [one, four] = ["1", "4"].map(|n| command(f, &[&words[..], &[n]].concat())[750]);
        assert!((one - 4.0).abs() < 0.1 && (four - 1.0).abs() < 0.1, "{one} {four}");
    }),
    ("sim --bit-s", |f| differ(f, &["--profile", "prbs", "--bit-s"], ["0.1", "0.2"])),
    ("sim --from-hz --to-hz --sweep-s", |f| {
        differ(f, &["--profile", "chirp", "--from-hz"], ["0.1", "0.5"]);
        differ(f, &["--profile", "chirp", "--to-hz"], ["1", "5"]);
        differ(f, &["--profile", "chirp-linear", "--sweep-s"], ["1", "10"]);
    }),
    ("sim --frequency-hz", |f| differ(f, &["--profile", "sine", "--frequency-hz"], ["1", "2"])),
    ("sim --acceleration --jerk", |f| {
        differ(f, &["--profile", "alternating", "--acceleration"], ["10", "20"]);
        differ(f, &["--profile", "s-curve", "--jerk"], ["100", "200"]);
    }),
    ("sim --turns", |f| {
        let log = session(f, &["--profile", "turns", "--amplitude", "20", "--acceleration", "55", "--turns", "2", "--seconds", "1.6"]);
        let angle = log.column("theta_cmd_rad").unwrap();
        let turned = angle.last().unwrap() - angle[0];
        assert!((turned - 2.0 * std::f64::consts::TAU).abs() < 3.2e-4, "two turns to an encoder count: {turned}");
        assert_eq!(log.note("profile_turns"), Some("2"));
    }),
    ("sim --hidden", |f| {
        let logs: Vec<Log> = [&[][..], &["--hidden", "cogging"], &["--hidden", "7"], &["--hidden", "9"]].map(|w| session(f, w)).into();
        for (k, log) in logs.iter().enumerate() {
            assert!(logs[..k].iter().all(|other| other.columns() != log.columns()), "{k}");
        }
        assert_eq!(logs[2].columns(), session(f, &["--hidden", "7"]).columns(), "the same number hides the same");
        let notes = |log: &Log| log.notes().iter().filter(|(k, _)| k != "date").cloned().collect::<Vec<_>>();
        assert!(notes(&logs[1]).iter().all(|(k, v)| !k.contains("cogging") && !v.contains("cogging")), "the notes do not name it");
    }),
    ("sim --reveal", |f| {
        let words = ["sim", "--out", "s.csv", "--force", "--seconds", "0.1", "--hidden", "cogging"];
        let with = |more: &[&str]| stdout_of(f, &[&words[..], more].concat());
        assert!(!with(&[]).contains("cogging"), "{}", with(&[]));
        assert!(with(&["--reveal"]).contains("cogging_N_m"), "{}", with(&["--reveal"]));
        let answer = |more: &[&str]| json(f, &[&words[..], more].concat());
        assert_eq!(answer(&[])["hidden"], Value::Null);
        assert_eq!(answer(&["--reveal"])["hidden"]["effect"], "cogging");
    }),
    ("sim --stand", |f| {
        std::fs::write(f.join("stand.toml"), "name = \"heavy\"\n[drive]\ninertia_kg_m2 = 5e-4\n").unwrap();
        let (usual, heavy) = (session(f, &[]), session(f, &["--stand", "stand.toml"]));
        assert_ne!(usual.columns(), heavy.columns());
        assert_eq!(heavy.note("stand"), Some("heavy"));
    }),
    ("sim --seed", |f| {
        let [one, again, two] = ["1", "1", "2"].map(|s| session(f, &["--seed", s]));
        assert_eq!(one.columns(), again.columns());
        assert_ne!(one.columns(), two.columns());
        assert_eq!(two.note("seed"), Some("2"));
    }),
    ("sim --json", |f| json_in_both_places(f, &["sim", "--out", "s.csv", "--force", "--seconds", "0.1"])),
    #[cfg(unix)]
    ("sim --speed", |f| {
        for bad in ["0", "6", "nan"] {
            let refused = stand(f, &["sim", "--serve", "pty", "--speed", bad]);
            assert!(refused.status == Some(2) && refused.err.contains("--speed"), "{}", refused.err);
        }
        // Four seconds of the board.
        let seconds = |speed: &str| {
            let one = Served::new(f, &["--speed", speed]);
            let begun = std::time::Instant::now();
            stand(f, &["record", "--port", &one.port, "--out", "s.csv", "--force", "--seconds", "4"]).succeeded();
            begun.elapsed().as_secs_f64()
        };
        let (usual, fast) = (seconds("1"), seconds("5"));
        assert!(usual > 4.0 && fast < usual - 1.0, "{usual} {fast}");
    }),
    #[cfg(unix)]
    ("sim --chip", |f| {
        // With an image: serial_line.rs.
        let without = stand(f, &["sim", "--serve", "pty", "--chip"]);
        assert!(without.status == Some(2) && without.err.contains("scripts/build-firmware.sh"), "{}", without.err);
        std::fs::write(f.join("notes.elf"), "not an image").unwrap();
        let wrong = stand(f, &["sim", "--serve", "pty", "--chip", "notes.elf"]);
        assert!(wrong.status == Some(2) && wrong.err.contains("notes.elf: not an ELF image"), "{}", wrong.err);
        // No option of a served stand is ignored.
        for option in ["--chip", "--link", "--flash", "--gyro"] {
            assert_eq!(stand(f, &["sim", "--out", "log.csv", "--force", option, "x"]).status, Some(2), "{option}");
        }
    }),
    ("sim --serve --link --flash", |f| {
        let mut one = Served::new(f, &["--flash", "flash.bin"]);
        assert!(one.port.starts_with('/') && f.join("port").exists());
        served::send_lines(f, "port", "SETTings:slip_rad 0.2;SAVE\n").succeeded();
        one.signal("INT");
        assert!(one.child.wait().unwrap().success());
        assert!(std::fs::read(f.join("flash.bin")).unwrap().iter().any(|byte| *byte != 0xff), "the saved settings are in it");
    }),
    ("console --help", help_everywhere),
    #[cfg(unix)]
    ("console --port", |f| {
        let one = Served::new(f, &[]);
        assert!(served::send_lines(f, &one.port, "*IDN?\n").succeeded().out.starts_with("Rotary Stand"));
    }),
    #[cfg(unix)]
    ("console --json", |f| {
        let one = Served::new(f, &[]);
        std::fs::write(f.join("script"), "*OPC?\n").unwrap();
        let script = std::fs::File::open(f.join("script")).unwrap();
        let said = common::command(f, &["console", "--port", &one.port, "--json", "-"]).stdin(script).output().unwrap().stdout;
        let said: Value = serde_json::from_slice(&said).unwrap();
        assert_eq!(said[0]["replies"][0], "1");
    }),
    ("panel --help", help_everywhere),
    #[cfg(unix)]
    ("panel --port --folder --listen", |f| {
        let one = Served::new(f, &[]);
        let free = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let shown = panel::Panel::new(f, &["--port", &one.port, "--folder", "session", "--listen", &free.to_string()]);
        assert_eq!(shown.port, free);
        assert_eq!(shown.page().state["port"], one.port.as_str());
        assert!(f.join("session/model.toml").exists() && f.join("session/commands.txt").exists());
        let taken = stand(f, &["panel", "--port", &one.port]);
        assert!(taken.status == Some(2) && taken.err.contains("uses this port"), "{taken:?}");
    }),
    #[cfg(unix)]
    ("panel --stand --hidden", |f| {
        std::fs::write(f.join("panel-stand.toml"), "[drive]\nsupply_V = 12.6\n").unwrap();
        let shown = panel::Panel::new(f, &["--stand", "panel-stand.toml", "--hidden", "cogging"]);
        let supply = shown.page().command(&shown, "MEASure:SUPPly?")["replies"][0].as_str().unwrap().parse::<f64>().unwrap();
        assert!((supply - 12.6).abs() < 0.2, "{supply}");
        for word in ["--stand", "--hidden"] {
            let refused = stand(f, &["panel", word, "nothing"]);
            assert!(refused.status == Some(2) && refused.err.lines().count() == 1, "{refused:?}");
        }
    }),
    ("record --help", help_everywhere),
    #[cfg(unix)]
    ("record --port --out --seconds --mode --decimation --note --find-index --json", |f| {
        let one = Served::new(f, &[]);
        let words = ["record", "--port", &one.port, "--out", "r.csv", "--force", "--seconds", "0.4"];
        let with = |more: &[&str]| {
            stand(f, &[&words[..], more].concat()).succeeded();
            Log::read(f.join("r.csv")).unwrap()
        };
        let usual = with(&[]);
        assert!(usual.len() == 400 && usual.column("rate_cmd_rad_s").is_some() && !usual.theta_zero_is_index());
        assert!(with(&["--mode", "voltage"]).column("rate_cmd_rad_s").is_none());
        assert_eq!(with(&["--decimation", "4"]).len(), 100);
        assert_eq!(with(&["--note", "operator=Ann"]).note("operator"), Some("Ann"));
        assert!(with(&["--find-index"]).theta_zero_is_index());
        assert_eq!(json(f, &words)["samples"], 400);
    }),
    #[cfg(unix)]
    ("record --profile --amplitude --offset --seed --dwell-s --levels --bit-s --from-hz --to-hz --sweep-s --frequency-hz", |f| {
        let all: [(&str, &[(&str, &str)]); 5] = [
            ("staircase", &[("amplitude", "3"), ("offset", "0.5"), ("dwell_s", "0.7"), ("levels", "4")]),
            ("prbs", &[("bit_s", "0.2")]),
            ("multi-step", &[("seed", "9")]),
            ("chirp", &[("from_Hz", "0.2"), ("to_Hz", "0.8"), ("sweep_s", "7")]),
            ("sine", &[("frequency_Hz", "0.75")]),
        ];
        all.iter().for_each(|(profile, parameters)| recorded_with(f, profile, parameters));
    }),
    #[cfg(unix)]
    ("record --acceleration --jerk --cycles --turns", |f| {
        recorded_with(f, "alternating", &[("amplitude", "2"), ("acceleration", "11"), ("jerk", "222"), ("cycles", "3")]);
        recorded_with(f, "turns", &[("amplitude", "3"), ("turns", "4")]);
    }),
    #[cfg(unix)]
    // What --no-trial leaves out is in serial_line.rs.
    ("compensate --port --save --no-trial", |f| {
        let one = Served::new(f, &["--flash", "flash.bin"]);
        stand(f, &["compensate", "--model", "model.toml", "--port", &one.port, "--save", "--no-trial"]).succeeded();
        let asked = |port: &str| served::send_lines(f, port, "COMPensation:COULomb?\n").succeeded().out;
        let written = asked(&one.port);
        assert!(!written.starts_with("0 "), "{written}");
        served::send_lines(f, &one.port, "SETTings:LOAD\n").succeeded();
        assert_eq!(asked(&one.port), written, "it was saved");
    }),
    ("settings --help", help_everywhere),
    ("settings export --help", help_everywhere),
    ("settings import --help", help_everywhere),
    #[cfg(unix)]
    ("settings export --port --file", |f| {
        let one = Served::new(f, &[]);
        let printed = stdout_of(f, &["settings", "export", "--port", &one.port]);
        stdout_of(f, &["settings", "export", "--port", &one.port, "--file", "settings.toml"]);
        let without_date = |text: &str| text.lines().filter(|line| !line.starts_with("exported")).map(str::to_owned).collect::<Vec<_>>();
        let written = std::fs::read_to_string(f.join("settings.toml")).unwrap();
        assert_eq!(without_date(&printed), without_date(&written));
    }),
    #[cfg(unix)]
    ("settings import --port --file", |f| {
        let one = Served::new(f, &[]);
        std::fs::write(f.join("slip.toml"), "format = 1\n[settings]\nslip_rad = 0.07\n").unwrap();
        stdout_of(f, &["settings", "import", "--port", &one.port, "--file", "slip.toml"]);
        assert!(served::send_lines(f, &one.port, "SETTings:slip_rad?\n").succeeded().out.starts_with("0.07"));
    }),
    #[cfg(unix)]
    ("settings export --json", |f| {
        let one = Served::new(f, &[]);
        json_in_both_places(f, &["settings", "export", "--port", &one.port]);
    }),
    #[cfg(unix)]
    ("settings import --json", |f| {
        let one = Served::new(f, &[]);
        std::fs::write(f.join("slip.toml"), "format = 1\n[settings]\nslip_rad = 0.07\n").unwrap();
        let words = ["settings", "import", "--port", &one.port, "--file", "slip.toml"];
        stdout_of(f, &words);
        json_in_both_places(f, &words);
    }),
    ("compare", |f| assert!(stdout_of(f, &["compare", "log.csv", "--model", "model.toml"]).contains("omega_rad_s"))),
    ("compare --help", help_everywhere),
    ("compare <LOG>...", |f| another_log(f, "compare")),
    ("compare --out-series", |f| series(f, &["compare", "log.csv", "--model", "model.toml"])),
    ("compare --model", |f| another_model(f, "compare")),
    ("compare --json", |f| json_in_both_places(f, &["compare", "log.csv", "--model", "model.toml"])),
    ("compare --html --plots", |f| page(f, &["compare", "log.csv", "--model", "model.toml"])),
    ("fit", |f| assert!(stdout_of(f, &["fit", "log.csv", "--model", "model.toml"]).contains("inertia_kg_m2"))),
    ("fit --help", help_everywhere),
    ("fit <LOG>...", |f| another_log(f, "fit")),
    ("fit --out-series", |f| series(f, &["fit", "log.csv", "--model", "model.toml"])),
    ("explain --out-series", |f| series(f, &["explain", "log.csv", "--model", "model.toml"])),
    ("fit --model", |f| another_model(f, "fit")),
    ("fit --out", |f| {
        let answer = json(f, &["fit", "log.csv", "--model", "model.toml", "--out", "fitted.toml"]);
        let written = identification::model::Model::read(f.join("fitted.toml")).unwrap();
        for (name, found) in answer["parameters"].as_object().unwrap() {
            let (written, found) = (written.value(name).unwrap(), found["value"].as_f64().unwrap());
            assert!((written / found - 1.0).abs() < 1e-6, "{name}: {written} written, {found} reported");
        }
    }),
    ("fit --all-rows", |f| {
        // Six seconds is the shortest log with held-out blocks.
        stand(f, &["sim", "--out", "long.csv", "--seconds", "8"]).succeeded();
        let held_out = |more: &[&str]| {
            json(f, &[&["fit", "long.csv", "--model", "model.toml"], more].concat())["outputs"]["i_A"]["heldout_rms"].clone()
        };
        assert!(held_out(&[]).is_f64());
        assert_eq!(held_out(&["--all-rows"]), Value::Null);
    }),
    ("fit --equation-error", |f| {
        // A winding's inductance is not in an equation evaluated row by row.
        let refused = stand(f, &["fit", "log.csv", "--model", "model.toml", "--equation-error"]);
        assert_eq!(refused.status, Some(2));
        assert!(refused.err.contains("inductance"), "{}", refused.err);
        let answer = json(f, &["fit", "log.csv", "--model", &inverse_model(f), "--equation-error"]);
        assert!(answer["outputs"]["i_A"]["error_percent"].is_f64(), "{answer}");
        let [row_by_row, free] = [&answer, &answer["free_run"]].map(|a| a["parameters"]["inertia_kg_m2"]["value"].as_f64().unwrap());
        assert_ne!(row_by_row, free);
        assert!((row_by_row / free - 1.0).abs() < 0.2, "{row_by_row} beside {free}: of the same drive");
    }),
    ("fit --cutoff-hz", |f| {
        let model = inverse_model(f);
        let inertia = |hz: &str| {
            let words = ["fit", "log.csv", "--model", &model, "--equation-error", "--cutoff-hz", hz];
            json(f, &words)["parameters"]["inertia_kg_m2"]["value"].clone()
        };
        assert_ne!(inertia("20"), inertia("40"));
        assert_eq!(stand(f, &["fit", "log.csv", "--model", &model, "--equation-error", "--cutoff-hz", "900"]).status, Some(2));
    }),
    ("fit --json", |f| json_in_both_places(f, &["fit", "log.csv", "--model", "model.toml"])),
    ("fit --time-limit", |f| timed_out(f, &["fit", "log.csv", "--model", "model.toml"])),
    ("fit --html --plots", |f| page(f, &["fit", "log.csv", "--model", "model.toml"])),
    ("convert", |f| drop(stdout_of(f, &["convert", "log.csv", "c.parquet", "--force"]))),
    ("convert --help", help_everywhere),
    ("convert <LOG> <OUT>", |f| {
        // An unknown column and a wrapped angle stay; CSV to Parquet and back gives the same bytes.
        let text = "# stand: bench 3\nt_s,theta_rad,pulse_flag\n0,6.2,0\n0.1,0.1,1\n0.25,0.30000000000000004,1e-300\n";
        std::fs::write(f.join("own.csv"), text).unwrap();
        stdout_of(f, &["convert", "own.csv", "own.parquet"]);
        stdout_of(f, &["convert", "own.parquet", "back.csv"]);
        let back = std::fs::read_to_string(f.join("back.csv")).unwrap();
        let without_end: String = back
            .split_inclusive('\n')
            .filter(|line| !["# ends_with", "# rows", "# sha256"].iter().any(|key| line.starts_with(key)))
            .collect();
        assert_eq!(without_end, text);
        stdout_of(f, &["convert", "log.csv", "l.parquet"]);
        stdout_of(f, &["convert", "l.parquet", "l.csv"]);
        assert_eq!(std::fs::read(f.join("l.csv")).unwrap(), std::fs::read(f.join("log.csv")).unwrap());
        // A log that was cut short says so in the new file.
        let whole = std::fs::read_to_string(f.join("log.csv")).unwrap();
        std::fs::write(f.join("cut.csv"), &whole[..whole.find("# rows").unwrap()]).unwrap();
        assert!(stdout_of(f, &["convert", "cut.csv", "cut.parquet"]).contains("the end of the log is missing"));
        assert!(Log::read(f.join("cut.parquet")).unwrap().note("ended").unwrap().contains("the end of cut.csv is missing"));
        assert_eq!(stand(f, &["convert", "log.csv", "log.txt"]).status, Some(2));
    }),
    ("convert --force", |f| overwritten(f, "convert log.csv", "new.parquet")),
    ("convert --json", |f| json_in_both_places(f, &["convert", "log.csv", "c.parquet", "--force"])),
    ("sim --force", |f| overwritten(f, "sim --seconds 0.1 --out", "new.csv")),
    ("fit --force", |f| overwritten(f, "fit log.csv --model model.toml --out", "new.toml")),
    ("explain --force", |f| overwritten(f, "explain log.csv --model model.toml --out", "new.toml")),
    ("calibrate --force", |f| overwritten(f, "calibrate gyro --write-session", "new.toml")),
    ("drift run --force", |f| overwritten(f, "drift run --cycles 2 --pulse 1 --rest 2 --out", "new.csv")),
    #[cfg(unix)]
    ("record --force", |f| {
        let one = Served::new(f, &[]);
        overwritten(f, &format!("record --port {} --seconds 0.2 --out", one.port), "new.csv");
    }),
    #[cfg(unix)]
    ("settings export --force", |f| {
        let one = Served::new(f, &[]);
        overwritten(f, &format!("settings export --port {} --file", one.port), "new.toml");
    }),
    ("compensate", |f| assert!(stdout_of(f, &compensated("model.toml", "a.toml")).contains("[firmware.compensation] written"))),
    ("compensate --help", help_everywhere),
    ("compensate --model", |f| {
        let dry = |model: &str, to: &str| json(f, &compensated(model, to))["compensation"]["coulomb_N_m"].clone();
        std::fs::copy(f.join("model.toml"), f.join("rough.toml")).unwrap();
        stdout_of(f, &["model", "set", "rough.toml", "coulomb_N_m", "2e-3"]);
        assert_ne!(dry("model.toml", "a.toml"), dry("rough.toml", "b.toml"));
    }),
    ("compensate --log", |f| {
        std::fs::copy(f.join("model.toml"), f.join("teeth.toml")).unwrap();
        stdout_of(f, &["model", "add", "teeth.toml", "cogging"]);
        let words = compensated("teeth.toml", "a.toml");
        assert_eq!(stand(f, &words).status, Some(2), "phases of nowhere");
        assert!(!f.join("a.toml").exists(), "and nothing is written");
        let cogging = |order: u16| format!("[effects.coulomb]\n[effects.cogging]\ncogging_N_m = 1e-3\ncogging_order = {order}\n");
        std::fs::write(f.join("a.toml"), cogging(7)).unwrap();
        stdout_of(f, &[&words[..], &["--log", "log.csv"]].concat());
        assert!(std::fs::read_to_string(f.join("a.toml")).unwrap().contains("order = 7"));
        // The same on a stand with 14 teeth.
        std::fs::write(f.join("b.toml"), cogging(14)).unwrap();
        let words = compensated("teeth.toml", "b.toml");
        let worse = stand(f, &[&words[..], &["--log", "log.csv"]].concat());
        assert_eq!(worse.status, Some(1), "{worse:?}");
        assert!(
            worse.err.contains("b.toml: the compensation makes the ripple of the rate larger") && worse.err.contains("nothing was written"),
            "{worse:?}"
        );
        assert!(
            worse.out.contains("larger at 10 °/s: order 7") && worse.out.contains("the largest order of this stand before, at 10 °/s: 14"),
            "{worse:?}"
        );
        assert_eq!(std::fs::read_to_string(f.join("b.toml")).unwrap(), cogging(14));
    }),
    ("compensate --measure-cogging", |f| {
        std::fs::write(f.join("a.toml"), "[effects.coulomb]\n[effects.cogging]\ncogging_N_m = 2e-3\ncogging_order = 9\n").unwrap();
        let answer = json(f, &["compensate", "--measure-cogging", "--stand", "a.toml"]);
        assert_eq!((&answer["source"], &answer["compensation"]["harmonics"][0]["order"]), (&Value::from("measured"), &Value::from(9)));
    }),
    ("compensate --stand", |f| {
        stdout_of(f, &compensated("model.toml", "here.toml"));
        assert!(std::fs::read_to_string(f.join("here.toml")).unwrap().contains("[firmware.compensation]"));
        // The written settings are those of the stand's run.
        assert!(session(f, &["--stand", "here.toml"]).note("compensation").unwrap().starts_with("friction"));
    }),
    ("compensate --seed", |f| {
        let dry = |seed: &str| {
            let words = ["compensate", "--measure-cogging", "--stand", &format!("{seed}.toml"), "--seed", seed];
            json(f, &words)["compensation"]["coulomb_N_m"].clone()
        };
        assert_ne!(dry("1"), dry("2"), "other noise of the current");
    }),
    ("compensate --json", |f| {
        // A first run, so that both compared runs find the same file.
        stdout_of(f, &compensated("model.toml", "a.toml"));
        json_in_both_places(f, &compensated("model.toml", "a.toml"));
    }),
    ("explain", |f| assert!(stdout_of(f, &["explain", "log.csv", "--model", "model.toml"]).contains("omega_rad_s"))),
    ("explain --help", help_everywhere),
    ("explain <LOG>...", |f| {
        stand(f, &["sim", "--out", "other.csv", "--force", "--seconds", "3", "--seed", "2"]).succeeded();
        let samples = |logs: &[&str]| json(f, &[&["explain"], logs, &["--model", "model.toml"]].concat())["samples"].clone();
        assert_eq!((samples(&["log.csv"]), samples(&["log.csv", "other.csv"])), (3000.into(), 6000.into()));
    }),
    ("explain --model", |f| {
        stdout_of(f, &["model", "new", "bare.toml", "--effects", "viscous,coulomb"]);
        let steps = |model: &str| json(f, &["explain", "log.csv", "--model", model])["steps"].clone();
        assert_ne!(steps("model.toml"), steps("bare.toml"));
    }),
    ("explain --apply --out", |f| {
        stand(f, &["sim", "--out", "load.csv", "--force", "--seconds", "3", "--hidden", "load"]).succeeded();
        let before = std::fs::read(f.join("model.toml")).unwrap();
        stdout_of(f, &["explain", "load.csv", "--model", "model.toml", "--out", "better.toml"]);
        assert_eq!(before, std::fs::read(f.join("model.toml")).unwrap());
        stdout_of(f, &["explain", "load.csv", "--model", "model.toml", "--apply"]);
        assert_eq!(std::fs::read(f.join("better.toml")).unwrap(), std::fs::read(f.join("model.toml")).unwrap());
        assert_ne!(before, std::fs::read(f.join("model.toml")).unwrap());
    }),
    ("explain --json", |f| json_in_both_places(f, &["explain", "log.csv", "--model", "model.toml"])),
    ("explain --effort", |f| {
        let cut = stand(f, &["explain", "log.csv", "--model", "model.toml", "--effort", "1", "--json", "-"]);
        let answer = cut.json();
        assert!(cut.status == Some(1) && answer["verdict"] == "not-finished" && answer["open"].is_string(), "{cut:?}");
        assert!(cut.err.contains("--continue log.search.toml") && f.join("log.search.toml").exists(), "{}", cut.err);
    }),
    ("explain --continue", |f| {
        let words = ["explain", "log.csv", "--model", "model.toml"];
        assert_eq!(stand(f, &[&words[..], &["--effort", "1"]].concat()).status, Some(1));
        let continued = json(f, &[&words[..], &["--continue", "log.search.toml"]].concat());
        assert_eq!((&continued["verdict"], &continued["parameters"]), (&json(f, &words)["verdict"], &json(f, &words)["parameters"]));
        stdout_of(f, &["model", "add", "model.toml", "load"]);
        let other = stand(f, &[&words[..], &["--continue", "log.search.toml"]].concat());
        assert!(other.status == Some(2) && other.err.contains("another model"), "{other:?}");
        std::fs::write(f.join("text.toml"), "x = 1").unwrap();
        let none = stand(f, &[&words[..], &["--continue", "text.toml"]].concat());
        assert!(none.status == Some(2) && none.err.contains("text.toml: this is no state of a search"), "{none:?}");
    }),
    ("model new --axis", |f| {
        let shown = stdout_of(f, &["model", "new", "line.toml", "--axis", "linear"]);
        assert!(std::fs::read_to_string(f.join("line.toml")).unwrap().contains("mass_kg"), "{shown}");
    }),
    ("explain --time-limit", |f| timed_out(f, &["explain", "log.csv", "--model", "model.toml"])),
    ("explain --html --plots", |f| page(f, &["explain", "log.csv", "--model", "model.toml"])),
    ("model", |f| drop(stdout_of(f, &["model", "show", "model.toml"]))),
    ("model --help", help_everywhere),
    ("model new", |f| assert!(stdout_of(f, &["model", "new", "new.toml"]).contains("effects  none"))),
    ("model new --help", help_everywhere),
    ("model new <MODEL>", |f| {
        stdout_of(f, &["model", "new", "here.toml"]);
        assert!(f.join("here.toml").exists());
    }),
    ("model new --input", |f| {
        for input in ["u_V", "i_A", "torque_N_m", "theta_rad"] {
            assert!(stdout_of(f, &["model", "new", &format!("{input}.toml"), "--input", input]).contains(&format!("input    {input}")));
        }
    }),
    ("model new --effects", |f| {
        assert!(stdout_of(f, &["model", "new", "two.toml", "--effects", "viscous,cogging"]).contains("viscous, cogging"))
    }),
    ("model new --force", |f| {
        std::fs::copy(f.join("model.toml"), f.join("there.toml")).unwrap();
        assert_eq!(stand(f, &["model", "new", "there.toml"]).status, Some(2));
        assert!(stdout_of(f, &["model", "new", "there.toml", "--force"]).contains("effects  none"));
    }),
    ("model show", |f| assert!(stdout_of(f, &["model", "show", "model.toml"]).contains("viscous, coulomb, inductance"))),
    ("model show --json", |f| json_in_both_places(f, &["model", "show", "model.toml"])),
    ("model new --json", |f| assert_eq!(json(f, &["model", "new", "a.toml"])["input"], "u_V")),
    ("model add --json", |f| assert_eq!(json(f, &["model", "add", "model.toml", "cogging"])["effects"][3], "cogging")),
    ("model remove --json", |f| assert_eq!(json(f, &["model", "remove", "model.toml", "viscous"])["effects"][0], "coulomb")),
    ("model set --json", |f| {
        let set = json(f, &["model", "set", "model.toml", "inertia_kg_m2", "3e-4"]);
        assert_eq!(set["parameters"]["inertia_kg_m2"]["value"], 3e-4);
    }),
    ("model show --help", help_everywhere),
    ("model show <MODEL>", |f| {
        assert_eq!(stand(f, &["model", "show", "other.toml"]).status, Some(2));
    }),
    ("model add --help", help_everywhere),
    ("model add <MODEL> <EFFECT>", |f| {
        assert!(edited(f, &["add"], &["cogging"]).contains("viscous, coulomb, inductance, cogging\n"));
        assert!(edited(f, &["add"], &["viscous"]).contains("viscous#2"), "a repeated effect is numbered");
    }),
    ("model remove --help", help_everywhere),
    ("model remove <MODEL> <EFFECT>", |f| {
        let shown = edited(f, &["remove"], &["coulomb"]);
        assert!(shown.contains("viscous, inductance\n") && !shown.contains("coulomb_N_m"), "{shown}");
    }),
    ("model set --help", help_everywhere),
    ("model set <MODEL> <PARAMETER> <VALUE> --fixed --free", |f| {
        let line = |words: &[&str]| {
            let shown = edited(f, &["set"], words);
            shown.lines().find(|l| l.trim_start().starts_with(words[0])).unwrap().to_owned()
        };
        assert!(line(&["viscous_N_m_s", "0.5"]).contains("0.5"));
        assert!(line(&["coulomb_N_m", "0.5"]).contains("0.5"));
        assert!(line(&["viscous_N_m_s", "0.5", "--fixed"]).contains("fixed"));
        stdout_of(f, &["model", "set", "edited.toml", "viscous_N_m_s", "0.5", "--fixed"]);
        let freed = stdout_of(f, &["model", "set", "edited.toml", "viscous_N_m_s", "0.5", "--free"]);
        assert!(!freed.contains("fixed"), "{freed}");
    }),
    ("effects --help", help_everywhere),
    ("effects [ID] --json", |f| {
        let ids = |answer: &Value| answer.to_string();
        let all = json(f, &["effects"]);
        for card in drive_model::cards() {
            assert!(stdout_of(f, &["effects"]).contains(card.id), "{}", card.id);
            assert!(ids(&all).contains(&format!("\"{}\"", card.id)), "{}", card.id);
        }
        let one = stdout_of(f, &["effects", "cogging"]);
        assert!(one.contains("cogging_N_m") && !one.contains("rate_bias_rad_s"), "{one}");
        json_in_both_places(f, &["effects"]);
        json_in_both_places(f, &["effects", "cogging"]);
    }),
    ("effects --html --plots", |f| {
        page(f, &["effects"]);
        page(f, &["effects", "cogging"]);
    }),
    ("schema --help", help_everywhere),
    ("schema [COMMAND]...", |f| {
        let json = |words: &[&str]| serde_json::from_str::<serde_json::Value>(&stdout_of(f, words)).unwrap();
        let (all, one) = (json(&["schema"]), json(&["schema", "observer", "design"]));
        assert!(all.as_object().unwrap().len() > 35 && all["observer design"] == one && one["properties"]["gains"].is_object(), "{one}");
        let refused = stand(f, &["schema", "explan"]);
        assert!(refused.status == Some(2) && refused.err.contains("did you mean `explain`"), "{}", refused.err);
    }),
    ("completions --help", help_everywhere),
    ("completions <SHELL>", |f| {
        let scripts = ["bash", "zsh", "fish", "powershell", "elvish"].map(|shell| stdout_of(f, &["completions", shell]));
        for (k, script) in scripts.iter().enumerate() {
            assert!(script.contains("explain") && !scripts[..k].contains(script));
        }
    }),
    ("man --help", help_everywhere),
    ("man --out", |f| {
        let page = stdout_of(f, &["man"]);
        assert_eq!(stdout_of(f, &["man", "--out", "pages"]), "");
        assert_eq!(std::fs::read_to_string(f.join("pages/stand.1")).unwrap(), page);
    }),
];

/// A model of the default stand that is linear in its parameters, driven by the current.
fn inverse_model(folder: &Path) -> String {
    let text = "[drive]\ninput = \"i_A\"\neffects = [\"viscous\", \"coulomb\"]\n[parameters]\ninertia_kg_m2 = 2.2e-4\n\
        motor_constant_N_m_A = { value = 0.0234, fixed = true }\nviscous_N_m_s = 1e-5\ncoulomb_N_m = 8.6e-4\n";
    std::fs::write(folder.join("inverse.toml"), text).unwrap();
    "inverse.toml".to_owned()
}

/// Standard output of a successful command.
#[track_caller]
fn stdout_of(folder: &Path, words: &[&str]) -> String {
    stand(folder, words).succeeded().out
}

/// The JSON on standard output, without other text.
#[track_caller]
fn json(folder: &Path, words: &[&str]) -> Value {
    stand(folder, &[words, &["--json", "-"]].concat()).succeeded().json()
}

/// Arguments that write a model's compensation into a stand's file.
fn compensated<'a>(model: &'a str, stand: &'a str) -> [&'a str; 5] {
    ["compensate", "--model", model, "--stand", stand]
}

/// Asserts that `words` with a file write it, that it is not overwritten, and that --force overwrites it.
#[track_caller]
fn overwritten(folder: &Path, words: &str, file: &str) {
    let words: Vec<&str> = words.split(' ').chain([file]).collect();
    stand(folder, &words).succeeded();
    std::fs::write(folder.join(file), "previous").unwrap();
    let refused = stand(folder, &words);
    assert!(refused.status == Some(2) && refused.err.contains("the file exists; --force"), "{refused:?}");
    assert_eq!(std::fs::read_to_string(folder.join(file)).unwrap(), "previous");
    stand(folder, &[&words[..], &["--force"]].concat()).succeeded();
    assert_ne!(std::fs::read(folder.join(file)).unwrap(), b"previous");
}

/// One second of a session with these arguments.
fn session(folder: &Path, words: &[&str]) -> Log {
    session_in(folder, "session.csv", words)
}

/// Asserts that a short recording with these parameters sets them on the stand.
fn recorded_with(folder: &Path, profile: &str, parameters: &[(&str, &str)]) {
    let one = Served::new(folder, &[]);
    let options: Vec<String> =
        parameters.iter().flat_map(|(name, value)| [format!("--{}", name.to_lowercase().replace('_', "-")), value.to_string()]).collect();
    let mut words = vec!["record", "--port", &one.port, "--out", "r.csv", "--force", "--seconds", "0.2", "--profile", profile];
    words.extend(options.iter().map(String::as_str));
    stand(folder, &words).succeeded();
    assert_eq!(Log::read(folder.join("r.csv")).unwrap().note("profile"), Some(profile));
    assert_eq!(served::send_lines(folder, &one.port, "PROFile:TYPE?\n").out.trim(), profile);
    for (name, value) in parameters {
        let shown = served::send_lines(folder, &one.port, &format!("PROFile:{name}?\n")).succeeded().out;
        assert_eq!(shown.split_whitespace().next(), Some(*value), "{profile} {name}: {shown}");
    }
}

/// The rate command of a one-second session with these arguments, rad/s.
fn command(folder: &Path, words: &[&str]) -> Vec<f64> {
    session(folder, words).column("rate_cmd_rad_s").unwrap().to_vec()
}

/// Asserts that two values of the last argument give different commands.
#[track_caller]
fn differ(folder: &Path, words: &[&str], values: [&str; 2]) {
    let [one, other] = values.map(|value| command(folder, &[words, &[value]].concat()));
    assert_ne!(one, other, "{words:?} {values:?}");
}

fn session_in(folder: &Path, file: &str, words: &[&str]) -> Log {
    let length: &[&str] = if words.contains(&"--seconds") { &[] } else { &["--seconds", "1"] };
    stand(folder, &[&["sim", "--out", file, "--force"], length, words].concat()).succeeded();
    Log::read(folder.join(file)).unwrap()
}

/// Output of `model show` after an edit of a copy.
#[track_caller]
fn edited(folder: &Path, verb: &[&str], words: &[&str]) -> String {
    std::fs::copy(folder.join("model.toml"), folder.join("edited.toml")).unwrap();
    let shown = stdout_of(folder, &[&["model"], verb, &["edited.toml"], words].concat());
    assert_ne!(std::fs::read(folder.join("model.toml")).unwrap(), std::fs::read(folder.join("edited.toml")).unwrap());
    assert_eq!(shown, stdout_of(folder, &["model", "show", "edited.toml"]), "the written model equals the shown one");
    shown
}

fn another_log(folder: &Path, verb: &str) {
    stand(folder, &["sim", "--out", "other.csv", "--force", "--seconds", "3", "--seed", "2"]).succeeded();
    let outputs = |log: &str| json(folder, &[verb, log, "--model", "model.toml"])["outputs"].clone();
    assert_ne!(outputs("log.csv"), outputs("other.csv"));
    assert_eq!(outputs("log.csv"), outputs("log.parquet"), "both formats give equal outputs");
}

fn another_model(folder: &Path, verb: &str) {
    stdout_of(folder, &["model", "new", "bare.toml", "--force"]);
    let outputs = |model: &str| json(folder, &[verb, "log.csv", "--model", model])["outputs"].clone();
    assert_ne!(outputs("model.toml"), outputs("bare.toml"));
}

/// Removes values that depend on the wall clock.
fn timeless(mut answer: Value) -> Value {
    answer.as_object_mut().map(|a| a.remove("seconds"));
    answer.get_mut("notes").and_then(Value::as_object_mut).map(|a| a.remove("date"));
    answer
}

/// The series has the measured rate and a modelled one beside it, in both formats.
#[track_caller]
fn series(folder: &Path, words: &[&str]) {
    for file in ["series.csv", "series.parquet"] {
        stdout_of(folder, &[words, &["--out-series", file]].concat());
        let (log, series) = (Log::read(folder.join("log.csv")).unwrap(), Log::read_all(folder.join(file)).unwrap());
        let (measured, modelled) = (series.column("omega_rad_s").unwrap(), series.column("omega_rad_s_model").unwrap());
        let first = log.len() - series.len();
        assert_eq!(measured, &log.column("omega_rad_s").unwrap()[first..], "the first increments of the angle are not compared");
        assert!(measured != modelled && modelled.iter().any(|w| w.abs() > 1.0));
    }
    assert_eq!(stand(folder, &[words, &["--out-series", "series.txt"]].concat()).status, Some(2));
}

#[track_caller]
fn json_in_both_places(folder: &Path, words: &[&str]) {
    let printed = json(folder, words);
    let text = stdout_of(folder, &[words, &["--json", "answer.json"]].concat());
    assert!(!text.trim_start().starts_with(['{', '[']) && !text.is_empty(), "text output is not empty: {text}");
    let written = serde_json::from_slice(&std::fs::read(folder.join("answer.json")).unwrap()).unwrap();
    assert_eq!(timeless(printed), timeless(written), "{words:?}");
}

#[track_caller]
/// Without time there is an answer, which concludes nothing, and no model.
fn timed_out(folder: &Path, words: &[&str]) {
    let short = stand(folder, &[words, &["--time-limit", "0.001", "--out", "out.toml", "--json", "-"]].concat());
    assert!(
        short.status == Some(1) && (short.err.contains("the time limit of 0.001 s has ended the") || short.err.contains("not finished")),
        "{short:?}"
    );
    let answer = short.json();
    let is_open = answer["verdict"] == "not-finished" && answer["missing"] == serde_json::json!([]) || answer["converged"] == false;
    assert!(is_open && !folder.join("out.toml").exists(), "{answer}");
    stdout_of(folder, &[words, &["--time-limit", "0"]].concat());
    assert_eq!(stand(folder, &[words, &["--time-limit", "-1"]].concat()).status, Some(2));
    std::fs::create_dir(folder.join("logs")).unwrap();
    std::fs::copy(folder.join("log.csv"), folder.join("logs/log.csv")).unwrap();
    let of_folder = stand(folder, &["explain", "logs", "--model", "model.toml", "--time-limit", "0.001"]);
    assert!(of_folder.status == Some(1) && of_folder.out.contains("not-finished"), "{of_folder:?}");
}

fn page(folder: &Path, words: &[&str]) {
    let plain = stdout_of(folder, words);
    let with = with_plots(folder, words);
    assert_eq!(plain.lines().next(), with.lines().next(), "the words stay");
    let page = std::fs::read_to_string(folder.join("page.html")).unwrap();
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() })
        .unwrap_or_else(|e| panic!("{words:?}: {e}"));
    // The page needs no network.
    for outside in ["src=\"http", "href=\"http", "@import", "<link"] {
        assert!(!page.contains(outside), "{words:?}: {outside}");
    }
}

/// All commands by their words, the bare one first.
fn commands(folder: &Path) -> Vec<Vec<String>> {
    let mut all = vec![Vec::new()];
    let mut k = 0;
    while k < all.len() {
        let path: Vec<String> = all[k].clone();
        // `help X` prints the help of X, which is in the list already.
        for name in listed(&help(folder, &path), "Commands:").into_iter().filter(|name| name != "help") {
            all.push(path.iter().cloned().chain([name]).collect());
        }
        k += 1;
    }
    all
}

fn help(folder: &Path, path: &[String]) -> String {
    let words: Vec<&str> = path.iter().map(String::as_str).chain(["--help"]).collect();
    stdout_of(folder, &words)
}

/// Heading of the options about logs of other programs.
const IMPORT: &str = "Logs of other programs:";

/// First words of the lines of a section: commands, arguments or options.
fn listed(help: &str, section: &str) -> Vec<String> {
    let lines = help.lines().skip_while(|l| *l != section).skip(1).take_while(|l| l.is_empty() || l.starts_with(' '));
    lines
        .filter_map(|line| {
            // Deeper lines continue a description.
            let indent = line.len() - line.trim_start().len();
            let line = line.trim_start();
            match section {
                "Options:" | IMPORT => {
                    line.starts_with('-').then(|| line[line.find("--")?..].split([' ', ',']).next().map(str::to_owned)).flatten()
                }
                _ => (indent == 2).then(|| line.split_whitespace().next().map(str::to_owned)).flatten(),
            }
        })
        .collect()
}

/// The table, and those of the command groups.
fn all_words() -> impl Iterator<Item = (&'static str, Check)> {
    WORDS
        .into_iter()
        .chain(allan_words::WORDS)
        .chain(import_words::WORDS)
        .chain(calibrate_words::WORDS)
        .chain(records_words::WORDS)
        .chain(lab_words::WORDS)
        .chain(drift_words::WORDS.iter().copied())
        .chain(observer_words::WORDS)
        .chain(stability_words::WORDS)
        .chain(fleet_words::WORDS)
}

/// The help of every command has its purpose, its usage, and a line for each word.
fn help_everywhere(folder: &Path) {
    for path in commands(folder) {
        let text = help(folder, &path);
        assert!(text.contains("Usage: stand"), "{path:?}: {text}");
        assert!(!text.lines().next().unwrap().starts_with("Usage"), "{path:?}: the purpose comes first: {text}");
        for section in ["Commands:", "Arguments:", "Options:", IMPORT] {
            for word in listed(&text, section) {
                let mut lines =
                    text.lines().skip_while(|l| !l.trim_start().trim_start_matches("-h, ").trim_start_matches("-V, ").starts_with(&word));
                let line = lines.next().unwrap();
                let expected = line.trim_start().split_once("  ").map(|(_, expected)| expected.trim()).filter(|s| !s.is_empty());
                assert!(
                    expected.or_else(|| lines.next().map(str::trim)).is_some_and(|s| s.len() > 3),
                    "{path:?} {word} is explained: {text}"
                );
            }
        }
    }
}

#[test]
fn table_covers_every_option_of_every_command() {
    let folder = folder();
    let mut there = BTreeSet::new();
    for path in commands(folder.path()) {
        let text = help(folder.path(), &path);
        let name = path.join(" ");
        there.insert(name.clone());
        for section in ["Arguments:", "Options:", IMPORT] {
            there.extend(listed(&text, section).into_iter().map(|word| format!("{name} {word}")));
        }
    }
    let mut lines = BTreeSet::from([String::new()]);
    for (line, _) in all_words() {
        // `model set <MODEL> <VALUE> --free`: a command, and several of its words.
        let is_word = |w: &str| w.starts_with(['-', '<', '[']);
        let command: Vec<&str> = line.split_whitespace().take_while(|w| !is_word(w)).collect();
        let command = command.join(" ");
        lines.insert(command.clone());
        lines.extend(line.split_whitespace().filter(|w| is_word(w)).map(|w| format!("{command} {w}")));
    }
    let missing: Vec<_> = there.difference(&lines).collect();
    let gone: Vec<_> = lines.difference(&there).collect();
    assert!(missing.is_empty() && gone.is_empty(), "without a line in WORDS: {missing:?}; no longer there: {gone:?}");
}

/// Checks at a time. Several of them wait for a stand in real time.
const AT_ONCE: usize = 4;

#[test]
fn every_option_changes_an_output() {
    let mut helped = false;
    // All words `--help` are tested in one run.
    let checks: Vec<(&str, Check)> =
        all_words().filter(|(name, _)| !(name.ends_with("--help") && std::mem::replace(&mut helped, true))).collect();
    let next = AtomicUsize::new(0);
    let failed = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_ONCE {
            scope.spawn(|| {
                while let Some((name, shows)) = checks.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let folder: TempDir = folder();
                    let begun = std::time::Instant::now();
                    if catch_unwind(AssertUnwindSafe(|| shows(folder.path()))).is_err() {
                        failed.lock().unwrap().push(*name);
                    }
                    println!("{:.1} s: {name}", begun.elapsed().as_secs_f64());
                }
            });
        }
    });
    let failed = failed.into_inner().unwrap();
    assert!(failed.is_empty(), "the panics are above: {failed:?}");
}
