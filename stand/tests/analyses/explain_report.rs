//! Formats of an explanation: JSON, text and HTML.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{MODEL, stand};
use drive_model::Coordinate;
use identification::identify::explain::{Explanation, Shape, ShapeForm, Verdict, explain};
use identification::log::Log;
use identification::model::{Model, SummingPoint};
use identification::statistics::bins::Bin;
use stand_report::{Style, explain_html, explain_json, explain_text};

/// An explanation of a plausible log.
fn explanation() -> Explanation {
    let folder = tempfile::tempdir().unwrap();
    stand(folder.path(), &["sim", "--out", "log.csv", "--seconds", "3"]).succeeded();
    let log = Log::read(folder.path().join("log.csv")).unwrap();
    explain(vec![log], &Model::parse(MODEL, "drive.toml").unwrap(), &|_| ()).unwrap()
}

/// A rubbing sector of the turn.
fn shape() -> Shape {
    let bin = |k: usize| {
        let at = (k as f64 + 0.5) * std::f64::consts::TAU / 36.0;
        Bin { at, mean: if (10..14).contains(&k) { -4e-4 } else { 1e-5 }, confidence: 2e-5 }
    };
    Shape {
        acts_on: SummingPoint::Torque,
        coordinate: Coordinate::Theta,
        form: ShapeForm::PiecewiseLinear { largest: 4e-4 },
        bins: (0..36).map(bin).collect(),
        expression: Some(
            "[effect.unknown]\ntorque_N_m = \"-a * exp(-((theta - b) / w)^2)\"\nparameters = { a = 4e-4, b = 2.1, w = 0.3 }".into(),
        ),
        delta_bic: -900.0,
    }
}

#[test]
fn unknown_structure_is_drawn_and_can_be_pasted() {
    let mut e = explanation();
    e.verdict = Verdict::UnknownStructure;
    e.unexplained = vec![shape()];
    let text = explain_text(&e, Style::default());
    let page = explain_html(&e);
    roxmltree::Document::parse_with_options(&page, roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() }).unwrap();
    for expected in [
        "no effect of the catalogue explains",
        "paste these lines at the end of drive.toml",
        "[effect.unknown]",
        "looks like a torque that depends on the angle",
    ] {
        let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(flat.contains(expected), "{expected}: {text}");
        assert!(page.contains(expected), "{expected}");
    }
    // The dip is at the drawing's lowest block.
    let drawn = text.lines().find(|l| l.contains('▁') && l.contains('█') && l.trim().chars().count() == 36).unwrap().trim();
    assert_eq!(drawn.chars().enumerate().filter(|(_, c)| *c == '▁').map(|(k, _)| k).collect::<Vec<_>>(), [10, 11, 12, 13]);
    // The model accepts the proposed lines unchanged.
    let model = format!("{MODEL}\n{}\n", e.unexplained[0].expression.as_ref().unwrap());
    assert!(Model::parse(&model, "drive.toml").unwrap().effect_names().contains(&"unknown".to_owned()));
    assert_eq!(explain_json(&e)["unexplained"][0]["bins"].as_array().unwrap().len(), 36);
}

#[test]
fn non_finite_numbers_are_null_or_a_dash() {
    let mut e = explanation();
    for stage in &mut e.stages {
        for o in &mut stage.outputs {
            (o.rms, o.heldout_rms) = (f64::NAN, Some(f64::INFINITY));
        }
    }
    let c = e.candidates.first_mut().unwrap();
    (c.refitted, c.delta_bic, c.p_value, c.log10_p) = (true, Some(f64::NAN), 0.0, f64::NEG_INFINITY);
    let answer = explain_json(&e);
    assert!(answer["steps"][0]["rms"]["omega_rad_s"].is_null() && answer["steps"][0]["heldout_rms"]["i_A"].is_null());
    assert!(answer["candidates"][0]["delta_bic"].is_null() && answer["candidates"][0]["log10_p"].is_null());
    let (text, page) = (explain_text(&e, Style::default()), explain_html(&e));
    for form in [&text, &page] {
        assert!(!form.contains("NaN") && !form.contains("inf "), "{form}");
    }
}

#[test]
fn share_of_a_step_is_the_fraction_of_the_error_that_it_removed() {
    let mut e = explanation();
    // From 5 to 3 to 1 times the noise in each channel: (25 − 9)/24 and (9 − 1)/24 of the variance above the noise.
    let stage = |ratio: f64| {
        let mut stage = e.stages[0].clone();
        for o in &mut stage.outputs {
            o.rms = ratio * o.noise;
        }
        stage
    };
    let stages = vec![stage(5.0), stage(3.0), stage(1.0)];
    e.stages = stages;
    let answer = explain_json(&e);
    let share = |k: usize| answer["steps"][k]["share"].as_f64();
    assert_eq!(share(0), None);
    for (k, wanted) in [(1, 16.0 / 24.0), (2, 8.0 / 24.0)] {
        assert!((share(k).unwrap() - wanted).abs() < 1e-9, "{:?}", share(k));
    }
}
