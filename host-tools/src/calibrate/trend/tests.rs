use super::*;

fn point(day: f64, value: f64, stand: &str, parts: Vec<Part>) -> Point {
    let found = Quantity::new("scale", "1", value, parts);
    Point { began: format!("day {day}"), day, stand: stand.to_owned(), is_whole: true, found }
}

fn parts(noise: f64, clock: f64) -> Vec<Part> {
    vec![Part::measured("noise", noise, f64::INFINITY, ""), Part::known("clock", clock, "1", 1.0, "")]
}

#[test]
fn what_is_common_to_both_does_not_enter_their_difference() {
    let (a, b) = (point(0.0, 1.0, "s", parts(3e-5, 1e-3)), point(1.0, 1.0002, "s", parts(4e-5, 1e-3)));
    let change = Change::between(&a, &b);
    assert!((change.by.value - 2e-4).abs() < 1e-12 && (change.by.sigma() - 5e-5).abs() < 1e-12, "{change:?}");
    assert_eq!(change.common, ["clock"]);
    assert!(change.is_beyond(), "2e-4 is four times 5e-5");
    // Without anything in common it is √2 × 1e-3 and more.
    assert!((change.expanded_without / 1.96 / (2e-6_f64 + 2.5e-9).sqrt() - 1.0).abs() < 1e-3);
}

#[test]
fn another_stand_has_another_crystal() {
    let (a, b) = (point(0.0, 1.0, "s", parts(3e-5, 1e-3)), point(1.0, 1.0002, "t", parts(4e-5, 1e-3)));
    let change = Change::between(&a, &b);
    assert!(change.common.is_empty() && !change.is_beyond(), "{change:?}");
    assert!((change.by.expanded() - change.expanded_without).abs() < 1e-15);
}

#[test]
fn of_what_is_common_and_has_grown_the_growth_is_left() {
    let (a, b) = (point(0.0, 1.0, "s", parts(0.0, 1e-3)), point(1.0, 1.0, "s", parts(0.0, 1.5e-3)));
    assert!((Change::between(&a, &b).by.sigma() - 5e-4).abs() < 1e-12);
}

/// By hand: y = 1 + 0.1 d at days 0, 1, 3 with u = 0.1, 0.2, 0.1; weights 100, 25, 100; Σw = 225, mean day 325/225, Σw(d − d̄)² = 925 − 325²/225.
#[test]
fn the_line_is_the_weighted_one() {
    let of = |day: f64, u: f64, off: f64| point(day, 1.0 + 0.1 * day + off, "s", vec![Part::measured("noise", u, f64::INFINITY, "")]);
    let (at_first, slope) = line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 0.0), of(3.0, 0.1, 0.0)]).unwrap();
    let spread: f64 = 925.0 - 325.0 * 325.0 / 225.0;
    assert!((at_first - 1.0).abs() < 1e-12 && (slope.value - 0.1).abs() < 1e-12);
    assert!((slope.sigma() - spread.powf(-0.5)).abs() < 1e-12 && slope.dof() == f64::INFINITY && slope.unit == "1/d");
    // A point that is off by ten times its uncertainty makes the slope's larger, with one degree of freedom.
    let (_, rough) = line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 2.0), of(3.0, 0.1, 0.0)]).unwrap();
    assert!(rough.sigma() > 5.0 * slope.sigma() && (rough.dof() - 1.0).abs() < 1e-9, "{rough:?}");
    assert_eq!(line(&[of(0.0, 0.1, 0.0), of(1.0, 0.2, 0.0)]), None);
    assert_eq!(line(&[of(1.0, 0.1, 0.0), of(1.0, 0.2, 0.0), of(1.0, 0.1, 0.0)]), None, "all on one day");
}
