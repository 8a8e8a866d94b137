//! Logs of plain benches: one voltage for a whole run, a coarse encoder that rests, a rounded command, rows that are slow beside the
//! input, a sensor at the end of its range, rows at events. Each is simulated here, by the equations of [`super::other_drives`].

use std::f64::consts::TAU;

use identification::identify::explain::{Remark, Verdict, explain};
use identification::log::{Column, Log, LogWarning};
use identification::model::Model;
use identification::recording::prepare::PreparationNote;

use super::other_drives::{Draw, Drive, STEP_S, explained, fitted};

const DRIVE: Drive =
    Drive { inertia_kg_m2: 2.5e-4, motor_constant_N_m_A: 0.05, resistance_ohm: 2.0, viscous_N_m_s: 5e-5, coulomb_N_m: 2e-3 };
/// A geared motor at its output.
const GEARED: Drive =
    Drive { inertia_kg_m2: 1.5e-3, motor_constant_N_m_A: 0.3, resistance_ohm: 6.0, viscous_N_m_s: 0.02, coulomb_N_m: 0.05 };

/// The state at each of the times, with the voltage of (time, state) held for as long as it says the same.
fn motion(drive: &Drive, times_s: &[f64], begin: (f64, f64), mut voltage: impl FnMut(f64, (f64, f64)) -> f64) -> Vec<(f64, f64)> {
    let mut state = begin;
    let mut step = 0u64;
    let mut states = Vec::with_capacity(times_s.len());
    for t_s in times_s {
        while (step as f64 + 0.5) * STEP_S < *t_s {
            let u = voltage(step as f64 * STEP_S, state);
            state = drive.step(state, drive.current_A(u, state.0));
            step += 1;
        }
        states.push(state);
    }
    states
}

fn log(name: &str, columns: Vec<(&str, Vec<f64>)>) -> Log {
    let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new(name, columns, Vec::new()).expect("a log")
}

/// A model whose winding is known, with friction, from wrong values.
fn model(drive: &Drive) -> Model {
    let text = format!(
        "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\"]\n[parameters]\ninertia_kg_m2 = {}\nmotor_constant_N_m_A = {{ value = {}, fixed = true }}\nresistance_ohm = {{ value = {}, fixed = true }}\nviscous_N_m_s = {}\ncoulomb_N_m = {}\n",
        0.8 * drive.inertia_kg_m2,
        drive.motor_constant_N_m_A,
        drive.resistance_ohm,
        1.2 * drive.viscous_N_m_s,
        0.5 * drive.coulomb_N_m
    );
    Model::parse(&text, "believed.toml").expect("a model")
}

/// One voltage from rest, 1 s at 2 ms.
fn step(voltage_V: f64, seed: u64) -> Log {
    let mut draw = Draw::new(seed);
    let t_s: Vec<f64> = (0..500).map(|k| f64::from(k) * 2e-3).collect();
    let states = motion(&DRIVE, &t_s, (0.0, 0.0), |_, _| voltage_V);
    let omega = states.iter().map(|s| s.0 + 0.05 * draw.normal()).collect();
    let u = vec![voltage_V; t_s.len()];
    log("step.csv", vec![("t_s", t_s), ("u_V", u), ("omega_rad_s", omega)])
}

/// Value and standard error of a parameter; `None` where it is not determined.
fn estimate(log: &Log, name: &str) -> (f64, Option<f64>) {
    let result = fitted(log, &model(&DRIVE));
    let k = result.parameters.list.iter().position(|p| p.name == name).expect("a parameter");
    let undetermined = result.unidentifiable.iter().any(|u| u.parameter == name);
    (result.parameters.list[k].value, (!undetermined).then_some(result.sigmas[k]))
}

/// Under one voltage from rest, inertia and the two frictions can be exchanged: what is not determined has no ±, and that of the others
/// contains the exchange.
#[test]
fn one_step_does_not_determine_what_it_cannot() {
    for seed in 0..6 {
        let log = step(6.0, seed);
        let truths = [("inertia_kg_m2", 2.5e-4), ("viscous_N_m_s", 5e-5), ("coulomb_N_m", 2e-3)];
        for (name, truth) in truths {
            if let (value, Some(sigma)) = estimate(&log, name) {
                assert!((value - truth).abs() < 3.0 * sigma, "seed {seed}: {name} = {value} ± {sigma}, true {truth}");
            }
        }
    }
}

#[test]
fn steps_of_several_voltages_are_explained_together() {
    let logs: Vec<Log> = [3.0, 6.0, 9.0, -6.0].into_iter().zip(20..).map(|(u, seed)| step(u, seed)).collect();
    let e = explain(logs, &model(&DRIVE), &|_| {}).expect("an explanation");
    assert_eq!((e.verdict, &e.missing), (Verdict::Adequate, &Vec::new()));
    let inertia = e.explained.parameters.list[0].value;
    assert!((inertia / 2.5e-4 - 1.0).abs() < 2e-3, "{inertia}");
}

/// Rows are 2 to 14 ms apart, as of a logger that writes when something happened.
#[test]
fn rows_at_events_are_integrated_over_their_own_length() {
    let mut draw = Draw::new(3);
    let mut t_s = vec![0.0];
    while t_s.len() < 3000 {
        let interval = [2e-3, 3e-3, 2e-3, 3e-3, 2e-3, 8e-3, 13e-3, 14e-3][(8.0 * draw.even()) as usize % 8];
        t_s.push(t_s[t_s.len() - 1] + interval);
    }
    // The voltage changes at a row and is held until another one.
    let (mut u, mut level) = (Vec::new(), 0.0);
    for k in 0..t_s.len() {
        if k % 40 == 0 {
            level = 14.0 * draw.even() - 7.0;
        }
        u.push(level);
    }
    let at = |time: f64| u[t_s.partition_point(|t| *t <= time + 0.1 * STEP_S) - 1];
    let states = motion(&DRIVE, &t_s, (0.0, 0.0), |time, _| at(time));
    let omega = states.iter().map(|s| s.0 + 0.1 * draw.normal()).collect();
    let log = log("events.csv", vec![("t_s", t_s.clone()), ("u_V", u.clone()), ("omega_rad_s", omega)]);
    assert!(log.warnings().iter().any(|w| matches!(w, LogWarning::IrregularRows { .. })), "{:?}", log.warnings());
    assert_eq!(log.segments().len(), 1);
    for (name, truth) in [("inertia_kg_m2", 2.5e-4), ("viscous_N_m_s", 5e-5), ("coulomb_N_m", 2e-3)] {
        let (value, sigma) = estimate(&log, name);
        let sigma = sigma.expect("a determined parameter");
        assert!((value - truth).abs() < 4.0 * sigma && sigma < 0.1 * truth, "{name} = {value} ± {sigma}, true {truth}");
    }
}

/// A position loop with 102 counts per turn that mostly rests. Nothing is missing; what the readings do within a count is no evidence.
#[test]
fn coarse_encoder_that_rests_has_no_effect() {
    let quantum = TAU / 102.0;
    for seed in [70, 71, 75] {
        let mut draw = Draw::new(seed);
        let t_s: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 2e-3).collect();
        let targets: Vec<f64> = (0..20).map(|_| [-1.57, 0.0, 1.57][(3.0 * draw.even()) as usize % 3]).collect();
        let counted = |theta: f64| (theta / quantum).round() * quantum;
        let (mut u, mut held, mut due_s) = (Vec::new(), 0.0, 0.0);
        let states = motion(&GEARED, &t_s, (0.0, 0.0), |time, (_, theta)| {
            if time >= due_s - 0.1 * STEP_S {
                held = (50.0 * (targets[(time / 1.0) as usize % 20] - counted(theta))).round().clamp(-24.0, 24.0) / 2.0;
                u.push(held);
                due_s += 2e-3;
            }
            held
        });
        u.resize(t_s.len(), held);
        let theta = states.iter().map(|s| counted(s.1)).collect();
        let e = explained(log("coarse.csv", vec![("t_s", t_s), ("u_V", u), ("theta_rad", theta)]), &model(&GEARED));
        assert_eq!((e.verdict, &e.missing), (Verdict::Adequate, &Vec::new()), "seed {seed}");
    }
}

/// A multisine in steps of a fifth of the row: what it did between the rows is not known, and is no torque of its own.
fn multisine(time: f64) -> f64 {
    const FREQUENCIES_HZ: [f64; 12] = [0.4, 0.9, 1.7, 2.9, 4.3, 6.1, 8.3, 12.0, 17.0, 23.0, 31.0, 41.0];
    let held = (time * 1e3 + 1e-6).floor() * 1e-3;
    FREQUENCIES_HZ.iter().enumerate().map(|(k, f)| 0.9 * (TAU * f * held + 1.7 * (k * k) as f64).sin()).sum()
}

#[test]
fn input_between_slow_rows_is_no_torque_of_its_frequencies() {
    let mut draw = Draw::new(5);
    let t_s: Vec<f64> = (0..6000).map(|k| f64::from(k) * 5e-3).collect();
    let states = motion(&DRIVE, &t_s, (0.0, 0.0), |time, _| multisine(time));
    let u = t_s.iter().map(|t| multisine(*t)).collect();
    let omega = states.iter().map(|s| s.0 + 0.02 * draw.normal()).collect();
    let theta = states.iter().map(|s| (s.1 / 3e-4).floor() * 3e-4).collect();
    let e = explained(log("slow.csv", vec![("t_s", t_s), ("u_V", u), ("omega_rad_s", omega), ("theta_rad", theta)]), &model(&DRIVE));
    assert_eq!((e.verdict, &e.missing), (Verdict::Adequate, &Vec::new()));
}

/// The same rows with a torque of its own frequency beside: it is still found.
#[test]
fn torque_of_another_frequency_beside_a_multisine_is_found() {
    let mut draw = Draw::new(6);
    let t_s: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
    let torque = |time: f64| 1.5e-3 * (TAU * 7.3 * time).sin();
    // A torque acts as a voltage R/K times as large.
    let equivalent = |time: f64| multisine(time) + torque(time) * DRIVE.resistance_ohm / DRIVE.motor_constant_N_m_A;
    let states = motion(&DRIVE, &t_s, (0.0, 0.0), |time, _| equivalent(time));
    let u = t_s.iter().map(|t| multisine(*t)).collect();
    let omega = states.iter().map(|s| s.0 + 0.02 * draw.normal()).collect();
    let e = explained(log("torque.csv", vec![("t_s", t_s), ("u_V", u), ("omega_rad_s", omega)]), &model(&DRIVE));
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["timed-torque".to_owned()][..]));
}

/// The drive had the exact voltage; the column has it in steps of 24 mV.
#[test]
fn rounded_input_is_no_effect() {
    // The second has fewer levels than a measurement usually has.
    for step_V in [0.024, 0.4] {
        rounded_to(step_V);
    }
}

fn rounded_to(step_V: f64) {
    let mut draw = Draw::new(8);
    let t_s: Vec<f64> = (0..15_000).map(|k| f64::from(k) * 2e-3).collect();
    let voltage = |time: f64| {
        let held = (time * 500.0 + 1e-6).floor() / 500.0;
        1.1 * (TAU * 0.7 * held).sin() + 0.8 * (TAU * 0.13 * held + 1.0).sin() + 0.3 * (TAU * 3.1 * held).cos()
    };
    let states = motion(&DRIVE, &t_s, (0.0, 0.0), |time, _| voltage(time));
    let u = t_s.iter().map(|t| (voltage(*t) / step_V).round() * step_V).collect();
    let omega = states.iter().map(|s| s.0 + 2e-3 * draw.normal()).collect();
    let e = explained(log("rounded.csv", vec![("t_s", t_s), ("u_V", u), ("omega_rad_s", omega)]), &model(&DRIVE));
    assert_eq!((e.verdict, &e.missing), (Verdict::Adequate, &Vec::new()));
    let rounded = |r: &Remark| matches!(r, Remark::InputRounded { step, .. } if (step / step_V - 1.0).abs() < 0.01);
    assert!(e.remarks.iter().any(rounded), "{:?}", e.remarks);
}

/// A gyro on a platform that turns faster than its range: the rows at the ends say nothing, the others its scale and bias.
#[test]
fn sensor_at_the_end_of_its_range_keeps_its_scale() {
    let mut draw = Draw::new(9);
    let t_s: Vec<f64> = (0..8000).map(|k| f64::from(k) * 5e-3).collect();
    let rate = |t: f64| 8.0 * (TAU * 0.11 * t).sin() + 2.0 * (TAU * 0.37 * t).sin();
    let theta: Vec<f64> =
        t_s.iter().map(|t| -8.0 / (TAU * 0.11) * (TAU * 0.11 * t).cos() - 2.0 / (TAU * 0.37) * (TAU * 0.37 * t).cos()).collect();
    let omega: Vec<f64> = t_s.iter().map(|t| (1.01 * rate(*t) + 0.02 + 0.01 * draw.normal()).clamp(-4.363, 4.363)).collect();
    let beyond = omega.iter().filter(|v| v.abs() == 4.363).count();
    assert!(beyond > 2000);
    let text = "[drive]\ninput = \"theta_rad\"\noutputs = [\"omega_rad_s\"]\neffects = [\"rate-scale\", \"rate-bias\"]\n[parameters]\ninertia_kg_m2 = 1e-3\nrate_scale = 0\nrate_bias_rad_s = 0\n";
    let log = log("clipped.csv", vec![("t_s", t_s), ("theta_rad", theta), ("omega_rad_s", omega)]);
    let model = Model::parse(text, "sensor.toml").expect("a model");
    let (_, notes) = identification::recording::prepare(&log, &model, false).expect("the columns");
    let limited = |n: &PreparationNote| matches!(n, PreparationNote::Limited { rows, .. } if *rows >= beyond);
    assert!(notes.iter().any(limited), "{notes:?}");
    let result = fitted(&log, &model);
    for (name, truth) in [("rate_scale", 0.01), ("rate_bias_rad_s", 0.02)] {
        let k = result.parameters.list.iter().position(|p| p.name == name).expect("a parameter");
        let (value, sigma) = (result.parameters.list[k].value, result.sigmas[k]);
        assert!((value - truth).abs() < 4.0 * sigma && sigma < 0.05 * truth, "{name} = {value} ± {sigma}, true {truth}");
    }
}
