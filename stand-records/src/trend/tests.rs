use super::*;

fn point(day: f64, value: f64, stand: &str, contributions: Vec<Contribution<String>>) -> Point {
    let quantity = Quantity::new("scale", "1", value, contributions);
    Point { began: format!("day {day}"), day, stand: stand.to_owned(), is_complete: true, quantity }
}

fn contributions(noise: f64, clock: f64) -> Vec<Contribution<String>> {
    vec![Contribution::type_a("noise", noise, f64::INFINITY, String::new()), Contribution::type_b("clock", clock, "1", 1.0, String::new())]
}

#[test]
fn common_contributions_cancel_in_a_difference() {
    let (a, b) = (point(0.0, 1.0, "s", contributions(3e-5, 1e-3)), point(1.0, 1.0002, "s", contributions(4e-5, 1e-3)));
    let change = Change::between(&a, &b);
    assert!((change.difference.value - 2e-4).abs() < 1e-12 && (change.difference.combined_u() - 5e-5).abs() < 1e-12, "{change:?}");
    assert_eq!(change.common, ["clock"]);
    assert!(change.is_significant(), "2e-4 is four times 5e-5");
    // Taken as independent, the clock contributions add to √2 × 1e-3.
    assert!((change.independent_expanded_u / 1.96 / (2e-6_f64 + 2.5e-9).sqrt() - 1.0).abs() < 1e-3);
}

#[test]
fn contributions_of_different_stands_are_independent() {
    let (a, b) = (point(0.0, 1.0, "s", contributions(3e-5, 1e-3)), point(1.0, 1.0002, "t", contributions(4e-5, 1e-3)));
    let change = Change::between(&a, &b);
    assert!(change.common.is_empty() && !change.is_significant(), "{change:?}");
    assert!((change.difference.expanded_u() - change.independent_expanded_u).abs() < 1e-15);
}

#[test]
fn only_the_growth_of_a_common_contribution_remains() {
    let (a, b) = (point(0.0, 1.0, "s", contributions(0.0, 1e-3)), point(1.0, 1.0, "s", contributions(0.0, 1.5e-3)));
    assert!((Change::between(&a, &b).difference.combined_u() - 5e-4).abs() < 1e-12);
}

/// Calculated by hand: y = 1 + 0.1 d at days d = 0, 1, 3 with u = 0.1, 0.2, 0.1; weights w = 1/u² = 100, 25, 100; Σw = 225, Σwd = 325,
/// Σwd² = 925, Σw(d − d̄)² = 925 − 325²/225.
#[test]
fn line_is_fitted_by_weighted_least_squares() {
    let of = |day: f64, u: f64, off: f64| {
        point(day, 1.0 + 0.1 * day + off, "s", vec![Contribution::type_a("noise", u, f64::INFINITY, String::new())])
    };
    let TrendLine { at_first, slope, .. } = line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 0.0), of(3.0, 0.1, 0.0)]).unwrap();
    let spread: f64 = 925.0 - 325.0 * 325.0 / 225.0;
    assert!((at_first - 1.0).abs() < 1e-12 && (slope.value - 0.1).abs() < 1e-12);
    assert!((slope.combined_u() - spread.powf(-0.5)).abs() < 1e-12 && slope.effective_dof() == f64::INFINITY && slope.unit == "1/d");
    // A deviation of ten times its uncertainty enlarges the uncertainty of the slope and leaves one degree of freedom.
    let with_outlier = line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 2.0), of(3.0, 0.1, 0.0)]).unwrap();
    assert!(
        with_outlier.slope.combined_u() > 5.0 * slope.combined_u() && (with_outlier.slope.effective_dof() - 1.0).abs() < 1e-9,
        "{with_outlier:?}"
    );
    assert_eq!(line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 0.0)]), None, "two records");
    assert_eq!(line(&[of(1.0, 0.1, 0.0), of(1.0, 0.2, 0.0), of(1.0, 0.1, 0.0)]), None, "all on one day");
}
