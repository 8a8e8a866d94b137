//! Single records of the coverage campaign of Allan coefficients (docs/figures.md).

use stand_tests::campaign::coverage::allan::Mixture;

/// Strong random walk, of which variances at averaging factors 1 : 64 correlate by 0.17. Without these correlations the covariance matrix
/// was not positive definite, and the fit of this record had a quantisation noise that the record does not have, with N, B and K 5, 3 and
/// 12 U off.
#[test]
fn strong_random_walk_is_no_quantisation() {
    let folder = std::env::temp_dir().join(format!("stand-allan-mixture-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for the record");
    let mixture = Mixture::drawn(9309);
    let answer = mixture.answer(&mixture.log(9309, None, &folder)).expect("an answer");
    std::fs::remove_dir_all(&folder).expect("the folder is removed");
    let [q, n, b, k, r] = answer.coefficients;
    assert!(q.estimate.is_none() && r.estimate.is_none(), "{q:?} {r:?}");
    for (coefficient, truth) in [(n, mixture.white), (b, mixture.flicker), (k, mixture.walk)] {
        let found = coefficient.estimate.expect("N, B and K are shown");
        // B is 1.2 U off, an ordinary miss of an interval of 95 %.
        let error = (found.value - truth).abs() / found.expanded().expect("U is finite");
        assert!(error < 1.3, "{found:?}, truth {truth}: {error} U");
    }
}
