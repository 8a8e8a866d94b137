//! One check for each word of `stand drift`, compared with `--help` by options.rs.

use super::common::{stand, with_plots};
use serde_json::Value;
use std::path::Path;

fn json(folder: &Path, words: &[&str]) -> Value {
    stand(folder, words).succeeded().json()
}

/// A short measurement on the simulated stand.
fn run(folder: &Path, more: &[&str]) -> Value {
    let short = ["drift", "run", "--pulse", "0.5", "--rest", "1", "--cycles", "2", "--rounds", "1", "--json", "-"];
    // A repeated word overrides.
    let kept: Vec<&str> =
        short[..2].iter().copied().chain(short[2..].chunks(2).filter(|pair| !more.contains(&pair[0])).flatten().copied()).collect();
    json(folder, &[&kept, more].concat())
}

/// A log of a short measurement.
fn log(folder: &Path) {
    run(folder, &["--out", "drift.csv", "--force"]);
}

fn compute(folder: &Path, more: &[&str]) -> Value {
    json(folder, &[&["drift", "compute", "drift.csv", "--json", "-"], more].concat())
}

fn own(found: &Value) -> f64 {
    found["own_drift_deg_h"]["value"].as_f64().unwrap()
}

fn sigma(found: &Value, of: &str) -> f64 {
    found[of]["sigma"].as_f64().unwrap()
}

/// Asserts that the errors of latitude, azimuth and gain change an uncertainty.
fn errors(with: impl Fn(&[&str]) -> Value) {
    let plain = with(&[]);
    for (word, value, of) in [
        ("--turn-error", "1200", "apparent_drift_deg_h"),
        ("--level-error", "3600", "own_drift_deg_h"),
        ("--gain-error", "50", "own_drift_deg_h"),
    ] {
        assert!(sigma(&with(&[word, value]), of) > 1.01 * sigma(&plain, of), "{word}");
    }
}

/// Asserts that the bounds of torquer and latitude change an uncertainty.
fn bounds(with: impl Fn(&[&str]) -> Value) {
    let plain = with(&[]);
    assert!(sigma(&with(&["--torquer-gain-error", "100"]), "own_drift_deg_h") > 1.01 * sigma(&plain, "own_drift_deg_h"));
    let of_azimuth = |found: &Value| found["uncertainty"].to_string();
    assert_ne!(of_azimuth(&with(&["--latitude-error", "5"])), of_azimuth(&plain));
}

/// The log of a platform that turns to and fro, once.
fn turned(folder: &Path) {
    let mut text = "t_s,theta_rad,gyro_rad_s\n".to_owned();
    let mut theta = 0.0;
    for k in 0..5_000 {
        let rate = match k {
            500..2_500 => 0.1,
            2_500..4_500 => -0.1,
            _ => 0.0,
        };
        text += &format!("{},{theta},{}\n", f64::from(k) * 1e-3, rate + 0.002);
        theta += rate * 1e-3;
    }
    std::fs::write(folder.join("turned.csv"), text).unwrap();
}

fn page(folder: &Path, words: &[&str]) {
    with_plots(folder, words);
    assert!(std::fs::read_to_string(folder.join("page.html")).unwrap().contains("<svg"));
}

/// As in options.rs.
pub const WORDS: &[(&str, super::Check)] = &[
    ("drift --help", |_| ()),
    ("drift run --help", |_| ()),
    ("drift compute --help", |_| ()),
    ("drift advise --help", |_| ()),
    ("drift platform --help", |_| ()),
    ("drift run --cycles --pulse --period --json", |f| {
        let usual = run(f, &[]);
        assert_eq!((usual["cycles"].as_array().unwrap().len(), usual["cycles"][0]["pulse_s"].as_f64()), (8, Some(0.5)));
        assert_eq!(run(f, &["--cycles", "3"])["cycles"].as_array().unwrap().len(), 12);
        let pulse_ms = |more: &[&str]| (1e3 * run(f, more)["cycles"][0]["pulse_s"].as_f64().unwrap()).round();
        assert_eq!((pulse_ms(&["--pulse", "0.7"]), pulse_ms(&["--period", "0.3"])), (700.0, 600.0));
    }),
    ("drift run --rate --sequence --shape --reversed", |f| {
        let reference = |found: &Value| found["reference_deg_s"].as_f64();
        assert!((reference(&run(f, &["--rate", "0.1"])).unwrap() - 0.1).abs() < 2e-3);
        let two = run(f, &["--rate", "0.05,0.1"]);
        assert_eq!((two["cycles"].as_array().unwrap().len(), two["inequality"].as_array().unwrap().len()), (8, 1), "{two}");
        let one = run(f, &["--sequence", "minus-plus"]);
        assert!(one["cycles"].as_array().unwrap().iter().all(|c| c["sequence"] == "-+") && reference(&one).is_none());
        let raw = |more: &[&str]| run(f, &[&["--sequence", "plus-minus"], more].concat())["cycles"][0]["raw_deg_h"].as_f64().unwrap();
        // A sixth of 180 °/h, unless it runs backwards.
        let sawtooth = raw(&["--shape", "sawtooth"]);
        assert!((sawtooth - 30.0).abs() < 3.0, "{sawtooth}");
        assert!(raw(&["--shape", "sawtooth", "--reversed"]).abs() < 3.0);
    }),
    ("drift run --rest", |f| {
        let start = |found: Value| found["cycles"][1]["start_s"].as_f64().unwrap();
        assert!(start(run(f, &["--rest", "3"])) > start(run(f, &[])) + 3.0);
    }),
    ("drift run --positions --turn", |f| {
        let turned = run(f, &["--positions", "0,180,90"]);
        assert_eq!(turned["cycles"][5]["turned_deg"], 90.0);
        let driven = run(f, &["--turn", "drive"]);
        // Despite the platform's own rotation, the apparent drift changes its sign.
        assert!((driven["apparent_drift_deg_h"]["value"].as_f64().unwrap() + 0.89).abs() < 0.3, "{driven}");
        assert_ne!(driven["cycles"], run(f, &[])["cycles"]);
    }),
    ("drift run --latitude", |f| assert_ne!(run(f, &["--latitude", "50"])["azimuth_deg"], run(f, &[])["azimuth_deg"])),
    ("drift run --gyro --seed", |f| {
        std::fs::write(f.join("gyro.toml"), "[own]\nconstant_rad_s = 4.848e-5\n").unwrap();
        assert!((own(&run(f, &["--gyro", "gyro.toml"])) - 10.0).abs() < 0.5);
        assert_ne!(own(&run(f, &["--seed", "2"])), own(&run(f, &[])));
    }),
    ("drift run --turn-error --level-error --gain-error", |f| errors(|more| run(f, &[&["--cycles", "4"], more].concat()))),
    // In a single sequence the lag of the torquer remains in the correction by the current.
    ("drift run --torquer-gain-error --latitude-error", |f| {
        bounds(|more| run(f, &[&["--cycles", "4", "--sequence", "plus-minus"], more].concat()))
    }),
    ("drift run --torquer-asymmetry", |f| {
        let with = |percent: &str| sigma(&run(f, &["--rate", "0.05", "--torquer-asymmetry", percent]), "own_drift_deg_h");
        assert!(with("10") > 5.0 * with("1"));
    }),
    ("drift run --order", |f| {
        let turned = |order: &str| {
            let found = run(f, &["--order", order, "--rounds", "1"]);
            let cycles = found["cycles"].as_array().unwrap().clone();
            cycles.iter().map(|cycle| cycle["turned_deg"].as_f64().unwrap()).collect::<Vec<_>>()
        };
        assert_eq!(turned("abba"), [0.0, 0.0, 180.0, 180.0, 180.0, 180.0, 0.0, 0.0]);
        assert_eq!(turned("once"), [0.0, 0.0, 0.0, 0.0, 180.0, 180.0, 180.0, 180.0]);
    }),
    ("drift run --rounds", |f| {
        let contrasts = |rounds: &str| run(f, &["--rounds", rounds])["movement"][0]["visit_contrasts"].clone();
        assert_eq!((contrasts("1"), contrasts("3")), (1.into(), 5.into()));
    }),
    ("sim --axes", |f| {
        stand(f, &["sim", "--gyro", "--axes", "3", "--out", "platform.csv", "--force"]).succeeded();
        let text = std::fs::read_to_string(f.join("platform.csv")).unwrap();
        assert!(text.lines().any(|line| line.starts_with("t_s,") && line.contains("torquer_z_A")));
    }),
    ("drift run --units", |f| {
        let text = stand(f, &["drift", "run", "--pulse", "0.5", "--rest", "1", "--cycles", "2", "--units", "rad/s"]).succeeded().out;
        assert!(text.contains("rad/s"), "{text}");
    }),
    ("drift run --out --html --plots", |f| {
        log(f);
        assert!(f.join("drift.csv").exists());
        page(f, &["drift", "run", "--pulse", "0.5", "--rest", "1", "--cycles", "1"]);
    }),
    #[cfg(unix)]
    ("drift run --port", |f| {
        // A stand without a gyro, in real time, reports that.
        let one = super::served::Served::new(f, &[]);
        let ran = stand(f, &["drift", "run", "--port", &one.port, "--cycles", "1", "--positions", "0"]);
        assert_eq!(ran.status, Some(2), "{ran:?}");
        assert!(ran.err.contains("no angle sensor"), "{ran:?}");
    }),
    #[cfg(unix)]
    ("sim --gyro", |f| {
        std::fs::write(f.join("gyro.toml"), "[own]\nconstant_rad_s = 9.0e-6\n").unwrap();
        let usual = super::served::Served::new(f, &["--gyro"]);
        assert_eq!(super::served::send_lines(f, &usual.port, "DRIFt:STATe?\n").status, Some(0));
        drop(usual);
        let one = super::served::Served::new(f, &["--gyro", "gyro.toml", "--speed", "4"]);
        let short =
            ["--cycles", "2", "--rounds", "1", "--pulse", "0.5", "--rest", "1", "--latitude", "70", "--turn", "drive", "--json", "-"];
        let found = json(f, &[&["drift", "run", "--port", one.port.as_str()][..], &short].concat());
        assert_eq!((found["good"].as_u64(), found["bad"].as_u64()), (Some(8), Some(0)), "{found}");
        // 1.856 °/h; pulses of half a second leave about 0.4 °/h of noise.
        let own = found["own_drift_deg_h"]["value"].as_f64().unwrap();
        assert!((own - 1.856).abs() < 3.0, "{own}");
    }),
    ("drift compute <LOG>... --json --html --plots", |f| {
        log(f);
        std::fs::copy(f.join("drift.csv"), f.join("again.csv")).unwrap();
        assert_eq!(json(f, &["drift", "compute", "drift.csv", "again.csv", "--json", "-"])["good"], 16);
        page(f, &["drift", "compute", "drift.csv"]);
    }),
    ("drift compute --angle-gain --torquer-gain --pulse --angle-limit --latitude", |f| {
        log(f);
        let plain = compute(f, &[]);
        assert!((own(&compute(f, &["--angle-gain", "300", "--torquer-gain", "0.01"])) / own(&plain) - 0.5).abs() < 0.01);
        assert_ne!(compute(f, &["--torquer-gain", "0.021"])["cycles"], plain["cycles"]);
        assert_ne!(compute(f, &["--latitude", "50"])["azimuth_deg"], plain["azimuth_deg"]);
        let short = stand(f, &["drift", "compute", "drift.csv", "--pulse", "0.4"]);
        assert!(short.out != stand(f, &["drift", "compute", "drift.csv"]).out);
        let saturated = stand(f, &["drift", "compute", "drift.csv", "--angle-limit", "0.01"]);
        assert!(saturated.err.contains("angle sensor saturated"), "{saturated:?}");
    }),
    ("drift compute --turn-error --level-error --gain-error", |f| {
        run(f, &["--cycles", "4", "--out", "drift.csv", "--force"]);
        errors(|more| compute(f, more));
    }),
    ("drift compute --torquer-gain-error --latitude-error", |f| {
        run(f, &["--cycles", "4", "--sequence", "plus-minus", "--out", "drift.csv", "--force"]);
        bounds(|more| compute(f, more));
    }),
    ("drift compute --torquer-asymmetry --units", |f| {
        run(f, &["--rate", "0.05", "--out", "drift.csv", "--force"]);
        let with = |percent: &str| sigma(&compute(f, &["--torquer-asymmetry", percent]), "own_drift_deg_h");
        assert!(with("10") > 5.0 * with("1"));
        let text = stand(f, &["drift", "compute", "drift.csv", "--units", "rad/s"]).succeeded().out;
        assert!(text.contains("rad/s"), "{text}");
    }),
    ("drift advise <LOG> --pulse --angle-gain --json --html --plots", |f| {
        let mut text = "t_s,angle_sensor_V\n".to_owned();
        for k in 0..8_000 {
            let t = f64::from(k) * 1e-3;
            text += &format!("{t},{}\n", 0.01 * (std::f64::consts::TAU * t / 0.7).sin() + 1e-5 * f64::from((k * 7919) % 101));
        }
        std::fs::write(f.join("static.csv"), text).unwrap();
        let advise =
            |gain: &str, pulse: &str| json(f, &["drift", "advise", "static.csv", "--angle-gain", gain, "--pulse", pulse, "--json", "-"]);
        let (one, finer, longer) = (advise("150", "2"), advise("300", "2"), advise("150", "3.4"));
        assert!(
            (one["pulse_s"].as_f64().unwrap() - 2.1).abs() < 0.02 && (longer["pulse_s"].as_f64().unwrap() - 3.5).abs() < 0.02,
            "{one} {longer}"
        );
        let amplitude = |found: &Value| found["lines"][0]["amplitude_arcsec"].as_f64().unwrap();
        assert!((amplitude(&one) / amplitude(&finer) - 2.0).abs() < 1e-6);
        page(f, &["drift", "advise", "static.csv", "--angle-gain", "150", "--pulse", "2"]);
    }),
    ("drift platform <LOG> --pulse --json", |f| {
        turned(f);
        let found = json(f, &["drift", "platform", "turned.csv", "--pulse", "2", "--json", "-"]);
        assert!((found["bias_rad_s"]["value"].as_f64().unwrap() - 0.002).abs() < 1e-4, "{found}");
        assert_eq!(stand(f, &["drift", "platform", "turned.csv", "--pulse", "3"]).status, Some(2));
    }),
    ("drift platform --latitude --units --html --plots", |f| {
        turned(f);
        let found = |more: &[&str]| json(f, &[&["drift", "platform", "turned.csv", "--json", "-"], more].concat());
        let earth = |found: &Value| (found["without_earth_rate"].as_bool(), found["bias_rad_s"]["value"].as_f64().unwrap());
        let (plain, without) = (earth(&found(&[])), earth(&found(&["--latitude", "90"])));
        assert_eq!((plain.0, without.0), (Some(false), Some(true)));
        assert!((plain.1 - without.1 - 7.292e-5).abs() < 1e-7, "{plain:?} {without:?}");
        let text = stand(f, &["drift", "platform", "turned.csv", "--units", "deg/h"]).succeeded().out;
        assert!(text.contains("°/h"), "{text}");
        page(f, &["drift", "platform", "turned.csv"]);
    }),
];
