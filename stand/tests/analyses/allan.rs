//! Allan deviations against published values and closed forms; gaps; memory use of a long log.
#![allow(clippy::unwrap_used)]

use crate::common::gyro_noise;
use std::path::Path;
use std::process::Command;

use gyro_noise::Gyro;
use hal_sim::peripherals::Noise;
use identification::log::{Column, Log};
use serde_json::Value;
use stand_analysis::allan::deviation::{Series, Variance};
use stand_analysis::allan::{Request, Taus};
use stand_analysis::drift::integral::Integral;

#[track_caller]
fn close(found: f64, wanted: f64, relative: f64, what: &str) {
    assert!((found / wanted - 1.0).abs() <= relative, "{what}: {found}, not {wanted}");
}

fn deviations(variances: &[Variance]) -> Vec<f64> {
    variances.iter().map(|v| v.variance.sqrt()).collect()
}

fn whole(rates: Vec<f64>) -> Series {
    let rows = 0..rates.len();
    Series::of_rates(rates, &[rows])
}

/// The published figures of NIST SP 1065, from the external records.
fn published() -> Value {
    let data = std::env::var_os("STAND_DATA").expect("the environment variable STAND_DATA names the folder of the external records");
    let text = std::fs::read_to_string(Path::new(&data).join("nist_sp1065.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn deviations_of_the_thousand_points_of_sp_1065_are_as_published() {
    let data = published();
    let mut n: u64 = 1_234_567_890;
    let points: Vec<f64> = (0..1000)
        .map(|_| {
            let now = n as f64 / 2_147_483_647.0;
            n = n * 16_807 % 2_147_483_647;
            now
        })
        .collect();
    let series = whole(points);
    // Seven digits are printed: half of the last digit is the tolerance where that exceeds 1e-6.
    let printed = &data["published_m_1_10_100"];
    for (key, found) in [("OADEV", series.overlapping(&[1, 10, 100])), ("ADEV", series.plain(&[1, 10, 100]))] {
        for (found, wanted) in deviations(&found).iter().zip(numbers(&printed[key])) {
            close(*found, wanted, 1e-6, key);
        }
    }
    let long = &data["computed_octave_m_1_256"];
    let octaves: Vec<usize> = (0..9).map(|k| 1 << k).collect();
    let overlapping = series.overlapping(&octaves);
    for (key, found) in [("OADEV", &overlapping), ("ADEV", &series.plain(&octaves))] {
        for (found, wanted) in deviations(found).iter().zip(numbers(&long[key])) {
            close(*found, wanted, 1e-9, key);
        }
    }
    assert_eq!(overlapping.iter().map(|v| v.terms as f64).collect::<Vec<_>>(), numbers(&long["n_oadev"]));
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn deviations_of_ten_phase_points_are_as_published() {
    let data = published();
    let ten = &data["ten_point_phase"];
    let rows = 0..10;
    let series = Series::of_angles(numbers(&ten["x"]), &[rows], 1.0);
    for (key, found) in [("OADEV", series.overlapping(&[1, 2])), ("ADEV", series.plain(&[1, 2]))] {
        for (found, wanted) in deviations(&found).iter().zip(numbers(&ten[key])) {
            close(*found, wanted, 1e-6, key);
        }
    }
}

#[test]
fn ramp_sine_and_white_noise_match_closed_forms() {
    // R τ/√2, independent of the record's length.
    let series = whole((0..1_000_000).map(|k| 9.81 + 1e-9 * f64::from(k)).collect());
    for found in series.overlapping(&[1, 64, 4096, 300_000]) {
        close(found.variance.sqrt(), 1e-9 * found.factor as f64 / 2_f64.sqrt(), 1e-6, "ramp on an offset");
    }
    let series = whole((0..1_000_000).map(|k| 1e-3 * f64::from(k)).collect());
    for found in series.overlapping(&[1, 64, 4096, 300_000]) {
        close(found.variance.sqrt(), 1e-3 * found.factor as f64 / 2_f64.sqrt(), 1e-9, "ramp");
    }
    // A sin²(πfτ)/(πfτ) for a sine in continuous time. It holds for rows that are means over the row, over whole periods.
    let (amplitude, period) = (0.3, 1000.0);
    let angle = |k: f64| (std::f64::consts::TAU * k / period).cos();
    let mean = |k: i32| amplitude * period / std::f64::consts::TAU * (angle(f64::from(k)) - angle(f64::from(k) + 1.0));
    for m in [1_i32, 50, 125, 250, 400] {
        // Terms over whole periods.
        let rates: Vec<f64> = (0..100_000 + 2 * m - 1).map(mean).collect();
        let found = whole(rates).overlapping(&[m as usize])[0].variance.sqrt();
        let x = std::f64::consts::PI * f64::from(m) / period;
        close(found, amplitude * x.sin().powi(2) / x, 1e-9, "sine");
    }
    // σ/√m of white noise, to its own scatter.
    let mut noise = Noise::new(5, 0, 2.0);
    let series = whole((0..1_000_000).map(|_| noise.draw()).collect());
    for found in series.overlapping(&[1, 10, 100, 1000]) {
        let scatter = (found.factor as f64 * 0.7 / 1e6).sqrt();
        close(found.variance.sqrt(), 2.0 / (found.factor as f64).sqrt(), 4.0 * scatter, "white");
    }
}

#[test]
fn deviation_of_ten_million_rows_has_nine_digits() {
    // Integers with exact sums in i128: offset, ramp and noise together.
    let rows = 10_000_000_usize;
    let mut state = 7_u64;
    let whole_numbers: Vec<i64> = (0..rows)
        .map(|k| {
            state = state * 16_807 % 2_147_483_647;
            (state % 2001) as i64 + 5_000_000 + k as i64 / 5
        })
        .collect();
    let factors = [1, 1024, 1 << 20, 1 << 22];
    let found = whole(whole_numbers.iter().map(|v| *v as f64).collect()).overlapping(&factors);
    let mut sums = vec![0_i64; rows + 1];
    whole_numbers.iter().enumerate().for_each(|(k, v)| sums[k + 1] = sums[k] + v);
    for (m, found) in factors.into_iter().zip(found) {
        let terms = rows + 1 - 2 * m;
        let squares: i128 = (0..terms).map(|i| i128::from(sums[i + 2 * m] - 2 * sums[i + m] + sums[i]).pow(2)).sum();
        let exact = squares as f64 / (2.0 * (m as f64).powi(2) * terms as f64);
        close(found.variance.sqrt(), exact.sqrt(), 1e-9, &format!("{m}"));
        assert_eq!(found.terms, terms);
    }
}

#[test]
fn pulse_pairs_of_opposite_sign_are_the_allan_deviation_of_the_angle() {
    // (13) is the mean angle of the second pulse minus that of the first: ω̂ = (θ̄₂ − θ̄₁)/T. So σ_θ(T) = T rms(ω̂)/√2, with the
    // trapezoid's half weights as averages of neighbouring angles: overlapping for pairs that start at every sample, plain for pairs that
    // start at every pulse.
    let (per_pulse, pulse_s) = (250, 5.0);
    let mut rate = Noise::new(3, 0, 1e-4);
    let mut theta = 1e-3;
    let angles: Vec<f64> = (0..20_001)
        .map(|_| {
            theta += rate.draw() + 2e-6;
            theta
        })
        .collect();
    let series = whole(angles.windows(2).map(|w| (w[0] + w[1]) / 2.0).collect());
    let by_pulses = |stride: usize| {
        let pairs: Vec<f64> =
            (angles.windows(2 * per_pulse + 1).step_by(stride)).map(|w| Integral::of(w, pulse_s).unwrap().drift_rad_s().powi(2)).collect();
        pulse_s * (pairs.iter().sum::<f64>() / pairs.len() as f64 / 2.0).sqrt()
    };
    close(series.overlapping(&[per_pulse])[0].variance.sqrt(), by_pulses(1), 1e-9, "from every sample");
    close(series.plain(&[per_pulse])[0].variance.sqrt(), by_pulses(per_pulse), 1e-9, "from every pulse");
}

#[test]
fn no_difference_crosses_a_gap() {
    let gyro = Gyro { white: 1.0, ..Gyro::default() };
    let (one, two) = (gyro.rates(3000, 1.0, 1), gyro.rates(5000, 1.0, 2).iter().map(|v| v + 100.0).collect::<Vec<_>>());
    let parts = [whole(one.clone()), whole(two.clone())];
    let both = Series::of_rates([one, two].concat(), &[0..3000, 3000..8000]);
    for m in [1, 7, 256, 1400] {
        let pooled = both.overlapping(&[m])[0];
        let each = parts.each_ref().map(|p| p.overlapping(&[m])[0]);
        let terms = each.map(|v| v.terms as f64);
        let mean = (each[0].variance * terms[0] + each[1].variance * terms[1]) / (terms[0] + terms[1]);
        close(pooled.variance, mean, 1e-9, "pooled");
        assert_eq!(pooled.terms, each[0].terms + each[1].terms);
        let plain = parts.each_ref().map(|p| p.plain(&[m])[0]);
        let (a, b) = (plain[0].terms as f64, plain[1].terms as f64);
        close(both.plain(&[m])[0].variance, (plain[0].variance * a + plain[1].variance * b) / (a + b), 1e-9, "plain");
    }
    assert_eq!(both.overlapping(&[2000])[0].terms, parts[1].overlapping(&[2000])[0].terms, "the short run has none");
}

/// Largest resident set of this process so far, bytes.
#[cfg(target_os = "linux")]
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap();
    1024.0 * line.split_whitespace().nth(1).unwrap().parse::<f64>().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn long_log_needs_the_memory_of_one_column() {
    const LOG: &str = "STAND_ALLAN_LOG";
    let rows = 1 << 22;
    let column = 8.0 * f64::from(rows);
    // The measurement runs in a child process: this test with the log's name.
    if let Some(log) = std::env::var_os(LOG) {
        let before = peak();
        let request =
            Request { log: log.into(), column: "gyro_rad_s".into(), from_s: None, to_s: None, taus: Taus::Octave, interpretation: None };
        assert_eq!(request.answer().unwrap().rows, rows as usize);
        let grown = peak() - before;
        println!("{:.1} MB for a column of {:.1} MB", grown / 1e6, column / 1e6);
        // Parquet's pages and dictionary take some megabytes; a second column would take 34.
        assert!(grown < column + 16e6, "{grown} bytes for a column of {column}");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut noise = Noise::new(1, 0, 1e-3);
    let columns = [("t_s", None), ("gyro_rad_s", Some(())), ("u_V", Some(()))].map(|(name, noisy)| Column {
        name: name.to_owned(),
        values: (0..rows).map(|k| if noisy.is_some() { noise.draw() } else { f64::from(k) * 1e-3 }).collect(),
    });
    let log = Log::new("long.parquet", columns.into(), Vec::new()).unwrap();
    for name in ["long.parquet", "long.csv"] {
        let path = folder.path().join(name);
        log.write(&path).unwrap();
        let this = std::env::current_exe().unwrap();
        let output = Command::new(this)
            .args(["--exact", "allan::long_log_needs_the_memory_of_one_column", "--nocapture"])
            .env(LOG, &path)
            .output()
            .unwrap();
        let printed = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(
            output.status.success() && printed.contains("MB for a column"),
            "{name}: {printed}{}",
            String::from_utf8_lossy(&output.stderr)
        );
        println!("{name}: {}", printed.lines().find(|l| l.contains("MB for")).unwrap());
    }
}
