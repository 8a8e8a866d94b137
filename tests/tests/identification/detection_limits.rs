//! The detection limits of an adequate model are true: an effect at its limit is found, one far below it is not.
//! More logs: `cargo run -p stand-tests --bin campaign -- planted`.

use identification::identify::explain::{Explanation, Verdict, explain};
use stand_tests::dirt::Dirt;
use stand_tests::draw::Drawn;

fn answer(drawn: &Drawn, dirt: Dirt) -> Explanation {
    explain(vec![dirt.on(&drawn.log(), drawn.seed())], &drawn.user_model(), &|_| {}).expect("an explanation")
}

#[test]
fn effect_at_its_detection_limit_is_found() {
    let drawn = Drawn::by_name("nulls/voltage/multi-step/7001").expect("a log");
    let null = answer(&drawn, Dirt::Clean);
    assert_eq!(null.verdict, Verdict::Adequate);
    let limit = null.detection_limits.iter().find(|l| l.card.id == "cogging").expect("a limit of cogging");
    let at_limit = answer(&drawn.clone().with_effect_at(limit, 1.0), Dirt::Clean);
    assert_eq!(at_limit.missing.first().map(String::as_str), Some("cogging"), "{:?}", at_limit.verdict);
    let below = answer(&drawn.with_effect_at(limit, 0.3), Dirt::Clean);
    assert_eq!((below.verdict, below.missing.len()), (Verdict::Adequate, 0));
}

/// The unknown course of the voltage within rows of 5 ms is a second error, of which the limit takes account.
#[test]
fn effect_at_its_detection_limit_is_found_in_slow_rows() {
    let drawn = Drawn::by_name("nulls/rate/sweep/7018").expect("a log");
    let null = answer(&drawn, Dirt::SlowMean);
    assert_eq!(null.verdict, Verdict::Adequate);
    let limit = null.detection_limits.iter().find(|l| l.card.id == "brush-drop").expect("a limit of the brush drop");
    let at_limit = answer(&drawn.with_effect_at(limit, 1.0), Dirt::SlowMean);
    assert_eq!(at_limit.missing.first().map(String::as_str), Some("brush-drop"), "{:?}", at_limit.verdict);
}
