//! `stand drift`: on the simulated stand, from its log, and with invalid input.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::stand;
use hal_sim::peripherals::Noise;
use std::path::Path;

fn value(json: &serde_json::Value, name: &str) -> (f64, f64) {
    (json[name]["value"].as_f64().unwrap(), json[name]["sigma"].as_f64().unwrap())
}

/// The command fails with status 2 and one line that contains `message`.
#[track_caller]
fn refused(folder: &Path, words: &[&str], message: &str) {
    let ran = stand(folder, words);
    assert_eq!((ran.status, ran.err.lines().count()), (Some(2), 1), "{words:?}: {ran:?}");
    assert!(ran.err.contains(message), "{words:?}: {}", ran.err);
}

#[test]
fn measurement_and_its_log_give_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let run = stand(path, &["drift", "run", "--cycles", "4", "--out", "log.csv", "--html", "run.html", "--json", "-"]).succeeded().json();
    assert_eq!((run["good"].as_u64(), run["bad"].as_u64()), (Some(16), Some(0)));
    for (name, truth) in [("own_drift_deg_h", 1.5), ("apparent_drift_deg_h", -0.893_307), ("azimuth_deg", 80.0)] {
        let (value, sigma) = value(&run, name);
        let expanded = run[name]["U"].as_f64().unwrap();
        assert!((value - truth).abs() <= expanded, "{name}: {value} ± {expanded}");
        let most = if name == "azimuth_deg" { 0.1 } else { 0.01 };
        assert!(sigma > 0.0 && sigma < most, "{name}: {sigma}");
    }
    // An amplifier inequality of 1e-4 is a drift of −0.009 °/h at 0.05 °/s and of −0.0036 °/h at 0.02 °/s, which the current correction
    // removes.
    let raw = run["uncorrected"]["own_drift_deg_h"]["value"].as_f64().unwrap();
    assert!((raw - value(&run, "own_drift_deg_h").0 + 0.0063).abs() < 0.003, "{raw}");
    let log = stand(path, &["drift", "compute", "log.csv", "--json", "-"]).succeeded().json();
    for name in ["own_drift_deg_h", "apparent_drift_deg_h", "azimuth_deg"] {
        let (a, b) = (value(&run, name).0, value(&log, name).0);
        // The log's numbers are single precision.
        assert!((a - b).abs() < 2e-4 * a.abs().max(1.0), "{name}: {a} {b}");
    }
    let page = std::fs::read_to_string(path.join("run.html")).unwrap();
    let body = page.strip_prefix("<!DOCTYPE html>\n").unwrap();
    assert!(roxmltree::Document::parse(body).is_ok() && body.contains("<svg") && body.contains("own drift"));
}

/// A torquer gain 0.3 % larger in one direction, not visible in the current: −ε w/2 of 180 °/h is a drift of −0.27 °/h.
#[test]
fn two_amplitudes_separate_unequal_torquer_and_drift() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    std::fs::write(path.join("gyro.toml"), "[torquer]\ngain_inequality = 3e-3\n").unwrap();
    let run = |rates: &str| {
        let words =
            ["drift", "run", "--cycles", "4", "--gyro", "gyro.toml", "--out", "log.csv", "--force", "--html", "run.html", "--json", "-"];
        stand(path, &[&words[..], &["--rate", rates]].concat()).succeeded().json()
    };
    let one = run("0.05");
    let (own, sigma) = value(&one, "own_drift_deg_h");
    // The default bound of 1 % is a rectangle of half-width 0.9 °/h in the budget.
    assert!((own - 1.5 + 0.27).abs() < 0.02 && (sigma / (0.9 / 3_f64.sqrt()) - 1.0).abs() < 0.01, "{own} ± {sigma}");
    assert_eq!(one["inequality"].as_array().unwrap().len(), 0, "one amplitude does not know of it");

    let two = run("0.05,0.02");
    assert!(std::fs::read_to_string(path.join("run.html")).unwrap().contains("negative pulses stronger by"));
    // Repeated from the log, with the firmware's mark and with the current alone.
    let log = std::fs::read_to_string(path.join("log.csv")).unwrap();
    std::fs::write(path.join("bare.csv"), log.replace("drift_mark", "mark")).unwrap();
    let computed = |log: &str| {
        let ran = stand(path, &["drift", "compute", log, "--json", "-"]);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        ran.json()
    };
    for found in [two, computed("log.csv"), computed("bare.csv")] {
        assert_eq!(found["good"], 16, "{found}");
        for (name, truth, most) in [("own_drift_deg_h", 1.5, 0.05), ("apparent_drift_deg_h", -0.893_307, 0.05), ("azimuth_deg", 80.0, 0.6)]
        {
            let (value, expanded) = (value(&found, name).0, found[name]["U"].as_f64().unwrap());
            assert!((value - truth).abs() <= expanded && expanded < most, "{name}: {value} ± {expanded}");
        }
        let [unequal] = found["inequality"].as_array().unwrap().as_slice() else { panic!("{found}") };
        let (value, sigma) = (unequal["value"].as_f64().unwrap(), unequal["sigma"].as_f64().unwrap());
        assert!((value - 3e-3).abs() < 4.0 * sigma && sigma < 1e-4, "{value} ± {sigma}");
        let raw = found["uncorrected"]["own_drift_deg_h"]["value"].as_f64().unwrap();
        assert!(raw < 1.4, "between the two amplitudes: {raw}");
    }
}

#[test]
fn log_does_not_change_the_result() {
    let folder = tempfile::tempdir().unwrap();
    let json = |more: &[&str]| {
        let words = ["drift", "run", "--cycles", "2", "--rounds", "1", "--pulse", "1", "--rest", "2", "--json", "-"];
        stand(folder.path(), &[&words, more].concat()).succeeded().json()
    };
    let alone = json(&[]);
    assert!(alone["cycles"].as_array().unwrap().len() == 8, "{alone}");
    assert_eq!(alone, json(&["--out", "log.csv"]));
}

#[test]
fn cycles_are_detected_by_the_current_without_marks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    stand(path, &["drift", "run", "--cycles", "2", "--rounds", "1", "--pulse", "1", "--rest", "2", "--out", "log.csv"]).succeeded();
    let with = std::fs::read_to_string(path.join("log.csv")).unwrap();
    // The renamed column is unknown and ignored.
    std::fs::write(path.join("bare.csv"), with.replace("drift_mark", "mark")).unwrap();
    let json = |log: &str| {
        let ran = stand(path, &["drift", "compute", log, "--json", "-"]);
        assert_eq!(ran.status, Some(0), "{ran:?}");
        ran.json()
    };
    let (marked, bare) = (json("log.csv"), json("bare.csv"));
    assert_eq!(marked["cycles"].as_array().unwrap().len(), 8);
    for (a, b) in marked["cycles"].as_array().unwrap().iter().zip(bare["cycles"].as_array().unwrap()) {
        assert_eq!(a["sequence"], b["sequence"]);
        // The torquer's lag of a millisecond shifts the current; the current correction removes its effect on (13).
        let late = b["start_s"].as_f64().unwrap() - a["start_s"].as_f64().unwrap();
        assert!((0.0..0.0035).contains(&late), "{late}");
    }
    let own = |json: &serde_json::Value| json["own_drift_deg_h"]["value"].as_f64().unwrap();
    let (by_mark, by_current) = (own(&marked), own(&bare));
    assert!((by_mark - by_current).abs() < 0.05, "{by_mark} {by_current}");
}

#[test]
fn four_turns_give_the_azimuth_and_rolls_the_g_dependent_drift() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let gyro = "[own]\nconstant_rad_s = 7.27e-6\noutput_rad_s_g = 4.848e-6\nspin_rad_s_g = -2.424e-6\n";
    std::fs::write(path.join("gyro.toml"), gyro).unwrap();
    let words = ["drift", "run", "--cycles", "2", "--gyro", "gyro.toml", "--positions", "0,90,180,270,0:0:90,0:0:180", "--json", "-"];
    let found = stand(path, &words).succeeded().json();
    let azimuth = found["azimuth_deg"]["value"].as_f64().unwrap();
    assert!((azimuth - 80.0).abs() < 0.3, "{azimuth}");
    let by_g = found["g_drift_deg_h_g"].as_array().unwrap();
    let of = |axis: &str| by_g.iter().find(|v| v["axis"] == axis).and_then(|v| v["value"].as_f64()).unwrap();
    assert!((of("output") - 1.0).abs() < 0.05 && (of("spin") + 0.5).abs() < 0.05, "{by_g:?}");
    let own = found["own_drift_deg_h"]["value"].as_f64().unwrap();
    assert!((own - 1.5).abs() < 0.05, "{own}");
}

#[test]
fn advised_pulse_is_a_multiple_of_the_vibration_period() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut text = "# angle_gain_V_rad: 150\nt_s,angle_sensor_V\n".to_owned();
    for k in 0..20_000 {
        let t = f64::from(k) * 1e-3;
        // 20″ at 1.43 Hz, and a ripple without a spectral line.
        let angle = 1e-4 * (std::f64::consts::TAU * t / 0.7).sin() + 1e-7 * f64::from((k * 7919) % 101);
        text += &format!("{t},{}\n", 150.0 * angle + 1e-5 * t);
    }
    std::fs::write(path.join("static.csv"), text).unwrap();
    let found = stand(path, &["drift", "advise", "static.csv", "--html", "advice.html", "--json", "-"]).succeeded().json();
    let number = |name: &str| found[name].as_f64().unwrap();
    assert!((number("period_s") - 0.7).abs() < 1e-3 && (number("pulse_s") - 4.9).abs() < 0.01, "{found}");
    assert!((found["lines"][0]["amplitude_arcsec"].as_f64().unwrap() - 20.6).abs() < 0.3, "{found}");
    assert!(number("leaves_deg_h") < 0.01 * number("wanted_leaves_deg_h"), "{found}");
    refused(path, &["drift", "advise", "static.csv", "--pulse", "15"], "must last two pulses");
}

#[test]
fn platform_method_gives_bias_and_scale() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let mut text = "t_s,theta_rad,gyro_rad_s\n".to_owned();
    let mut theta = 0.0;
    for k in 0..24_000 {
        let rate = match k % 12_000 {
            1_000..6_000 => 0.1,
            6_000..11_000 => -0.1,
            _ => 0.0,
        };
        text += &format!("{},{theta},{}\n", f64::from(k) * 1e-3, 1.01 * rate + 0.002);
        theta += rate * 1e-3;
    }
    std::fs::write(path.join("log.csv"), &text).unwrap();
    let found = stand(path, &["drift", "platform", "log.csv", "--json", "-"]).succeeded().json();
    // The second rotation before the pause and the first one behind it are a cycle of the other sign.
    assert_eq!(found["cycles"].as_array().unwrap().len(), 3);
    // The rate's edge is between two samples: half a sample of 0.1 rad/s in 5 s.
    assert!((found["bias_rad_s"]["value"].as_f64().unwrap() - 0.002).abs() < 5e-5, "{found}");
    assert!((found["scale"]["value"].as_f64().unwrap() - 1.01).abs() < 5e-4, "{found}");
    assert!(found["warnings"][0].as_str().unwrap().contains("reading at rest is constant"), "{found}");

    // With noise of 1 mrad/s the same gyro with a range of 0.1 rad/s is clipped in both directions.
    let mut noise = Noise::new(1, 0, 1e-3);
    let clipped: String = text
        .lines()
        .map(|line| match line.rsplit_once(',') {
            Some((rest, rate)) if rate.parse::<f64>().is_ok() => {
                format!("{rest},{}\n", (rate.parse::<f64>().unwrap() + noise.draw()).clamp(-0.095, 0.095))
            }
            _ => format!("{line}\n"),
        })
        .collect();
    std::fs::write(path.join("clipped.csv"), clipped).unwrap();
    refused(path, &["drift", "platform", "clipped.csv"], "the sensor is clipped");
}

#[test]
fn invalid_input_fails_with_one_line_and_status_2() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for (words, message) in [
        (&["--pulse", "0"][..], "--pulse = 0"),
        (&["--pulse", "nan"], "--pulse = NaN"),
        (&["--latitude", "90"], "disagrees"),
        (&["--latitude", "91"], "latitude_deg = 91: must be a number from -90 to 90 (--latitude)"),
        (&["--rate", "1"], "the stand rejected `DRIFt:STARt`"),
        (
            &["--rate", "0.05,0.055"],
            "amplitude 0.055: amplitudes must differ by at least 20 % to determine the inequality of the torquer (--rate)",
        ),
        (&["--rate", "0.05,0"], "--rate = 0"),
        (&["--positions", "0,x"], "--positions: `x`"),
        (&["--positions", "0", "--cycles", "1"], "no turn"),
        (&["--turn-error", "-1", "--cycles", "1"], "(--turn-error)"),
        (&["--gyro", "none.toml"], "none.toml: cannot read"),
        (&["--out", "log.txt"], "log.txt"),
    ] {
        refused(path, &[&["drift", "run"], words].concat(), message);
    }
    std::fs::write(path.join("bad.toml"), "[sensor]\ngain = 3\n").unwrap();
    refused(path, &["drift", "run", "--gyro", "bad.toml"], "unknown field `gain`");

    stand(path, &["drift", "run", "--cycles", "2", "--rounds", "1", "--pulse", "1", "--rest", "2", "--out", "log.csv"]).succeeded();
    let log = std::fs::read_to_string(path.join("log.csv")).unwrap();
    let with = |name: &str, text: String| std::fs::write(path.join(name), text).unwrap();
    with("no-gain.csv", log.replace("# angle_gain_V_rad: 150\n", ""));
    refused(path, &["drift", "compute", "no-gain.csv"], "no note `angle_gain_V_rad`, and no value is given (--angle-gain)");
    with("text.csv", log.replace("angle_gain_V_rad: 150", "angle_gain_V_rad: large"));
    refused(path, &["drift", "compute", "text.csv"], "`large` is not a number");
    refused(path, &["drift", "compute", "log.csv", "--pulse", "0"], "pulse_s = 0");
    refused(path, &["drift", "compute", "log.csv", "--latitude", "-90.1"], "latitude_deg = -90.1");
    with(
        "still.csv",
        "# angle_gain_V_rad: 150\n# pulse_s: 0.001\nt_s,angle_sensor_V,torquer_A\n0,0,0\n0.001,0,0\n0.002,0,0\n0.003,0,0\n".into(),
    );
    refused(path, &["drift", "compute", "still.csv"], "the current of the torquer is constant");
    with("none.csv", "# angle_gain_V_rad: 150\n# pulse_s: 1\nt_s,u_V\n0,0\n0.001,0\n".into());
    refused(path, &["drift", "compute", "none.csv"], "no column `angle_sensor_V`");
    // A saturated angle sensor.
    let saturated: String = log
        .lines()
        .map(|line| match line.split_once(',') {
            Some((t, rest)) if t.parse::<f64>().is_ok() => format!("{t},1.65,{}\n", rest.split_once(',').unwrap().1),
            _ => format!("{line}\n"),
        })
        .collect();
    with("saturated.csv", saturated);
    refused(path, &["drift", "compute", "saturated.csv"], "none of the 8 cycles is valid: angle sensor saturated");
}
