//! External records of real drives (STAND_DATA) compared with their authors' publications.
#![allow(clippy::unwrap_used)]

use identification::identify::fit::FitResult;
use identification::identify::fit::equation_error::{self, EquationErrorFit, Settings};
use identification::identify::residual;
use identification::log::Log;
use identification::model::Model;
use identification::recording::prepare;
use stand_tests::foreign::stand_data;
use stand_tests::own::fit_or_compare;
use stand_tests::real::{correlation_with_map, noted, position_rms, record, with_values};

/// The EMPS axis with these effects in addition to viscous and Coulomb friction.
fn axis(effects: &str, more: &str) -> Model {
    let text = format!(
        "[drive]\ninput = \"torque_N_m\"\noutputs = [\"theta_rad\"]\neffects = [\"viscous\", \"coulomb\", {effects}]\n[parameters]\n\
         inertia_kg_m2 = 50.0\nviscous_N_m_s = 100.0\ncoulomb_N_m = 10.0\n{more}"
    );
    Model::parse(&text, "the axis").unwrap()
}

/// The record as its authors interpret it: an instantaneous force. (The log's convention is the mean over the row.)
fn as_its_authors(data: &std::path::Path, name: &str) -> Log {
    noted(&record(data, name, &[]), "torque_N_m", "at t")
}

fn by_equation_error(log: &Log, model: &Model) -> EquationErrorFit {
    equation_error::fit(log, model, Settings::usual(log)).unwrap()
}

fn found(equation: &EquationErrorFit, name: &str) -> f64 {
    equation.parameters.list.iter().find(|p| p.name == name).unwrap().value
}

fn value(held: &FitResult, name: &str) -> f64 {
    held.parameters.list.iter().find(|p| p.name == name).unwrap().value
}

/// Tolerance of the force error, in per cent of the force. The margin at the record's ends and the row at which decimation starts change it
/// by 0.07.
const FORCE_ERROR: f64 = 0.1;

/// The published offset is on the friction side: load = −offset. Another filter may change inertia by 2 % and friction by 5 %.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn equation_error_finds_the_published_values_of_emps() {
    let data = stand_data();
    let log = as_its_authors(&data, "emps_train.csv");
    let symmetric = by_equation_error(&log, &axis("\"load\"", ""));
    for (name, published, part) in
        [("inertia_kg_m2", 95.11, 0.02), ("viscous_N_m_s", 203.5, 0.05), ("coulomb_N_m", 20.39, 0.05), ("load_N_m", 3.16, 0.05)]
    {
        let value = found(&symmetric, name);
        println!("{name}: {value:.3}, published {published}");
        assert!((value / published - 1.0).abs() < part, "{name}: {value}, published {published}");
    }
    let asymmetric = by_equation_error(&log, &axis("\"asymmetric-friction\"", ""));
    for (equation, published) in [(&symmetric, 4.08), (&asymmetric, 3.11)] {
        println!("force error {:.2} %, published {published} %", equation.error_percent);
        assert!((equation.error_percent - published).abs() < FORCE_ERROR, "{} %, published {published} %", equation.error_percent);
    }
}

/// The log's convention (force as the mean over its row) leaves a smaller residual than the authors' interpretation, most of all under the
/// pulses, and changes the parameters by no more than the published tolerance.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn force_of_emps_is_the_mean_over_its_row() {
    let data = stand_data();
    let model = axis("\"load\"", "");
    let by_row = by_equation_error(&record(&data, "emps_train.csv", &[]), &model);
    let by_instant = by_equation_error(&as_its_authors(&data, "emps_train.csv"), &model);
    assert!(by_row.error_percent < by_instant.error_percent, "{} {}", by_row.error_percent, by_instant.error_percent);
    assert!((found(&by_row, "inertia_kg_m2") / 95.11 - 1.0).abs() < 0.02);
    assert!((found(&by_row, "viscous_N_m_s") / 203.5 - 1.0).abs() < 0.05);
    let on_pulses = |log: &Log, equation: &EquationErrorFit| {
        equation_error::compare(log, &with_values(&model, &equation.parameters), Settings::usual(log)).unwrap().error_percent
    };
    let (row, instant) =
        (on_pulses(&record(&data, "emps_pulses.csv", &[]), &by_row), on_pulses(&as_its_authors(&data, "emps_pulses.csv"), &by_instant));
    println!("force error under pulses: {row:.2} % by the row, {instant:.2} % by the instant");
    assert!(row < 0.85 * instant, "{row} % by the row, {instant} % by the instant");
}

/// With the authors' parameters, so that only filter and decimation differ.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn pulses_leave_the_published_force_error() {
    let data = stand_data();
    let log = as_its_authors(&data, "emps_pulses.csv");
    let mut theirs = axis("\"load\"", "");
    theirs.set_all([("inertia_kg_m2", 95.1089), ("viscous_N_m_s", 203.5034), ("coulomb_N_m", 20.3935), ("load_N_m", 3.1648)]).unwrap();
    let held = equation_error::compare(&log, &theirs, Settings::usual(&log)).unwrap();
    println!("force error {:.2} %, published 5.98 %", held.error_percent);
    assert!((held.error_percent - 5.98).abs() < FORCE_ERROR, "{} %", held.error_percent);
}

/// A free run weights accumulated errors, so its mass is below that of the equation error and its Coulomb friction above (README of the
/// records: M near 89, Fv 163, Fc 25, from positions). `stand` compares increments, and its result is between the two.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn free_run_of_emps_is_between_the_published_free_run_and_the_equation_error() {
    let data = stand_data();
    let log = record(&data, "emps_train.csv", &[]);
    let model = axis("\"load\"", "");
    let (free, equation) = (fit_or_compare(&log, &model, true).unwrap(), by_equation_error(&log, &model));
    for (name, published) in [("inertia_kg_m2", 89.0), ("viscous_N_m_s", 163.0), ("coulomb_N_m", 25.0)] {
        let (free, row_by_row) = (value(&free, name), found(&equation, name));
        println!("{name}: {published} published for positions, {free:.2} free run, {row_by_row:.2} equation error");
        assert!((free - published) * (free - row_by_row) < 0.0, "{name}: {published}, {free}, {row_by_row}");
    }
}

/// Fitted on the first record, simulated freely along the second. Published for models fitted to the position: 8.0 mm and 5.4 mm. Fits to
/// increments allow more position drift: within a factor of two of the published values, in the same ranking.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn asymmetric_friction_of_one_record_of_emps_improves_the_other() {
    let data = stand_data();
    let (train, pulses) = (record(&data, "emps_train.csv", &[]), record(&data, "emps_pulses.csv", &[]));
    let along_pulses = |effects: &str| {
        let model = axis(effects, "");
        let held = fit_or_compare(&train, &model, true).unwrap();
        1e3 * position_rms(&pulses, &with_values(&model, &held.parameters)).unwrap()
    };
    let (coulomb, asymmetric) = (along_pulses("\"load\""), along_pulses("\"asymmetric-friction\""));
    println!("rms of the position along the pulses: Coulomb {coulomb:.1} mm, asymmetric {asymmetric:.1} mm; published 8.0 and 5.4");
    assert!(coulomb < 16.0 && asymmetric < 10.8, "{coulomb} mm, {asymmetric} mm");
    assert!(asymmetric < 0.75 * coulomb, "{coulomb} mm, {asymmetric} mm");
}

/// The positions themselves as objective, as the published free runs have it: structure and parameters from the first record alone, the
/// pulses used once. Published rms: 8.0 mm (Coulomb), 5.4 mm (asymmetric), 4.25 mm (with Stribeck), 2.64 mm (a neural network with the
/// structure of the model).
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn free_run_of_emps_fitted_to_positions_is_near_the_published_ones() {
    let data = stand_data();
    let absolute = |name: &str| noted(&record(&data, name, &[]), "theta_rad", "compared absolutely");
    let (train, pulses) = (absolute("emps_train.csv"), absolute("emps_pulses.csv"));
    let run = |effects: &str| {
        let model = axis(effects, "");
        let held = fit_or_compare(&train, &model, true).unwrap();
        let fitted = with_values(&model, &held.parameters);
        let (trained, along_pulses) = (1e3 * position_rms(&train, &fitted).unwrap(), 1e3 * position_rms(&pulses, &fitted).unwrap());
        println!("{effects}: {trained:.2} mm on the first record, {along_pulses:.2} mm along the pulses");
        (trained, along_pulses)
    };
    let coulomb = run("\"load\"");
    let asymmetric = run("\"asymmetric-friction\"");
    let both = run("\"load\", \"asymmetric-friction\"");
    let stribeck = run("\"asymmetric-friction\", \"stribeck\"");
    assert!(
        coulomb.0 >= asymmetric.0 && asymmetric.0 >= stribeck.0 && asymmetric.0 >= both.0,
        "{coulomb:?} {asymmetric:?} {both:?} {stribeck:?}"
    );
    assert!(coulomb.1 < 1.1 * 8.0, "{coulomb:?}");
}

/// The residual of the first record's asymmetric model under the pulses correlates with the rate.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn model_of_the_first_record_of_emps_fails_on_the_second_over_the_rate() {
    let data = stand_data();
    let (train, pulses) = (record(&data, "emps_train.csv", &[]), record(&data, "emps_pulses.csv", &[]));
    let model = axis("\"load\", \"asymmetric-friction\"", "");
    let trained = with_values(&model, &fit_or_compare(&train, &model, true).unwrap().parameters);
    let (compared, _) = prepare::prepare(&pulses, &trained, true).unwrap();
    let failures = residual::misfits(&pulses, &compared, &fit_or_compare(&pulses, &trained, false).unwrap());
    let first = failures.first().expect("at least one misfit");
    println!("{}", stand_report::misfits::sentence(identification::log::Axis::Rotary, first));
    assert_eq!(first.coordinate.name(), "omega");
    assert!(first.explained_fraction > 0.5, "{}", first.explained_fraction);
}

/// u has two levels and the motor never reverses: Coulomb friction and a constant load are equivalent.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn friction_and_offset_of_the_gear_motor_are_not_distinguishable() {
    let data = stand_data();
    let log = record(&data, "dcmotor_un_prbs.csv", &[]);
    let chi2 = |effect: &str, more: &str| {
        let text = format!(
            "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"{effect}\"]\n[parameters]\ninertia_kg_m2 = 0.005\nviscous_N_m_s = 0.03\n\
             motor_constant_N_m_A = {{ value = 0.2, fixed = true }}\nresistance_ohm = {{ value = 1.0, fixed = true }}\n{more}"
        );
        fit_or_compare(&log, &Model::parse(&text, "the motor").unwrap(), true).unwrap().chi2
    };
    let (dry, load) = (chi2("coulomb", "coulomb_N_m = 0.05\n"), chi2("load", "load_N_m = -0.05\n"));
    // The fits end within 0.001 of the least χ².
    assert!((dry / load - 1.0).abs() < 1e-3, "{dry} {load}");
}

/// The gear motor with viscous and Coulomb friction and one more effect, from the catalogue's start.
fn gear_motor(log: &Log, effect: &str) -> FitResult {
    let text = format!(
        "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\", \"{effect}\"]\n[parameters]\ninertia_kg_m2 = 0.005\n\
         viscous_N_m_s = 0.03\ncoulomb_N_m = 0.05\nmotor_constant_N_m_A = {{ value = 0.2, fixed = true }}\n\
         resistance_ohm = {{ value = 1.0, fixed = true }}\n"
    );
    fit_or_compare(log, &Model::parse(&text, "the motor").unwrap(), true).unwrap()
}

/// Root mean square over all rows, and BIC over the fitted rows.
fn rms_and_bic(held: &FitResult) -> (f64, f64) {
    let c = &held.channels[0];
    let compared: Vec<f64> = c.residual.iter().copied().filter(|r| !r.is_nan()).collect();
    let all = (compared.iter().map(|r| r * r).sum::<f64>() / compared.len() as f64).sqrt();
    // Every fourth block is held out.
    let n = 0.75 * compared.len() as f64;
    let unknowns = held.parameters.list.iter().filter(|p| !p.fixed).count() + held.initial_states.kinds.len();
    (all, 2.0 * n * c.rms.ln() + unknowns as f64 * n.ln())
}

/// Half of the 20 ms over which the rate is counted.
const WINDOW_CENTRE_S: f64 = 0.010;

/// Known delay near 15 ms, ± 5 ms (a quarter of a row), for a rate taken as instantaneous. With that interpretation the skew is the whole
/// delay; with the rate as a mean, the delay is the window's centre plus the skew. The two differ because a mean also smooths, which the
/// instantaneous model replaces by inertia: by less than 5 ms, a quarter of the window. An exact first-order model on a 1 ms grid leaves
/// 0.0543 rad/s at 8.5 ms; its resolution is 0.5 ms.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn delay_of_the_gear_motor_equals_the_known_one() {
    let data = stand_data();
    let log = record(&data, "dcmotor_un_prbs.csv", &[]);
    let notes: Vec<_> = log.notes().iter().filter(|(key, _)| key != "encoder").cloned().collect();
    let without_note = Log::new(log.path(), log.columns().to_vec(), notes).unwrap();
    let (mean, instant) = (gear_motor(&log, "time-skew"), gear_motor(&without_note, "time-skew"));
    let (skew, instantaneous) = (value(&mean, "skew_s"), value(&instant, "skew_s"));
    let (rms, rms_at_once) = (rms_and_bic(&mean).0, rms_and_bic(&instant).0);
    println!("mean over 20 ms: {:.2} ms besides the window's 10, rms {rms:.4} rad/s", 1e3 * skew);
    println!("at the instant: {:.2} ms, rms {rms_at_once:.4} rad/s", 1e3 * instantaneous);
    assert!((skew - 0.0085).abs() < 0.0005, "{skew} s");
    assert!((rms / 0.0543 - 1.0).abs() < 0.01, "{rms} rad/s");
    let whole = WINDOW_CENTRE_S + skew;
    assert!((whole - 0.015).abs() < 0.005 && (instantaneous - 0.015).abs() < 0.005, "{whole} s, {instantaneous} s");
    assert!((whole - instantaneous).abs() < 0.005, "{whole} s, {instantaneous} s");
}

/// Other effects that delay or smooth the rate fit no better: ΔBIC of six is the limit of distinguishable effects.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn delay_of_the_gear_motor_is_not_a_lag_or_an_elastic_shaft() {
    let data = stand_data();
    let log = record(&data, "dcmotor_un_prbs.csv", &[]);
    let held = |effect: &str| {
        let (rms, bic) = rms_and_bic(&gear_motor(&log, effect));
        println!("{effect}: rms {rms:.4} rad/s, BIC {bic:.0}");
        bic
    };
    let late = held("time-skew");
    for other in ["sensor-lag", "inductance", "compliance", "backlash"] {
        let bic = held(other);
        assert!(late < bic + 6.0, "{other}: BIC {bic}, of a delay {late}");
    }
}

/// Harmonic orders of the slow run, from its README.
const ORDERS: [u32; 5] = [7, 28, 14, 36, 12];

/// The map was measured at rest, the run under friction, which leads by part of a cogging period: a shift of at most 1/256 turn is allowed.
/// A map binned from the run correlates 0.97 after that shift; the five sines omit the noise.
#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn cogging_of_the_slow_run_equals_the_map_measured_at_rest() {
    let data = stand_data();
    let run = record(&data, "odrive_slow_run.csv", &[]);
    let text = std::fs::read_to_string(data.join("odrive_cogging_map.csv")).unwrap();
    let rows = text.lines().filter_map(|l| l.split_once(',')).filter_map(|(a, b)| Some((a.parse::<f64>().ok()?, b.parse::<f64>().ok()?)));
    let (theta, holding): (Vec<f64>, Vec<f64>) = rows.unzip();
    assert_eq!(theta.len(), 8192, "the map is whole");
    let mut model = "[drive]\ninput = \"theta_rad\"\noutputs = [\"i_A\"]\neffects = [\"coulomb\", \"viscous\"".to_owned();
    let marks: Vec<String> = (1..=ORDERS.len()).map(|k| if k == 1 { String::new() } else { format!("#{k}") }).collect();
    marks.iter().for_each(|m| model += &format!(", \"cogging{m}\""));
    model += "]\n[parameters]\nmotor_constant_N_m_A = { value = 1.0, fixed = true }\ncoulomb_N_m = 0.1\n";
    marks.iter().zip(ORDERS).for_each(|(m, order)| model += &format!("\"cogging_order{m}\" = {order}\n\"cogging_N_m{m}\" = 0.05\n"));
    let held = fit_or_compare(&run, &Model::parse(&model, "the slow motor").unwrap(), true).unwrap();
    // The holding torque is the cogging torque with opposite sign; K is 1 here, so it equals the current.
    let current = |theta: f64| {
        let one = |(m, order): (&String, u32)| {
            let (a, phase) = (value(&held, &format!("cogging_N_m{m}")), value(&held, &format!("cogging_phase_rad{m}")));
            -a * (f64::from(order) * theta + phase).sin()
        };
        marks.iter().zip(ORDERS).map(one).sum::<f64>()
    };
    let turn = std::f64::consts::TAU;
    let (unshifted, _) = correlation_with_map(current, &theta, &holding, 0.0);
    let (best, shift) = correlation_with_map(current, &theta, &holding, turn / 256.0);
    println!("correlation {unshifted:.3}, {best:.3} after 1/{:.0} turn", turn / shift);
    assert!(best >= 0.95, "{best} after {shift} rad");
    assert!(unshifted >= 0.90, "{unshifted}");
}
