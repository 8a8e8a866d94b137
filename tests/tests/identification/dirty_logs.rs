//! Imperfections of a bench are not called physics, and physics is found beside them. More logs:
//! `cargo run -p stand-tests --bin campaign -- explain KIND:`.

use std::collections::BTreeMap;

use identification::deadline::Deadline;
use identification::identify::evaluation::{Evaluation, ParameterTreatment, evaluate};
use identification::identify::explain::Refusal;
use identification::identify::explain::{Explanation, Remark, Verdict, explain};
use identification::identify::fit::parameters::Parameter;
use identification::log::{Log, LogWarning};
use identification::model::Model;
use identification::recording::prepare::PreparationNote;
use stand_tests::dirt::Dirt;
use stand_tests::draw::Drawn;

fn answer(id: &str, dirt: Dirt) -> Explanation {
    let drawn = Drawn::by_name(id).expect("a log of the table");
    explain(vec![dirt.on(&drawn.log(), drawn.seed())], &drawn.user_model(), &|_| {}).expect("an explanation")
}

/// What the explanation says of the imperfection.
fn is_said(e: &Explanation, dirt: Dirt) -> bool {
    let note = |wanted: fn(&PreparationNote) -> bool| e.remarks.iter().any(|r| matches!(r, Remark::Preparation(note) if wanted(note)));
    match dirt {
        Dirt::Clean | Dirt::SlowMean | Dirt::Counts => true,
        Dirt::Jitter => e.log.warnings().iter().any(|w| matches!(w, LogWarning::EvenTimes { scatter_us: 100..=130 })),
        Dirt::Outliers => note(|n| matches!(n, PreparationNote::Outliers { rows: 10..=60, .. })),
        Dirt::Coloured => e.remarks.iter().any(|r| matches!(r, Remark::ColouredNoise { ratio, .. } if (1.5..2.5).contains(ratio))),
        Dirt::SlowInstant => note(|n| matches!(n, PreparationNote::AssumedAtT { column: "u_V" })),
    }
}

#[test]
fn imperfections_of_a_bench_are_not_effects() {
    // More of them are in the baseline of explain.
    for (dirt, id) in Dirt::ALL.into_iter().zip(["nulls/voltage/multisine/7004", "nulls/rate/multi-step/7003"].into_iter().cycle()) {
        let e = answer(id, dirt);
        assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{} {id}: {:?}", dirt.name(), e.missing);
        assert!(is_said(&e, dirt), "{} {id}: {:?} {:?}", dirt.name(), e.remarks, e.log.warnings());
    }
}

#[test]
fn effect_is_found_beside_outliers_and_jitter_and_in_slow_rows() {
    for dirt in [Dirt::Outliers, Dirt::Jitter, Dirt::SlowMean] {
        let e = answer("own/cogging/voltage/multi-step/5", dirt);
        assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["cogging".to_owned()][..]), "{}", dirt.name());
    }
}

/// Under coloured noise rate and current begin together with the error of one step of their initial states.
#[test]
fn initial_states_under_coloured_noise_are_not_a_structure() {
    let e = answer("nulls/rate/multisine/9695", Dirt::Coloured);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
}

/// Beside outliers a jump of the angle by half a count seems to help.
#[test]
fn less_than_a_count_is_not_lost() {
    let e = answer("own/cable-spring/rate/sweep/9012", Dirt::Outliers);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["cable-spring".to_owned()][..]));
}

/// Beside viscous friction the voltage between slow rows leaves an error. A free function of the rate contains viscous friction and fits
/// slightly better.
#[test]
fn effect_is_named_rather_than_its_own_shape() {
    let e = answer("own/viscous/voltage/multi-step/9001", Dirt::SlowInstant);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["viscous".to_owned()][..]));
}

/// Rows of 5 ms under the speed loop do not show what the voltage does within them. A gear ripple fits that, with a gain that is
/// significant against the noise alone.
#[test]
fn what_the_voltage_may_do_within_slow_rows_is_no_effect() {
    let e = answer("nulls/rate/multisine/7100", Dirt::SlowMean);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
    let ripple = e.candidates.iter().find(|c| c.effect == "gear-ripple").expect("it is tried");
    assert!(matches!(ripple.refused, Some(Refusal::CourseOpen { .. })), "{:?}", ripple.refused);
    assert!(ripple.p_value < 1e-3, "against the noise alone: {}", ripple.p_value);
}

/// Coulomb and viscous friction that drift in opposite directions: together they are more significant than each, and together the voltage
/// within the rows moves them.
#[test]
fn two_amplitudes_together_do_not_imitate_the_voltage_within_slow_rows() {
    let e = answer("known/rate/sweep/9635", Dirt::SlowMean);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
}

/// A small effect imitates what the voltage does within the rows, which no note tells: cogging in a null; beside a load step a torque
/// ripple of 0.16 %.
#[test]
fn no_effect_imitates_the_voltage_within_slow_rows() {
    for (id, hidden) in [("nulls/voltage/multi-step/9038", None), ("own/load-step/voltage/multi-step/9013", Some("load-step"))] {
        let e = answer(id, Dirt::SlowMean);
        assert_eq!(e.missing.iter().map(String::as_str).collect::<Vec<_>>(), Vec::from_iter(hidden), "{id}");
    }
}

/// Beside an asymmetric friction a load step imitates a voltage that moves within the rows. By that the first effect alone is as likely.
#[test]
fn another_way_of_recording_is_preferred_to_a_second_effect() {
    let e = answer("own/asymmetric-friction/voltage/sweep/9003", Dirt::SlowMean);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["asymmetric-friction".to_owned()][..]));
    let moves = |r: &Remark| matches!(r, Remark::Preparation(PreparationNote::AssumedToMove { column: "u_V" }));
    assert!(e.remarks.iter().any(moves), "{:?}", e.remarks);
}

/// Angles of a slow drive do not tell in most rows which times are right, by the encoder's counts. With the stamps, beside the shaft, a
/// torque ripple seems to help.
#[test]
fn scattered_stamps_of_a_slow_drive_are_no_effect() {
    let e = answer("own/compliance/voltage/multisine/9014", Dirt::Jitter);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["compliance".to_owned()][..]));
    assert!(is_said(&e, Dirt::Jitter), "{:?}", e.log.warnings());
}

/// A program that logs its last output together with the readings that this output has led to.
#[test]
fn voltage_of_the_row_before_is_recognised() {
    let drawn = Drawn::by_name("nulls/voltage/multi-step/7004").expect("a log of the table");
    let slow = Dirt::SlowMean.on(&drawn.log(), drawn.seed());
    let mut columns = slow.columns().to_vec();
    for voltage in columns.iter_mut().filter(|c| c.name == "u_V") {
        voltage.values.rotate_right(1);
        voltage.values[0] = 0.0;
    }
    let log = |notes: Vec<(String, String)>| Log::new("before.parquet", columns.clone(), notes).expect("a log");
    let e = explain(vec![log(slow.notes().iter().cloned().collect())], &drawn.user_model(), &|_| {}).expect("an explanation");
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
    let is_said = |r: &Remark| matches!(r, Remark::Preparation(PreparationNote::AssumedOfRowBefore { column: "u_V" }));
    assert!(e.remarks.iter().any(is_said), "{:?}", e.remarks);
    let truth = drawn.true_model();
    let stated = slow.notes().iter().cloned().chain([("u_V".to_owned(), "over the row before t".to_owned())]).collect();
    for (p, sigma) in fitted(&log(stated), &truth) {
        let deviation = (p.value - truth.value(&p.name).expect("a true value")) / sigma;
        assert!(deviation.abs() < 4.0, "{}: {deviation} standard errors", p.name);
    }
}

/// The parameters of a model, fitted to a log, and their standard errors.
fn fitted(log: &Log, model: &Model) -> Vec<(Parameter, f64)> {
    let Ok(Evaluation::Evaluated(fitted)) = evaluate(log, model, ParameterTreatment::Fitted, Deadline::NEVER) else {
        panic!("{}: no fit", log.path().display())
    };
    fitted.result.parameters.list.into_iter().zip(fitted.result.sigmas).collect()
}

/// Deviations of the parameters of the true model, fitted to a log, in their standard errors.
fn deviations(id: &str, dirt: Dirt) -> Vec<(String, f64)> {
    let drawn = Drawn::by_name(id).expect("a log of the table");
    let truth = drawn.true_model();
    let deviation = |(p, sigma): (Parameter, f64)| {
        let deviation = (p.value - truth.value(&p.name).expect("a true value")) / sigma;
        (p.name, deviation)
    };
    fitted(&dirt.on(&drawn.log(), drawn.seed()), &truth).into_iter().map(deviation).collect()
}

/// A voltage that is stated to be held adds nothing to the standard errors, and is constant within the row also if its values are stated to
/// be at t.
#[test]
fn note_states_that_the_voltage_is_held() {
    let drawn = Drawn::by_name("own/quadratic-drag/voltage/multi-step/9007").expect("a log of the table");
    let (log, truth) = (Dirt::SlowMean.on(&drawn.log(), drawn.seed()), drawn.true_model());
    let inductance = |note: Option<&str>| {
        let notes = log.notes().iter().cloned().chain(note.map(|text| ("u_V".to_owned(), text.to_owned()))).collect::<Vec<_>>();
        let noted = Log::new("noted.parquet", log.columns().to_vec(), notes).expect("a log");
        let (p, sigma) = fitted(&noted, &truth).into_iter().find(|(p, _)| p.name == "inductance_H").expect("it is fitted");
        (p.value, sigma)
    };
    let (open, held) = (inductance(None), inductance(Some("held")));
    assert!(held.1 < 0.8 * open.1, "{held:?} {open:?}");
    assert_eq!(inductance(Some("at t, held")), held);
}

/// The voltage is updated once per millisecond, a fifth of a row of 5 ms. The lag of half of that looks as an inductance of five times the
/// true one. Of a standard error by times that are even between 0 and a row, which is that of a whole row over √3, it is √3/5 = 0.35.
#[test]
fn standard_errors_cover_how_long_values_are_held() {
    for (name, deviation) in deviations("nulls/voltage/multisine/9300", Dirt::SlowInstant) {
        let bounds = if name == "inductance_H" { 0.25..0.45 } else { -3.5..3.5 };
        assert!(bounds.contains(&deviation), "{name}: {deviation} standard errors");
    }
}

/// What the voltage does within slow rows shifts parameters by more than the noise: under the speed loop it moves, in voltage mode it jumps
/// with the profile.
#[test]
fn standard_errors_cover_what_the_voltage_may_do_within_slow_rows() {
    let e = answer("own/inertia-variation/rate/multisine/9017", Dirt::SlowMean);
    let truth = Drawn::by_name("own/inertia-variation/rate/multisine/9017").expect("a log of the table").true_model();
    let fit = &e.explained;
    let (k, found) = fit.parameters.list.iter().enumerate().find(|(_, p)| p.name == "inertia_variation").expect("it is found");
    let error = found.value - truth.value(&found.name).expect("a true value");
    assert!(error.abs() < 3.0 * fit.sigmas[k], "{error} ± {}", fit.sigmas[k]);

    let mut squares: BTreeMap<String, f64> = BTreeMap::new();
    let seeds = 9007..9019;
    for seed in seeds.clone() {
        for (name, deviation) in deviations(&format!("own/quadratic-drag/voltage/multi-step/{seed}"), Dirt::SlowMean) {
            *squares.entry(name).or_default() += deviation * deviation;
        }
    }
    // 12 logs: χ² at 0.1 % and 99.9 % for 12 degrees of freedom. By the noise alone it is 97 for the inductance.
    for (name, sum) in squares {
        assert!((2.2..32.9).contains(&sum), "{name}: mean square deviation {:.2} in {} logs", sum / seeds.len() as f64, seeds.len());
    }
}
