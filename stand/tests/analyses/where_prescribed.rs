//! Misfits of a model with prescribed motion: the required current is compared row by row.
#![allow(clippy::unwrap_used)]

use std::fmt::Write as _;
use std::process::Command;

use serde_json::Value;

/// 60 s of a slow turn at 100 Hz, 0.3 A of friction, with this amplitude of cogging at order 7, A.
fn log(cogging_A: f64) -> String {
    let mut text = String::from("# i_A: at t\nt_s,theta_rad,i_A\n");
    let mut seed = 1u64;
    for k in 0..6000 {
        let t = f64::from(k) * 0.01;
        let theta = t;
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let noise = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
        let current = 0.3 + cogging_A * (7.0 * theta + 1.0).sin() + 0.05 * noise;
        let _ = writeln!(text, "{t:.2},{theta:.6},{current:.6}");
    }
    text
}

const MODEL: &str = "[drive]\ninput = \"theta_rad\"\noutputs = [\"i_A\"]\neffects = [\"coulomb\"]\n[parameters]\n\
                     motor_constant_N_m_A = { value = 0.03, fixed = true }\ncoulomb_N_m = 0.008\n";

fn failures(cogging_A: f64) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    let (log_file, model) = (folder.path().join("run.csv"), folder.path().join("m.toml"));
    std::fs::write(&log_file, log(cogging_A)).unwrap();
    std::fs::write(&model, MODEL).unwrap();
    let mut stand = Command::new(env!("CARGO_BIN_EXE_stand"));
    let output = stand.arg("fit").arg(&log_file).arg("--model").arg(&model).args(["--json", "-"]).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    answer["failures"].as_array().unwrap().clone()
}

#[test]
fn cogging_appears_as_a_harmonic_of_the_current() {
    let list = failures(0.02);
    let first = list.first().expect("a failure");
    assert_eq!(first["output"], "i_A");
    assert_eq!(first["coordinate"], "theta", "{list:#?}");
    assert_eq!(first["order"], 7);
    // 0.02²/2 = 2.0e-4 A² of the cogging and 0.05²/12 = 2.1e-4 A² of the noise: half of the variance.
    let share = first["share"].as_f64().unwrap();
    assert!((0.40..0.58).contains(&share), "{share}");
    // F = n share/2(1 − share) ≈ 2900 on ν ≈ 2 × 25 values: at a steady rate an order is one spectral line, and its noise level is that of
    // the 25 neighbouring lines. (1 + 2F/ν)^(−ν/2) = 10^−52; ν within a fifth gives 10^−43 to 10^−60, and the number of trials subtracts up
    // to three from the exponent.
    let log10_p = first["log10_p"].as_f64().unwrap();
    assert!((-62.0..-40.0).contains(&log10_p), "{first}");
    // The current of a prescribed motion does not distinguish a torque from a sensor error.
    let message = first["says"].as_str().unwrap();
    assert!(message.contains("a torque that depends on the angle, or a sensor error"), "{message}");
}

#[test]
fn slow_turn_with_friction_alone_has_no_misfit() {
    assert_eq!(failures(0.0), Vec::<Value>::new());
}
