//! `explain` with the engine in prediction-error form, on a sample of the logs of docs/figures.md. More: `cargo bench -p stand-tests --bench confusion`, with
//! the word `prediction-error`.

use drive_model::Coordinate;
use host_tools::identify::explain::{Criteria, Engine, Explanation, Remark, Verdict, explain_by};
use host_tools::model::Channel;
use stand_tests::dirt::Dirt;
use stand_tests::draw::Drawn;

fn drawn(id: &str) -> Drawn {
    Drawn::by_name(id).expect("a log of the table")
}

fn answer(drawn: &Drawn, dirt: Dirt) -> Explanation {
    let mut criteria = Criteria::default();
    criteria.search.engine = Engine::PredictionError;
    explain_by(criteria, vec![dirt.on(&drawn.log(), drawn.seed())], &drawn.user_model(), &|_| {}).expect("an explanation")
}

#[test]
fn cogging_is_found_and_its_value_is_covered() {
    let log = drawn("own/cogging/voltage/multi-step/5");
    let e = answer(&log, Dirt::Clean);
    assert_eq!((e.verdict, e.missing.as_slice()), (Verdict::EffectFound, &["cogging".to_owned()][..]));
    let truth = log.true_model().value("cogging_N_m").expect("a cogging torque");
    let fitted = e.explained.parameters.list.iter().zip(&e.explained.sigmas).find(|(p, _)| p.name == "cogging_N_m").expect("it is fitted");
    assert!((fitted.0.value - truth).abs() < 4.0 * fitted.1, "{} ± {} for {truth}", fitted.0.value, fitted.1);
}

/// The whitened engine names an effect on this log: the voltage moves within its rows of 5 ms.
#[test]
fn slow_rows_are_no_effect() {
    let e = answer(&drawn("nulls/rate/multisine/9006"), Dirt::SlowMean);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
}

#[test]
fn coloured_noise_is_noise_and_is_said() {
    let e = answer(&drawn("nulls/voltage/multi-step/9001"), Dirt::Coloured);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::Adequate, 0), "{:?}", e.missing);
    let said = |channel: Channel| e.remarks.iter().any(|r| matches!(r, Remark::ColouredNoise { channel: c, .. } if *c == channel));
    assert!(said(Channel::Rate) && said(Channel::Current), "{:?}", e.remarks);
}

#[test]
fn rub_in_a_sector_is_an_unknown_structure_over_the_angle() {
    let e = answer(&drawn("outsiders/sector-rub/voltage/multi-step/7"), Dirt::Clean);
    assert_eq!((e.verdict, e.missing.len()), (Verdict::UnknownStructure, 0), "{:?}", e.missing);
    assert_eq!(e.unexplained.first().map(|s| s.coordinate), Some(Coordinate::Theta));
}
