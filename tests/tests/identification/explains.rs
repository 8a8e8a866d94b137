//! `explain` on logs with a known answer. More logs: `cargo run -p stand-tests --bin campaign -- explain`.

use std::collections::BTreeMap;

use drive_model::Coordinate;
use hal_sim::plant::Stand;
use identification::deadline::Deadline;
use identification::identify::defects::defects;
use identification::identify::evaluation::{Evaluation, EvaluationRemark, ParameterTreatment, evaluate};
use identification::identify::explain::{Explanation, Options, Purpose, Refusal, Remark, Verdict, explain, explain_with};
use identification::identify::explain::{OpenPart, SearchState};
use identification::log::{Column, Log};
use identification::model::{Model, SummingPoint};
use stand_acquire::hidden::hide;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_report::comparison::Comparison;
use stand_report::comparison::words::conclusion;
use stand_tests::draw::Drawn;
use stand_tests::foreign::stand_data;
use stand_tests::own;

fn answer(logs: Vec<Log>, model: &Model) -> Explanation {
    explain(logs, model, &|_| {}).expect("an explanation")
}

/// Largest final ratio of rms to noise.
fn left(e: &Explanation) -> f64 {
    e.stages.last().expect("a stage").outputs.iter().map(|o| o.ratio()).fold(0.0, f64::max)
}

fn case(name: &str) -> Explanation {
    let folder = stand_data().join("cases").join(name);
    let model = Model::read(folder.join("model.toml")).expect("the model of the case");
    answer(vec![Log::read(folder.join("log.parquet")).expect("the log of the case")], &model)
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn only_the_hidden_effect_of_a_foreign_simulator_is_found() {
    for (name, hidden) in [
        ("06-cogging", "cogging"),
        ("10-resistance-temperature", "resistance-temperature"),
        ("19-encoder-eccentricity", "encoder-eccentricity"),
        ("21-time-skew", "time-skew"),
    ] {
        let e = case(name);
        assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &[hidden.to_owned()][..]), "{name}");
        // Everything is added, so only noise remains. 2 % covers the chance of 30 000 rows and the encoder's counts.
        assert!(left(&e) < 1.02, "{name}: {} × the noise is left", left(&e));
    }
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn foreign_null_log_is_adequate() {
    for name in ["00-none", "28-none"] {
        let e = case(name);
        assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{name}");
    }
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn oscillating_supply_is_an_unknown_structure_over_time() {
    let e = case("24-outside-hunting-supply");
    assert_eq!((e.verdict, e.missing.len()), (Verdict::UnknownStructure, 0));
    let shape = e.unexplained.first().expect("the remainder has a shape");
    assert_eq!(shape.coordinate.name(), "time");
    let pasted = format!("{}\n{}", e.model.to_toml(), shape.expression.as_ref().expect("an expression is proposed"));
    assert!(Model::parse(&pasted, "pasted").is_ok(), "the expression can be pasted into the model:\n{pasted}");
}

/// Ten seconds, three turns: an error of the angle reading in one sector is drawn over the angle, in the reading.
#[test]
fn bad_lines_of_the_encoder_are_an_error_of_its_reading() {
    let drawn = Drawn::by_name("outsiders/bad-lines/voltage/multi-step/1").expect("a log of the table");
    let whole = drawn.log();
    let ten_s = whole.columns().iter().map(|c| Column { name: c.name.clone(), values: c.values[..10_000].to_vec() }).collect();
    let log = Log::new("ten-seconds.parquet", ten_s, whole.notes().clone()).expect("a log");
    let e = answer(vec![log], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.len()), (Verdict::UnknownStructure, 0), "{:?}", e.missing);
    let shape = e.unexplained.first().expect("the remainder has a shape");
    assert_eq!((shape.coordinate, shape.acts_on), (Coordinate::Theta, SummingPoint::Angle));
    let pasted = format!("{}\n{}", e.model.to_toml(), shape.expression.as_ref().expect("an expression is proposed"));
    assert!(Model::parse(&pasted, "pasted").is_ok(), "the expression can be pasted into the model:\n{pasted}");
}

/// A sector of 13° is too narrow for a function that can be drawn; it is no noise nevertheless.
#[test]
fn narrow_error_of_the_encoder_is_no_noise() {
    let drawn = Drawn::by_name("outsiders/bad-lines/voltage/multisine/1").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.len()), (Verdict::UnknownStructure, 0), "{:?}", e.missing);
}

#[test]
fn own_null_log_is_adequate() {
    for (mode, seed) in [(Mode::Voltage, 3), (Mode::Rate, 4)] {
        let log = own::log(&Stand::default(), mode, ProfileKind::MultiStep, 30.0, seed);
        let e = answer(vec![log], &own::model(&[1.2, 0.9, 1.1, 1.25, 0.8, 1.0]));
        assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{mode:?}: {:?}", e.missing);
        assert!(!e.remarks.iter().any(compares_all_rows), "{:?}", e.remarks);
    }
}

fn compares_all_rows(remark: &Remark) -> bool {
    matches!(remark, Remark::NothingHeldOut(_))
}

/// A load that comes in the last block of held-out rows, from 10 s to 12 s: the fitted rows know nothing of it.
#[test]
fn event_in_held_out_rows_alone_is_found() {
    let load = BTreeMap::from([("load_step_N_m".to_owned(), 1e-3), ("load_from_s".to_owned(), 10.5)]);
    let stand = Stand { effects: BTreeMap::from([("load-step".to_owned(), load)]), ..Stand::default() };
    let log = own::log(&stand, Mode::Voltage, ProfileKind::Multisine, 11.9, 3);
    let model = own::model(&[1.2, 0.9, 1.1, 1.25, 0.8, 1.0]);
    let Ok(Evaluation::Evaluated(fitted)) = evaluate(&log, &model, ParameterTreatment::Fitted, Deadline::NEVER) else {
        panic!("a valid log")
    };
    let departs =
        |r: &EvaluationRemark| matches!(r, EvaluationRemark::HeldOutDeparts(d) if (9.9..10.1).contains(&d.from_s) && d.ratio > 3.0);
    assert!(fitted.remarks.iter().any(departs), "{:?}", fitted.remarks);
    let conclusion = conclusion(&Comparison::of(&log, &model, &fitted, true));
    assert!(conclusion.contains("The model lacks what acts from 10.0 s on."), "{conclusion}");
    let e = answer(vec![log], &model);
    assert_eq!((e.verdict, e.missing), (Verdict::EffectFound, vec!["load-step".to_owned()]));
    assert!(e.remarks.iter().any(compares_all_rows), "{:?}", e.remarks);
}

#[test]
fn own_cogging_is_found_and_leaves_the_noise() {
    let mut stand = Stand::default();
    hide("cogging", &mut stand).unwrap();
    let log = own::log(&stand, Mode::Rate, ProfileKind::MultiStep, 30.0, 5);
    let e = answer(vec![log], &own::model(&[1.1, 0.9, 1.1, 0.8, 1.2, 1.0]));
    assert_eq!(e.missing, ["cogging"]);
    // At rest between cogging positions, the quantisation of the angle is not random.
    assert!(left(&e) < 1.05, "{} × the noise is left", left(&e));
    let order = |model: &Model| model.value("cogging_order");
    assert_eq!(order(&e.model), stand.effects["cogging"].get("cogging_order").copied());
}

/// Without a measured temperature the coefficient of the resistance and the heat capacity have no scale. The answer says so, and gives the
/// values of a copper winding.
#[test]
fn temperature_of_the_winding_has_no_scale_without_a_thermometer() {
    let mut stand = Stand::default();
    hide("resistance-temperature", &mut stand).unwrap();
    let log = own::log(&stand, Mode::Voltage, ProfileKind::MultiStep, 60.0, 5);
    let columns = log.columns().iter().filter(|c| c.name != "temp_C");
    let columns = columns.map(|c| Column { name: c.name.clone(), values: c.values.clone() }).collect();
    let log = Log::new("cold.csv", columns, log.notes().clone()).unwrap();
    let e = answer(vec![log], &own::model(&[1.0; 6]));
    assert_eq!(e.missing, ["resistance-temperature"]);
    let scale = e.remarks.iter().find_map(|r| match r {
        Remark::TemperatureScale { copper_K_W, copper_J_K, .. } => Some((*copper_K_W, *copper_J_K)),
        _ => None,
    });
    let truth = &stand.effects["resistance-temperature"];
    let (K_W, J_K) = scale.expect("a remark");
    // The log is a third of the time constant long.
    assert!((J_K / truth["thermal_J_K"] - 1.0).abs() < 0.15, "{K_W} K/W, {J_K} J/K of {truth:?}");
    assert!((K_W / truth["thermal_K_W"] - 1.0).abs() < 0.5, "{K_W} K/W, {J_K} J/K of {truth:?}");
}

/// Under the speed loop a soft shaft may oscillate until the drive trips. Above the resonance the platform opposes the motor, which is no
/// exchange of columns and no reversed sign.
#[test]
fn oscillating_shaft_is_no_defect_of_the_log() {
    for seed in 2000..2030 {
        let profile = ["multi-step", "multisine", "prbs"][seed % 3];
        let drawn = Drawn::by_name(&format!("own/compliance/rate/{profile}/{seed}")).expect("a log of the table");
        assert_eq!(defects(&drawn.log(), &drawn.user_model()), [], "{profile}, {seed}");
    }
}

/// It slips in the last half second of seven.
#[test]
fn clutch_that_slips_at_the_end_is_no_reversed_current() {
    let drawn = Drawn::by_name("outsiders/slipping-clutch/rate/sweep/3").expect("a valid name");
    assert_eq!(defects(&drawn.log(), &drawn.user_model()), Vec::new());
}

#[test]
fn backlash_is_found_after_stribeck_friction() {
    let drawn = Drawn::by_name("several/2/voltage/multi-step/1").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["stribeck".to_owned(), "backlash".to_owned()][..]));
    assert!(left(&e) < 1.02, "{} × the noise is left", left(&e));
    let gap_rad = e.model.value("gap_rad").expect("a play");
    assert!((gap_rad / drawn.true_model().value("gap_rad").expect("a play") - 1.0).abs() < 0.01, "{gap_rad} rad");
}

#[test]
fn stribeck_friction_whose_first_step_blocks_the_rotor_is_found() {
    let drawn = Drawn::by_name("own/stribeck/rate/sweep/11").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["stribeck".to_owned()][..]));
    assert!(left(&e) < 1.02, "{} × the noise is left", left(&e));
}

#[test]
fn torque_ripple_is_found_in_short_windows_where_the_model_is_far_off() {
    // On the whole log the orders 5, 6, 12 and 25 have a higher score than the true one.
    let drawn = Drawn::by_name("own/torque-ripple/voltage/sweep/12").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["torque-ripple".to_owned()][..]), "{}", left(&e));
}

#[test]
fn unbalance_of_a_swinging_platform_is_not_presliding() {
    // The platform covers a third of a turn. Without the unbalance the fit ends at an inductance of 0.4 H.
    let drawn = Drawn::by_name("own/unbalance/voltage/multisine/13").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["unbalance".to_owned()][..]), "{}", left(&e));
    assert!(left(&e) < 1.02, "{} × the noise is left", left(&e));
}

#[test]
fn shapeless_remainder_near_the_noise_is_adequate() {
    // The noise of the angle, quantisation at an even rate, is 4 % larger than its estimate.
    let drawn = Drawn::by_name("nulls/rate/multi-step/6408").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{} × the noise is left", left(&e));
}

#[test]
fn small_gain_is_refused_where_only_noise_is_left() {
    // A load step of 3e-7 N m has ΔBIC = −24 and p = 1e-7. It is an error of the integration steps.
    let drawn = Drawn::by_name("known/voltage/sweep/6304").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::Adequate, &[][..]));
    let refused = e.candidates.iter().filter(|c| matches!(c.refused, Some(Refusal::OnlyNoiseLeft { .. })));
    assert!(refused.count() > 0, "no candidate was refused for this reason");
}

#[test]
fn small_gain_that_heldout_rows_do_not_confirm_is_refused() {
    // 1.005 × the noise is left with Stribeck friction. A cogging of order 238 has ΔBIC = −7 there.
    let drawn = Drawn::by_name("own/stribeck/rate/multisine/12").expect("a log of the table");
    let e = answer(vec![drawn.log()], &drawn.user_model());
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["stribeck".to_owned()][..]), "{}", left(&e));
}

#[test]
fn no_run_is_expected_to_separate_equal_voltages() {
    // A dead time subtracts the same voltage as the brushes: only a measurement at the terminals separates them.
    let drawn = Drawn::by_name("own/brush-drop/rate/multisine/12").expect("a log of the table");
    let next = answer(vec![drawn.log()], &drawn.user_model()).next.expect("a next experiment");
    let expected: Vec<f64> = next.expected.iter().map(|s| s.expected_delta_bic).collect();
    assert!(!expected.is_empty() && expected.iter().all(|e| *e < 6.0), "{expected:?}");
    let Purpose::Distinguish { effect, rival, .. } = next.purpose else { panic!("{:?}", next.purpose) };
    assert_eq!((effect.as_str(), rival.as_str()), ("brush-drop", "dead-time"));
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn gear_motor_has_coulomb_friction_or_an_offset_and_a_delayed_rate() {
    let data = stand_data();
    let text = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\"]\n[parameters]\ninertia_kg_m2 = 0.005\nviscous_N_m_s = 0.03\n\
                motor_constant_N_m_A = { value = 0.2, fixed = true }\nresistance_ohm = { value = 1.0, fixed = true }\n";
    let e = answer(vec![Log::read(data.join("dcmotor_un_prbs.csv")).unwrap()], &Model::parse(text, "the motor").unwrap());
    let family = ["coulomb", "brush-drop", "dead-time", "load", "asymmetric-friction"];
    assert!(e.missing.iter().any(|m| family.contains(&m.as_str())), "{:?}", e.missing);
    assert!(e.missing.iter().any(|m| m == "time-skew"), "{:?}", e.missing);
    // The rate is a mean over 20 ms, which delays it by 10 ms (a note states it). The total delay is 15 ± 5 ms.
    let skew_s = e.model.value("skew_s").unwrap();
    assert!((0.010 + skew_s - 0.015).abs() < 0.005, "{skew_s} s beyond the window's own delay");
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn linear_axis_has_coulomb_then_asymmetric_friction_and_no_quadratic_drag() {
    let data = stand_data();
    let log = || Log::read(data.join("emps_train.csv")).unwrap();
    let text = "[drive]\ninput = \"torque_N_m\"\neffects = [\"viscous\"]\n[parameters]\ninertia_kg_m2 = 100.0\nviscous_N_m_s = 200.0\n";
    let e = answer(vec![log()], &Model::parse(text, "viscous alone").unwrap());
    // A load step, Stribeck friction and a spring remove a third of the remainder, at 154 × the noise: they are removed again, and what is
    // left is not noise.
    assert_eq!(
        (e.verdict, e.missing.as_slice()),
        (Verdict::PartlyExplained, &["coulomb".to_owned(), "asymmetric-friction".to_owned()][..])
    );
    let text = "[drive]\ninput = \"torque_N_m\"\neffects = [\"viscous\", \"coulomb\", \"load\"]\n[parameters]\ninertia_kg_m2 = 95.0\n\
                viscous_N_m_s = 200.0\ncoulomb_N_m = 20.0\nload_N_m = 3.0\n";
    let e = answer(vec![log()], &Model::parse(text, "symmetric friction").unwrap());
    assert_eq!(e.missing[0], "asymmetric-friction");
    assert!(!e.missing.iter().any(|m| m == "quadratic-drag"));
}

/// Of two hidden effects the first is settled when the limit ends the search; the next run finds the second, as one run does. Neither
/// depends on the number of threads.
#[test]
fn continued_search_gives_the_same_answer() {
    let drawn = Drawn::by_name("several/2/voltage/multi-step/24007").expect("a log of the table");
    let run = |max_passes: u64, state: Option<&SearchState>, threads: usize| {
        let mut options = Options { state, ..Options::default() };
        options.criteria.search.max_passes = Some(max_passes);
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| explain_with(options, vec![drawn.log()], &drawn.user_model(), &|_| {}).expect("an explanation"))
    };
    let whole = run(400_000, None, 2);
    assert_eq!(whole.missing, ["encoder-eccentricity", "current-offset"]);
    let limit = (0.6 * whole.effort_passes) as u64;
    let (cut, on_one_thread) = (run(limit, None, 2), run(limit, None, 1));
    assert_eq!((cut.verdict, &cut.missing), (Verdict::NotFinished, &whole.missing[..1].to_vec()));
    assert_eq!((cut.effort_passes, &cut.missing), (on_one_thread.effort_passes, &on_one_thread.missing));
    let unfinished = cut.unfinished.expect("the state");
    assert_eq!(unfinished.open, OpenPart::AddingStep { number: 2 });
    let state = SearchState::parse(&unfinished.state).expect("the state as a file");
    let continued = run(400_000, Some(&state), 2);
    assert_eq!((continued.verdict, &continued.missing), (whole.verdict, &whole.missing));
    let (one, other) = (&whole.stages[2].parameters, &continued.stages[2].parameters);
    for (one, other) in one.iter().zip(other) {
        assert!((one.value - other.value).abs() <= 0.1 * one.sigma, "{}: {} {} ± {}", one.name, one.value, other.value, one.sigma);
    }
}
