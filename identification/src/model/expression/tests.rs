use proptest::prelude::*;

use super::*;

const AT: Variables<f64> = Variables { t: 2.0, theta: 0.7, omega: -3.0, i: 0.25, u: 6.0, temp_C: 40.0 };

fn names() -> Vec<String> {
    ["a", "b", "w0"].map(str::to_owned).to_vec()
}

fn value(text: &str) -> f64 {
    Expression::parse(text, &names()).unwrap().eval(&AT, &[1.5, -2.0, 0.5])
}

fn message(text: &str) -> String {
    Expression::parse(text, &names()).unwrap_err().to_string()
}

#[test]
fn operators_have_the_usual_precedence() {
    for (text, wants) in [
        ("1 + 2 * 3", 7.0),
        ("(1 + 2) * 3", 9.0),
        ("8 - 3 - 2", 3.0),
        ("8 / 4 / 2", 1.0),
        ("2 ^ 3 ^ 2", 512.0),
        ("2 ** 3", 8.0),
        ("-2 ^ 2", -4.0),
        ("(-2) ^ 2", 4.0),
        ("2 ^ -1", 0.5),
        ("2 ^ a", 2f64.powf(1.5)),
        ("pow(2, a)", 2f64.powf(1.5)),
        ("-a * b", 3.0),
        ("2 * -a", -3.0),
        ("+a - -b", -0.5),
        ("1.5e-3 + .5 + 2.", 2.5015),
        ("t + theta + omega + i + u + T", 45.95),
        ("sin(pi / 2) + cos(0)", 2.0),
        ("atan2(1, -1)", 0.75 * std::f64::consts::PI),
        ("min(a, b) + 10 * max(a, b)", 13.0),
        ("sign(omega) + sign(0) + sign(a)", 0.0),
        ("abs(omega) + floor(-1.5) + sqrt(4)", 3.0),
        ("log10(1000) + ln(exp(2)) + log(exp(1))", 6.0),
        ("tan(0.3) - sin(0.3) / cos(0.3)", 0.0),
        ("asin(0.5) + acos(0.5) - pi / 2", 0.0),
        ("sinh(1) ^ 2 - cosh(1) ^ 2", -1.0),
        ("if(omega < 0, 1, 2) + (t > 1) + (t <= 2) + (t >= 3)", 3.0),
        ("if(1, 5, ln(-1))", 5.0),
        ("tanh(1e6) + atan(0)", 1.0),
        ("2 ^ 10 + 3 ^ 16 - 3 ^ 16", 1024.0),
    ] {
        let found = value(text);
        assert!((found - wants).abs() < 1e-12 * wants.abs().max(1.0), "{text} = {found}, not {wants}");
    }
}

#[test]
fn error_names_token_column_and_remedy() {
    for (text, wants) in [
        ("", "the expression is empty"),
        ("a * sin(omga)", "unknown name 'omga' at column 9; did you mean 'omega'?"),
        ("Omega", "unknown name 'Omega' at column 1; did you mean 'omega'?"),
        ("zzzzzzz", "unknown name 'zzzzzzz' at column 1; known names: t theta omega i u T pi"),
        ("sine(1)", "unknown function 'sine' at column 1; did you mean 'sin'?"),
        ("a * sin", "'sin' at column 5 is a function: write sin(…)"),
        ("sin(1, 2)", "'sin' at column 1 takes 1 argument, not 2"),
        ("atan2(1)", "'atan2' at column 1 takes 2 arguments, not 1"),
        ("sin()", "'sin' at column 1 takes 1 argument, not 0"),
        ("1 +", "the expression ends too early; expected a number, a name or a bracket"),
        ("(1 + 2", "the expression ends too early; expected a closing bracket"),
        ("1 + 2)", "unexpected ')' at column 6; expected an operator or the end"),
        ("1 2", "unexpected '2' at column 3; expected an operator or the end"),
        ("2omega", "'2omega' at column 1 is not a number"),
        ("1.2.3", "'1.2.3' at column 1 is not a number"),
        ("1e999", "'1e999' at column 1 is not a number"),
        ("a & b", "unexpected '&' at column 3; expected an operator or the end"),
        ("0,5 * a", "unexpected ',' at column 2; expected an operator or the end"),
    ] {
        let found = message(text);
        assert!(found.starts_with(wants), "{text} → {found}");
    }
    assert!(message(&"(".repeat(1000)).contains("too deeply nested"));
    assert!(message(&"-".repeat(100_000)).contains("too deeply nested"));
    assert!(message(&"1+".repeat(100_000)).contains("too deeply nested"));
}

#[test]
fn used_variables_and_parameters_are_known() {
    let e = Expression::parse("a * tanh(omega / w0)", &names()).unwrap();
    assert!(e.uses_omega() && !e.uses_theta() && !e.uses_t() && !e.uses_i() && !e.uses_u() && !e.uses_temp());
    assert!(e.uses_parameter(0) && !e.uses_parameter(1) && e.uses_parameter(2));
    assert_eq!(e.to_string(), "a * tanh(omega / w0)");
    assert!(is_reserved("atan2") && is_reserved("pi") && is_reserved("T") && !is_reserved("a"));
    assert!(is_name("w_0") && !is_name("0w") && !is_name("a-b") && !is_name(""));
}

type Dual = drive_model::Dual<8>;

/// One lane each: t, theta, omega, i, u, T, and the first two parameters.
fn dual(values: [f64; 8]) -> (Variables<Dual>, [Dual; 3]) {
    let lane = |k: usize| Dual::unknown(values[k], k);
    (Variables { t: lane(0), theta: lane(1), omega: lane(2), i: lane(3), u: lane(4), temp_C: lane(5) }, [lane(6), lane(7), Dual::from(0.5)])
}

fn plain(v: [f64; 8]) -> (Variables<f64>, [f64; 3]) {
    (Variables { t: v[0], theta: v[1], omega: v[2], i: v[3], u: v[4], temp_C: v[5] }, [v[6], v[7], 0.5])
}

#[test]
fn derivatives_are_finite_at_rest() {
    let at_rest = [0.0, 0.0, 0.0, 0.0, 0.0, 25.0, 1.0, 1.5];
    let (env, parameters) = dual(at_rest);
    for text in [
        "sqrt(abs(omega))",
        "abs(omega) ^ b",
        "abs(omega) ^ 0.5",
        "a * omega ^ 3",
        "atan2(omega, i)",
        "tanh(omega * 1e9)",
        "asin(1 + omega)",
        "omega ^ 2.5",
        "sign(omega)",
    ] {
        let value = Expression::parse(text, &names()).unwrap().eval(&env, &parameters);
        assert!(value.re.is_finite() && value.slopes.iter().all(|s| s.is_finite()), "{text}: {value:?}");
    }
    let (env, parameters) = dual([0.0, 0.0, 5000.0, 0.0, 0.0, 25.0, 1.0, 1.5]);
    let fast = Expression::parse("a * tanh(omega / 0.01)", &names()).unwrap().eval(&env, &parameters);
    assert_eq!(fast.re, 1.0);
}

/// Any tree, as text; smooth functions only where `smooth`.
fn tree(smooth: bool) -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        (0u32..if smooth { 4 } else { 1000 }, 0u32..4).prop_map(|(n, d)| format!("{}", f64::from(n) / 10f64.powi(d as i32))),
        prop::sample::select(vec!["t", "theta", "omega", "i", "u", "T", "pi", "a", "b", "w0"]).prop_map(str::to_owned),
    ];
    // Shallow where finite differences must hold: the sine of a huge number is all rounding.
    leaf.prop_recursive(if smooth { 3 } else { 5 }, 40, 3, move |inner| {
        let mut calls = vec!["sin", "cos", "tanh", "atan", "exp"];
        let mut pairs = vec!["+", "-", "*"];
        if !smooth {
            calls.extend(["tan", "asin", "acos", "ln", "log10", "sqrt", "abs", "sign", "sinh", "cosh", "floor"]);
            pairs.extend(["/", "^", "<", ">=", "<=", ">"]);
        }
        let pair = (inner.clone(), prop::sample::select(pairs), inner.clone()).prop_map(|(a, op, b)| format!("({a}) {op} ({b})"));
        let bare = (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("{a} - {b}"));
        let call = (prop::sample::select(calls), inner.clone()).prop_map(|(f, a)| format!("{f}({a})"));
        let minus = inner.clone().prop_map(|a| format!("-({a})"));
        let whole = (inner.clone(), -3i32..5).prop_map(move |(a, n)| format!("({a}) ^ {}", if smooth { n.abs() % 3 } else { n }));
        if smooth {
            prop_oneof![pair, bare, call, minus, whole].boxed()
        } else {
            let two = (prop::sample::select(vec!["atan2", "min", "max", "pow"]), inner.clone(), inner.clone());
            let two = two.prop_map(|(f, a, b)| format!("{f}({a}, {b})"));
            let three = (inner.clone(), inner.clone(), inner).prop_map(|(a, b, c)| format!("if({a}, {b}, {c})"));
            prop_oneof![pair, bare, call, minus, whole, two, three].boxed()
        }
    })
}

proptest! {
    #[test]
    fn parser_never_panics(text in any::<String>()) {
        let _ = Expression::parse(&text, &names());
    }

    #[test]
    fn parser_never_panics_on_valid_tokens(text in "([-+*/^(),<>=. ]|sin|omega|if|atan2|[0-9.e]{1,3}|a|pi){0,30}") {
        if let Ok(e) = Expression::parse(&text, &names()) {
            let _ = e.eval(&AT, &[1.0, 2.0, 3.0]);
        }
    }

    #[test]
    fn printed_text_parses_to_the_same_expression(text in tree(false)) {
        let first = Expression::parse(&text, &names()).unwrap();
        let again = Expression::parse(&first.to_string(), &names()).unwrap();
        prop_assert_eq!(&first.to_string(), &again.to_string());
        prop_assert_eq!(&first, &again, "{}", first);
        let (x, y) = (first.eval(&AT, &[1.5, -2.0, 0.5]), again.eval(&AT, &[1.5, -2.0, 0.5]));
        prop_assert!(x == y || (x.is_nan() && y.is_nan()));
    }

    #[test]
    fn dual_numbers_have_the_same_value(text in tree(false)) {
        let e = Expression::parse(&text, &names()).unwrap();
        let at = [2.0, 0.7, -3.0, 0.25, 6.0, 40.0, 1.5, -2.0];
        let (env, p) = plain(at);
        let (envs, ps) = dual(at);
        let (x, y) = (e.eval(&env, &p), e.eval(&envs, &ps).re);
        prop_assert!((x - y).abs() <= 1e-12 * x.abs() || (x.is_nan() && y.is_nan()) || x == y, "{} {} {}", e, x, y);
    }

    #[test]
    fn derivatives_equal_finite_differences(text in tree(true), at in prop::array::uniform8(-1.0f64..1.0)) {
        let e = Expression::parse(&text, &names()).unwrap();
        let (env, p) = dual(at);
        let exact = e.eval(&env, &p);
        prop_assume!(exact.re.is_finite() && exact.re.abs() < 1e6);
        let slopes = exact.slopes;
        for k in 0..8 {
            let f = |x: f64| {
                let mut moved = at;
                moved[k] = x;
                let (env, p) = plain(moved);
                e.eval(&env, &p)
            };
            // Two step widths: where they disagree the function is too wild for a finite difference to say anything.
            let difference = |h: f64| (f(at[k] + h) - f(at[k] - h)) / (2.0 * h);
            let (coarse, fine) = (difference(2e-5), difference(1e-5));
            let doubt = (coarse - fine).abs() + 1e-6 * (1.0 + exact.re.abs());
            prop_assume!(fine.is_finite());
            prop_assert!((slopes[k] - fine).abs() <= 10.0 * doubt + 1e-4 * (1.0 + fine.abs()), "{} by {}: {} {}", e, k, slopes[k], fine);
        }
    }
}
