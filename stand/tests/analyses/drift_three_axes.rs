//! `stand drift compute` on a log of the simulated three-axis platform.
#![allow(clippy::unwrap_used)]

use crate::common;
use std::path::Path;

use common::stand;
use hal_sim::gyro::{ARCSEC, AngleSensor, DEG_H, Site, ThreeAxis, Torquer};
use hal_sim::peripherals::Noise;
use identification::log::{Column, Log};
use serde_json::Value;

const OWN: [f64; 3] = [1.0, -0.5, 2.0];
const PULSE_S: f64 = 5.0;
const RATE: f64 = 0.05 * std::f64::consts::PI / 180.0;
const ROW_S: f64 = 5e-3;
/// Plant steps per row.
const STEPS: usize = 5;
/// Offsets of the current sensors, A: 0.08, −0.04 and 0.12 °/h.
const ZERO_A: [f64; 3] = [2e-5, -1e-5, 3e-5];
const COLUMNS: [&str; 9] = [
    "t_s",
    "drift_mark",
    "turned_deg",
    "angle_sensor_x_V",
    "angle_sensor_y_V",
    "angle_sensor_z_V",
    "torquer_x_A",
    "torquer_y_A",
    "torquer_z_A",
];

/// The platform with torquers and sensors, and the recorded rows.
struct Bench {
    platform: ThreeAxis,
    torquers: [Torquer; 3],
    sensor: AngleSensor,
    noise: Noise,
    t_s: f64,
    turned_deg: f64,
    rows: Vec<[f64; 9]>,
}

impl Bench {
    /// Records `count` rows: `asked` gives the current on each axis from the sensors' angles, rad.
    fn rows(&mut self, count: usize, mark: f64, asked: impl Fn([f64; 3]) -> [f64; 3]) {
        for _ in 0..count {
            let angles = self.platform.gimbals_rad();
            let volts = angles.map(|angle| self.sensor.output_V(angle, &mut self.noise));
            let given = asked(volts.map(|volts| volts / self.sensor.gain_V_rad));
            let mut mean_A = [0.0; 3];
            for _ in 0..STEPS {
                let rates: [f64; 3] = std::array::from_fn(|axis| self.torquers[axis].advance(given[axis], ROW_S / STEPS as f64));
                mean_A.iter_mut().zip(&self.torquers).for_each(|(mean, torquer)| *mean += torquer.mean_A() / STEPS as f64);
                self.platform.advance(rates, ROW_S / STEPS as f64);
            }
            let [x, y, z]: [f64; 3] = std::array::from_fn(|axis| mean_A[axis] + ZERO_A[axis] + 1e-6 * self.noise.draw());
            self.rows.push([self.t_s, mark, self.turned_deg, volts[0], volts[1], volts[2], x, y, z]);
            self.t_s += ROW_S;
        }
    }
}

/// Two positions at 70° north, azimuth 80°; of each cycle, the first pulses on the axes in units of the usual one. `gain`: relative torquer
/// inequality that no current shows.
fn record(cycles: &[[f64; 3]], gain: [f64; 3]) -> Log {
    let site = Site::default();
    let unequal = |axis: usize, inequality| {
        let mut torquer = Torquer::default();
        (torquer.inequality, torquer.gain_inequality) = (inequality, gain[axis]);
        torquer
    };
    let start = ThreeAxis::new([0.0; 3], [0.0; 3], [0.0; 3]);
    let mut bench = Bench {
        platform: start,
        torquers: [unequal(0, 1e-4), unequal(1, -2e-4), unequal(2, 3e-4)],
        // The loops keep the sensor's zero: another zero would be an error of level and azimuth.
        sensor: AngleSensor { offset_V: 0.0, noise_rad: 0.1 * ARCSEC, step_rad: 0.1 * ARCSEC, ..AngleSensor::default() },
        noise: Noise::new(5, 0, 1.0),
        t_s: 0.0,
        turned_deg: 0.0,
        rows: Vec::new(),
    };
    let pulse = (PULSE_S / ROW_S) as usize;
    let command_A = RATE / bench.torquers[0].gain_rad_s_A;
    for turned_deg in [0.0, 180.0_f64] {
        bench.turned_deg = turned_deg;
        bench.platform = ThreeAxis::new(OWN.map(|rate| rate * DEG_H), site.rate_rad_s(turned_deg.to_radians()), [30.0 * ARCSEC; 3]);
        for (k, signs) in cycles.iter().enumerate() {
            let mark = 4.0 * (k + 1) as f64;
            let gain = bench.torquers[0].gain_rad_s_A;
            bench.rows((3.0 / ROW_S) as usize, mark, |angles| angles.map(|angle| -10.0 * angle / gain));
            bench.rows((0.5 / ROW_S) as usize, mark, |_| [0.0; 3]);
            bench.rows(pulse, mark + 1.0, |_| signs.map(|sign| sign * command_A));
            bench.rows(pulse, mark + 2.0, |_| signs.map(|sign| -sign * command_A));
        }
        bench.rows(400, 0.0, |angles| angles.map(|angle| -10.0 * angle / 0.02));
        // The time of the turn is not recorded.
        bench.t_s += 60.0;
    }
    let column = |(k, name): (usize, &&str)| Column { name: (*name).to_owned(), values: bench.rows.iter().map(|row| row[k]).collect() };
    let columns = COLUMNS.iter().enumerate().map(column).collect();
    let notes = [("angle_gain_V_rad", 150.0), ("torquer_gain_rad_s_A", 0.02), ("pulse_s", PULSE_S), ("latitude_deg", 70.0)];
    Log::new("three.parquet", columns, notes.map(|(note, value)| (note.to_owned(), value.to_string())).to_vec()).unwrap()
}

/// The torquers of the bench are symmetric, or two amplitudes measure their asymmetry: no bound is needed.
const JSON: [&str; 4] = ["--torquer-asymmetry", "0", "--json", "-"];

/// Results with the mark of the firmware and by the currents only.
fn computed(folder: &Path, log: &Log) -> [Value; 2] {
    let bare: Vec<Column> = log.columns().iter().filter(|column| column.name != "drift_mark").cloned().collect();
    log.write(folder.join("three.parquet")).unwrap();
    Log::new("bare.parquet", bare, log.notes().to_vec()).unwrap().write(folder.join("bare.parquet")).unwrap();
    ["three.parquet", "bare.parquet"]
        .map(|log| stand(folder, &[&["drift", "compute", log, "--html", "page.html"], &JSON[..]].concat()).succeeded().json())
}

fn value(json: &Value) -> (f64, f64) {
    (json["value"].as_f64().unwrap(), json["sigma"].as_f64().unwrap())
}

/// Asserts that own drift, apparent drift and azimuth are covered by their expanded uncertainty; that of the own drift is at most `most`,
/// °/h. With one visit to each position the trend of the drift is known from within the visits only, and widens that of the apparent drift.
#[track_caller]
fn assert_true(found: &Value, most: f64) {
    let (horizontal, azimuth) = (Site::default().horizontal_rad_s() / DEG_H, 80_f64.to_radians());
    let apparent = [-horizontal * azimuth.cos(), 0.0, horizontal * azimuth.sin()];
    let covers = |what: &str, found: &Value, truth: f64, most: f64| {
        let (value, expanded) = (found["value"].as_f64().unwrap(), found["U"].as_f64().unwrap());
        assert!((value - truth).abs() <= expanded && expanded < most, "{what}: {value} ± {expanded}, truth {truth}");
    };
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        covers(axis, &found["own_drift_deg_h"][axis], OWN[k], most);
        if axis != "y" {
            covers(axis, &found["apparent_drift_deg_h"][axis], apparent[k], 0.015);
        }
    }
    // 0.6′ is half of the platform's rotation until the middle of a cycle.
    covers("azimuth", &found["azimuth_deg"], 80.0, 0.1);
}

#[test]
fn three_axis_results_agree_with_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let both = [[1.0; 3], [-1.0; 3], [1.0; 3], [-1.0; 3], [1.0; 3], [-1.0; 3]];
    for found in computed(folder.path(), &record(&both, [0.0; 3])) {
        assert_eq!((found["good"].as_u64(), found["bad"].as_u64()), (Some(36), Some(0)), "{found}");
        assert_true(&found, 6e-3);
        // −1.168′ (docs/theory.md §3.3): rotation of the platform until the middle of a cycle; unequal pulses add −ε w/2 to the own drift.
        // Both have the same noise.
        let azimuth = |of: &Value| 60.0 * of["azimuth_deg"]["value"].as_f64().unwrap();
        let raw = azimuth(&found["uncorrected"]) - azimuth(&found);
        assert!((raw + 1.168).abs() < 0.5, "{raw}′");
        let z = found["uncorrected"]["own_drift_deg_h"]["z"]["value"].as_f64().unwrap();
        assert!((z - 2.0 + 0.027).abs() < 0.004, "{z}");
    }
    let page = std::fs::read_to_string(folder.path().join("page.html")).unwrap();
    assert!(page.contains("Uncertainty about z") && page.contains("<svg"));
}

#[test]
fn axes_without_pulses_have_no_cycle() {
    let folder = tempfile::tempdir().unwrap();
    let mut cycles = Vec::new();
    for sign in [1.0, -1.0, 1.0, -1.0] {
        cycles.extend([[sign, 0.0, 0.0], [0.0, sign, 0.0], [0.0, 0.0, sign]]);
    }
    for found in computed(folder.path(), &record(&cycles, [0.0; 3])) {
        assert_eq!((found["good"].as_u64(), found["bad"].as_u64()), (Some(24), Some(0)), "{found}");
        assert_true(&found, 6e-3);
    }
}

/// −ε w/2 of 0.2, −0.1 and 0.3 % are −0.18, 0.09 and −0.27 °/h.
#[test]
fn two_amplitudes_give_the_inequality_of_three_torquers() {
    let folder = tempfile::tempdir().unwrap();
    let cycles: Vec<[f64; 3]> = [1.0, -1.0, 0.4, -0.4, 1.0, -1.0, 0.4, -0.4].map(|size| [size; 3]).to_vec();
    let gain = [2e-3, -1e-3, 3e-3];
    for found in computed(folder.path(), &record(&cycles, gain)) {
        // The extrapolation to zero amplitude increases the drift's uncertainty, not the azimuth's.
        assert_true(&found, 0.015);
        let unequal = found["inequality"].as_array().unwrap();
        assert_eq!(unequal.len(), 3, "{found}");
        for (found, truth) in unequal.iter().zip(gain) {
            let (value, sigma) = value(found);
            assert!((value - truth).abs() < 5.0 * sigma && sigma < 1e-4, "{value} ± {sigma}");
        }
        let z = found["uncorrected"]["own_drift_deg_h"]["z"]["value"].as_f64().unwrap();
        assert!(z < 1.85, "{z}");
    }
}

/// Two rounds of A B B A by the command: the trend is known between the visits.
#[test]
fn simulated_platform_is_evaluated_within_its_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let file = "[own]\nconstant_rad_s = [1e-5, -5e-6, 2e-6]\nramp_rad_s2 = [1e-9, 0.0, -1e-9]\nrandom_walk_rad_s_sqrt_s = 1e-10\n";
    std::fs::write(path.join("platform.toml"), file).unwrap();
    for words in [&["--gyro"][..], &["--gyro", "platform.toml"]] {
        let sim = [&["sim", "--axes", "3", "--out", "p.parquet", "--force", "--json", "-"], words].concat();
        let truth = stand(path, &sim).succeeded().json()["truth"].clone();
        let found = stand(path, &[&["drift", "compute", "p.parquet"][..], &JSON].concat()).succeeded().json();
        assert_eq!((found["good"].as_u64(), found["bad"].as_u64()), (Some(96), Some(0)), "{found}");
        let covers = |what: &str, entry: &Value, truth: f64, most: f64| {
            let (value, expanded) = (entry["value"].as_f64().unwrap(), entry["U"].as_f64().unwrap());
            assert!((value - truth).abs() <= expanded && expanded < most, "{what}: {value} ± {expanded}, truth {truth}");
        };
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            covers(axis, &found["own_drift_deg_h"][axis], truth["own_rad_s"][k].as_f64().unwrap() / DEG_H, 0.015);
            // About the vertical the apparent drift is that of the latitude.
            if axis != "y" {
                covers(axis, &found["apparent_drift_deg_h"][axis], truth["apparent_rad_s"][k].as_f64().unwrap() / DEG_H, 0.03);
            }
        }
        covers("azimuth", &found["azimuth_deg"], truth["azimuth_rad"].as_f64().unwrap().to_degrees(), 0.1);
    }
    for (words, message) in [
        (&["--axes", "2", "--gyro"][..], "2 is not in 3..=3"),
        (&["--axes", "3"], "--gyro"),
        (&["--axes", "3", "--seconds", "5", "--gyro"], "cannot be used with"),
        (&["--axes", "3", "--gyro", "bad.toml"], "bad.toml: torquer y: lag_s 11 is out of range: 0 to 10"),
    ] {
        std::fs::write(path.join("bad.toml"), "[[torquer]]\n[[torquer]]\nlag_s = 11.0\n[[torquer]]\n").unwrap();
        let ran = stand(path, &[&["sim", "--out", "bad.csv"][..], words].concat());
        assert!(ran.status == Some(2) && ran.err.contains(message) && !path.join("bad.csv").exists(), "{ran:?}");
    }
}

#[test]
fn turn_level_and_gain_errors_act_on_the_expected_axes() {
    let folder = tempfile::tempdir().unwrap();
    computed(folder.path(), &record(&[[1.0; 3], [-1.0; 3], [1.0; 3], [-1.0; 3]], [0.0; 3]));
    let with = |more: &[&str]| {
        let found = stand(folder.path(), &[&["drift", "compute", "three.parquet"], &JSON[..], more].concat()).succeeded().json();
        ["x", "y", "z"]
            .map(|axis| value(&found["own_drift_deg_h"][axis]).1)
            .into_iter()
            .chain([value(&found["azimuth_deg"]).1])
            .collect::<Vec<_>>()
    };
    let plain = with(&[]);
    // 1° of turn: half of it goes to the azimuth, the sine of the azimuth to x, its cosine to z; y is unaffected.
    let turn = with(&["--turn-error", "60"]);
    assert!((turn[3] - 0.5).abs() < 0.01 && turn[1] == plain[1], "{turn:?}");
    assert!((turn[0] / (5.144 * 80_f64.to_radians().sin() * 0.5_f64.to_radians()) - 1.0).abs() < 0.01, "{turn:?}");
    assert!((turn[2] / (5.144 * 80_f64.to_radians().cos() * 0.5_f64.to_radians()) - 1.0).abs() < 0.02, "{turn:?}");
    // 1° of level: the vertical part of the Earth's rotation to x and z, the horizontal one to y.
    let level = with(&["--level-error", "3600"]);
    for (found, rate) in level.iter().zip([14.134, 5.144, 14.134]) {
        assert!((found / (rate * 1_f64.to_radians()) - 1.0).abs() < 0.01, "{level:?}");
    }
    // 1 % of 1, −0.5 − 14.13 and 2 °/h.
    let gain = with(&["--gain-error", "1"]);
    for (found, part) in gain.iter().zip([0.01, 0.146_3, 0.02]) {
        assert!((found / part - 1.0).abs() < 0.02, "{gain:?}");
    }
}
