//! The detection limits of an adequate model are true: an effect at its limit is found, one far below it is not.
//! More logs: `cargo bench -p stand-tests --bench detection`.

use host_tools::identify::explain::{Explanation, Verdict, explain};
use stand_tests::draw::Drawn;

fn answer(drawn: &Drawn) -> Explanation {
    explain(vec![drawn.log()], &drawn.user_model(), &|_| {}).expect("an explanation")
}

#[test]
fn effect_at_its_detection_limit_is_found() {
    let drawn = Drawn::by_name("nulls/voltage/multi-step/7001").expect("a log");
    let null = answer(&drawn);
    assert_eq!(null.verdict, Verdict::Adequate);
    let limit = null.detection_limits.iter().find(|l| l.card.id == "cogging").expect("a limit of cogging");
    let at_limit = answer(&drawn.clone().with_effect_at(limit, 1.0));
    assert_eq!(at_limit.missing.first().map(String::as_str), Some("cogging"), "{:?}", at_limit.verdict);
    let below = answer(&drawn.with_effect_at(limit, 0.3));
    assert_eq!((below.verdict, below.missing.len()), (Verdict::Adequate, 0));
}
