use super::{Comparison, Misfit, fit_json, html, text};
use crate::numbers::{change, grouped, p_statement, p_value, plain, significant, with_sigma};
use crate::{Style, bad_log_html, bad_log_json, bad_log_text, sparkline};
use drive_model::Coordinate;
use identification::identify::evaluation::EvaluationRemark;
use identification::identify::fit::InitialStates;
use identification::identify::fit::{ChannelFit, FitResult, Parameters, Unidentifiable, build};
use identification::log::{Column, Log};
use identification::model::{Channel, Model};
use identification::recording::PreparedLog;
use identification::recording::prepared_log::ComparedChannel;
use identification::recording::voltage::InputTiming;
use serde_json::Value;

/// A log of a sine at 100 Hz.
fn log(rows: usize) -> Log {
    let t_s: Vec<f64> = (0..rows).map(|k| k as f64 * 0.01).collect();
    let column = |name: &str, f: &dyn Fn(f64) -> f64| Column { name: name.to_owned(), values: t_s.iter().map(|t| f(*t)).collect() };
    let columns = vec![
        column("t_s", &|t| t),
        column("u_V", &|t| t.sin()),
        column("i_A", &|t| 0.1 * t.cos()),
        column("theta_rad", &|t| 40.0 - 40.0 * t.cos()),
        column("omega_rad_s", &|t| 40.0 * t.sin() + noise(t)),
        column("temp_C", &|t| 25.0 + 0.01 * t),
    ];
    Log::new("run.csv", columns, vec![("stand".into(), "<bench> & \"tea\"".into())]).unwrap()
}

/// Reproducible white noise.
fn noise(t: f64) -> f64 {
    let k = (t * 100.0).round() as u64;
    let mixed = k.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ (k << 13);
    (mixed.wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 40) as f64 / f64::from(1 << 24) - 0.5
}

const MODEL: &str = "[drive]\ninput = \"u_V\"\neffects = [\"viscous\", \"coulomb\"]\n[parameters]\ninertia_kg_m2 = 2.5e-4\nmotor_constant_N_m_A = 0.05\nresistance_ohm = { value = 5.0, fixed = true }\nviscous_N_m_s = 6e-5\ncoulomb_N_m = 1e-3\n";

fn data(log: &Log) -> PreparedLog<'_> {
    let compared = |shows: Channel| ComparedChannel {
        channel: shows,
        measured: log.column(shows.column()).unwrap(),
        sample_interval_s: None,
        mean_before_s: None,
        filter_hz: None,
        instant: false,
        quantum: None,
        outliers: None,
        limited_rows: 0,
        magnitude: false,
    };
    PreparedLog {
        predictor: None,
        absolute_angle: false,
        t_s: log.t_s().into(),
        axis: Default::default(),
        input: log.column("u_V").unwrap().into(),
        voltage_course: None,
        input_timing: InputTiming::OverRow,
        driven: identification::model::Input::Voltage,
        theta: log.column("theta_rad"),
        theta_quantum: 0.0,
        current: log.column("i_A"),
        temp_C: None,
        supply_ratio: None,
        connected: None,
        known_motion: None,
        rate_from_encoder: false,
        columns: Vec::new(),
        run_begins: vec![0],
        segments: log.segments(),
        channels: vec![compared(Channel::Rate), compared(Channel::Angle)],
        dt_s: 0.01,
        held_out: Some(identification::recording::prepared_log::held_out_rows(log.t_s(), &log.segments(), &[])),
        budget: identification::budget::Budget::default(),
    }
}

fn result(model: &Model, log: &Log, rms: f64) -> FitResult {
    let (_, mut parameters): (_, Parameters) = build::system(model, true);
    for p in &mut parameters.list {
        match p.name.as_str() {
            "inertia_kg_m2" => p.value = 2.612e-4,
            "viscous_N_m_s" => p.value = -3e-5,
            "coulomb_N_m" => p.value = 0.0,
            _ => {}
        }
    }
    let residual: Vec<f64> = log.t_s().iter().map(|t| noise(*t) + 0.3 * (7.0 * t).sin()).collect();
    let mut angle = residual.clone();
    angle[..2].fill(f64::NAN);
    let fit = |shows, rms, heldout_rms, noise, residual| ChannelFit {
        channel: shows,
        is_increment: shows == Channel::Angle,
        rms,
        heldout_rms,
        noise,
        fit_percent: 96.2,
        white_p: 1e-9,
        rows: log.len(),
        residual,
    };
    FitResult {
        sigmas: vec![1.3e-6, 2.1e-4, 0.0, 4e-6, 0.0],
        covariance: nalgebra::DMatrix::zeros(5, 5),
        parameters,
        initial_states: InitialStates { kinds: vec![], values: vec![], prior: vec![], prior_sigma: vec![] },
        channels: vec![fit(Channel::Rate, rms, Some(0.33), 0.021, residual), fit(Channel::Angle, f64::NAN, None, 0.001, angle)],
        at_bound: Vec::new(),
        unidentifiable: vec![Unidentifiable { parameter: "motor_constant_N_m_A".into(), partner: Some(("inertia_kg_m2".into(), 0.9991)) }],
        converged: false,
        steps: 40,
        chi2: 1000.0,
        rests_on_course: false,
    }
}

fn with_comparison<R>(rows: usize, rms: f64, fitted: bool, check: impl FnOnce(&Comparison) -> R) -> R {
    let log = log(rows);
    let model = Model::parse(MODEL, "stand.toml").unwrap();
    let data = data(&log);
    let result = result(&model, &log, rms);
    let misfits = vec![Misfit {
        channel: Channel::Rate,
        coordinate: Coordinate::Theta,
        explained_fraction: 0.71,
        harmonic_orders: vec![7],
        p_value: 0.0,
        log10_p: f64::NEG_INFINITY,
        signature: Some(identification::identify::residual::Signature::AngleTorque),
    }];
    check(&Comparison {
        log: &log,
        model: &model,
        data: &data,
        result: &result,
        fitted,
        seconds: 0.123,
        remarks: &[EvaluationRemark::AssumedRateSource { from_encoder: true }],
        misfits: &misfits,
    })
}

#[test]
fn fit_as_text() {
    insta::assert_snapshot!(with_comparison(1000, 0.31, true, |c| text(c, Style::default())));
}

#[test]
fn residual_at_noise_level_is_reported() {
    let report = with_comparison(1000, 0.02, false, |c| text(c, Style::default()));
    let last_line = "The residual is at noise level in every channel: no missing effect is visible in this log.";
    assert!(report.replace('\n', " ").trim_end().ends_with(last_line), "{report}");
}

#[test]
fn lines_fit_the_terminal() {
    for width in [80, 120] {
        let report = with_comparison(1000, 0.31, true, |c| text(c, Style { colour: false, width }));
        for line in report.lines() {
            assert!(line.chars().count() <= width, "{width}: {line}");
        }
    }
}

#[test]
fn colour_only_on_request() {
    assert!(!with_comparison(100, 0.31, true, |c| text(c, Style::default())).contains('\u{1b}'));
    assert!(with_comparison(100, 0.31, true, |c| text(c, Style { colour: true, width: 80 })).contains('\u{1b}'));
}

#[test]
fn fit_as_json() {
    let answer = with_comparison(1000, 0.31, true, fit_json);
    insta::assert_snapshot!(serde_json::to_string_pretty(&answer).unwrap());
}

#[test]
fn json_has_no_nan() {
    fn numbers(v: &Value) -> bool {
        match v {
            Value::Number(n) => n.as_f64().is_some_and(f64::is_finite),
            Value::Array(list) => list.iter().all(numbers),
            Value::Object(map) => map.values().all(numbers),
            _ => true,
        }
    }
    let answer = with_comparison(1000, f64::NAN, true, fit_json);
    assert!(numbers(&answer));
    assert!(answer["outputs"]["omega_rad_s"]["rms"].is_null());
    assert!(answer["outputs"]["theta_rad"]["ratio"].is_null());
    assert!(answer["failures"][0]["log10_p"].is_null());
    assert_eq!(crate::json::value(&f64::INFINITY), Value::Null);
}

#[test]
fn page_is_well_formed_and_self_contained() {
    let page = with_comparison(1000, 0.31, true, html);
    for reference in ["http", "src=", "url(", "@import", "fetch("] {
        assert!(!page.contains(reference), "{reference}");
    }
    assert_eq!(page.matches("href=").count(), page.matches("href=\"#section-").count(), "links within the page only");
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(&page, options).unwrap();
    let drawings = document.descendants().filter(|n| n.has_tag_name("svg")).count();
    assert!(drawings >= 16, "{drawings}");
    assert!(page.contains("&lt;bench&gt; &amp; &quot;tea&quot;"));
    assert!(!page.contains("NaN") && !page.contains("inf\""));
}

#[test]
fn page_size_does_not_grow_with_the_log() {
    let (short, long) = (with_comparison(20_000, 0.31, true, html).len(), with_comparison(400_000, 0.31, true, html).len());
    assert!(long < 3_000_000 && (long as f64) < 1.3 * short as f64, "{short} and {long} bytes");
}

#[test]
fn page_of_one_hour_is_below_three_megabytes() {
    let bytes = with_comparison(3_600_000, 0.31, true, html).len();
    assert!(bytes < 3_000_000, "{bytes} bytes");
}

#[test]
fn numbers_have_significant_digits() {
    assert_eq!(with_sigma(0.0234, 1.2e-4), "0.02340 ± 0.00012");
    assert_eq!(with_sigma(2.5123e-4, 3.1e-6), "(2.512 ± 0.031) × 10⁻⁴");
    assert_eq!(with_sigma(-8e-5, 3.5e-5), "(−8.0 ± 3.5) × 10⁻⁵");
    assert_eq!(with_sigma(5.0, 0.0), "5");
    assert_eq!(with_sigma(4e-4, 0.012), "0.0004 ± 0.0120");
    assert_eq!(with_sigma(-3e-7, 0.012), "−3 × 10⁻⁷ ± 1.2 × 10⁻²");
    assert_eq!(with_sigma(0.0, 0.012), "0.000 ± 0.012");
    assert_eq!(significant(0.099_96, 3), "0.100");
    assert_eq!(significant(11_908.4, 3), "11908");
    assert_eq!(significant(f64::NAN, 3), "–");
    assert_eq!(plain(2.0e-5, 4), "2 × 10⁻⁵");
    assert_eq!(change(2.0, 2.2), "+10 %");
    assert_eq!(change(1.0, 3.0), "× 3.00");
    assert_eq!(grouped(3_600_000), "3\u{202f}600\u{202f}000");
}

#[test]
fn p_values_below_1e_12_are_not_printed_as_numbers() {
    let log10_p = [0.0, -1.5, -6.7, -11.9, -62341.0, f64::NEG_INFINITY, f64::NAN];
    assert_eq!(log10_p.map(p_value), ["1", "0.032", "2e-7", "1e-12", "< 1e-12", "< 1e-12", "–"]);
    assert_eq!((p_statement(-1.5), p_statement(-20.0)), ("p = 0.032".to_owned(), "p < 1e-12".to_owned()));
}

#[test]
fn sparkline_has_heights_and_gaps() {
    assert_eq!(sparkline(&[Some(0.0), Some(1.0), None, Some(8.0)], 8.0), "▁▁ █");
}

#[test]
fn bad_log_has_its_verdict_in_every_form() {
    let log = log(100);
    let problems = identification::log::plausible::check(&log, "torque_N_m");
    assert!(!problems.is_empty());
    assert_eq!(bad_log_json(&log, &problems)["verdict"], "bad-log");
    assert_eq!(bad_log_json(&log, &problems)["problems"][0]["code"], "missing-input");
    assert!(bad_log_text(&log, &problems, Style::default()).contains("torque_N_m"));
    let page = bad_log_html(&log, &problems);
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    assert!(roxmltree::Document::parse_with_options(&page, options).is_ok());
}
