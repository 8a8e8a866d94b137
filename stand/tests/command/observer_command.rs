//! `stand observer` and `stand vibration`.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{RunOutput, files, stand};
use hal_sim::element::{BaseVibration, FourState, LinearElement};
use serde_json::Value;
use stand_analysis::observer::vibration::{Correction, Measured, Period, VibrationUncertainties, compensate};
use stand_analysis::observer::{Kind, Plant, Poles, Request};

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn presets_give_their_published_gains() {
    let folder = tempfile::tempdir().unwrap();
    for (preset, k2) in [("astatic-identifier", -272250.941), ("astatic-identifier-recovered", -298287.758)] {
        let answer = stand(folder.path(), &["observer", "design", preset, "--json", "-"]).succeeded().json();
        let gains = numbers(&answer["gains"]);
        assert!((gains[0] - 300.0).abs() < 1e-9 && (gains[1] / k2 - 1.0).abs() < 1e-8, "{gains:?}");
        assert_eq!(answer["integral"]["row"], 2);
        assert!((answer["integral"]["gain"].as_f64().unwrap() + k2).abs() < 1e-3 && answer["poles"].as_array().unwrap().len() == 7);
        assert_eq!((numbers(&answer["discrete"]["gains"]).len(), &answer["discrete"]["step_s"]), (7, &Value::from(1e-3)));
        assert_eq!(answer["observability"]["rank"], 6);
    }
    let rate =
        stand(folder.path(), &["observer", "design", "--preset", "rate-observer", "--omega", "1000", "--json", "-"]).succeeded().json();
    assert!((numbers(&rate["gains"])[3] / -79910008.3 - 1.0).abs() < 1e-8 && rate["integral"].is_null());
}

#[test]
fn simulate_and_bode_match_theory() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["observer", "simulate", "astatic-identifier-recovered", "--kind", "augmented", "--json", "-", "--html", "s.html"];
    let answer = stand(folder.path(), &words).succeeded().json();
    let rest = |which: &str| numbers(&answer[which]["rest"])[0];
    assert!((rest("static") / 1.67473404e-7 - 1.0).abs() < 1e-7 && rest("astatic").abs() < 1e-20);
    let closed = |which: &str| answer[which]["closed_loop_rest_rad"].as_f64().unwrap();
    assert!((closed("static") / 1.31768166e-3 - 1.0).abs() < 1e-7 && closed("astatic").abs() < 1e-15);
    assert!(answer["astatic"]["settled_s"].as_f64().unwrap() <= 0.5);
    // Times are printed without an exponent.
    let text = stand(folder.path(), &words[..5]).succeeded().out;
    for (line, key) in [("angle error below 1 % after, s", "settled_s"), ("rate error below 1 % of peak, s", "rate_settled_s")] {
        let printed: Vec<&str> = text.lines().find_map(|l| l.strip_prefix(line)).unwrap().split_whitespace().collect();
        let known = ["static", "astatic"].map(|which| answer[which][key].as_f64().unwrap());
        let plain = |word: &&str, known: f64| !word.contains('e') && (word.parse::<f64>().unwrap() / known - 1.0).abs() < 1e-3;
        assert!(printed.len() == 2 && plain(&printed[0], known[0]) && plain(&printed[1], known[1]), "{line} {printed:?} {known:?}");
    }

    let words = ["observer", "bode", "rate-observer", "--omega", "10,100,1000", "--vibration-hz", "2", "--json", "-", "--html", "b.html"];
    let answer = stand(folder.path(), &words).succeeded().json();
    let from = answer["observers"][1]["distorted_from_rad_s"].as_f64().unwrap();
    assert!((from / 45.0 - 1.0).abs() < 5e-3, "{from}");
    for page in ["s.html", "b.html"] {
        let text = std::fs::read_to_string(folder.path().join(page)).unwrap();
        let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
        roxmltree::Document::parse_with_options(&text, options).unwrap();
        assert!(text.matches("<svg").count() >= 4, "{page}");
    }
    // With poles at 10 1/s, a rate at 10⁴ rad/s is attenuated by 107 dB (464/ω²), and the plot extends that far.
    let text = std::fs::read_to_string(folder.path().join("b.html")).unwrap();
    assert!(text.contains(">−100<"), "the gain is drawn to its end");
}

#[test]
fn invalid_design_gives_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let table = "[four_state]\nrotor_N_m_s = 0.4\ninertia_x_kg_m2 = 0.02\ninertia_y_kg_m2 = 8e-3\ninertia_z_kg_m2 = 0.02\npendulum_N_m = 1.0\n\
                 link_damping_N_m_s = 2.4e-3\nalpha_damping_N_m_s = 0.0\nbeta_damping_N_m_s = 1e-3\ngamma_damping_N_m_s = 2e-3\nlink_rad_s = 0.0\n";
    let file = |name: &str, text: String| std::fs::write(folder.path().join(name), text).unwrap();
    file("pole.toml", format!("{table}latitude_deg = 90.0\n"));
    let flat = table.replace("rotor_N_m_s = 0.4", "rotor_N_m_s = 1e-9").replace("link_damping_N_m_s = 2.4e-3", "link_damping_N_m_s = 1e6");
    file("flat.toml", format!("{flat}latitude_deg = 50.0\n"));
    file("typo.toml", format!("{table}latitude = 50.0\n"));
    file("short.toml", table.to_owned());
    file("good.toml", format!("{table}latitude_deg = 50.0\n"));
    let before = files(folder.path());
    let cases: [(&[&str], &[&str]); 18] = [
        (&["design", "nonesuch"], &["nonesuch", "rate-observer"]),
        (&["design", "missing.toml"], &["missing.toml", "cannot read"]),
        (&["design", "pole.toml"], &["pole.toml", "latitude_deg", "pole"]),
        (&["design", "flat.toml"], &["not observable", "rotor_N_m_s"]),
        (&["design", "typo.toml"], &["typo.toml", "latitude"]),
        (&["design", "short.toml"], &["short.toml", "latitude_deg"]),
        (&["design", "good.toml", "--omega", "0"], &["omega = 0", "omega > 0"]),
        (&["design", "good.toml", "--omega", "-3"], &["omega = -3"]),
        (&["design", "good.toml", "--poles", "-1,-2"], &["2 poles", "4"]),
        (&["design", "good.toml", "--poles", "-1,-2,3,-4"], &["pole 3", "negative real part"]),
        (&["design", "good.toml", "--step", "0"], &["step 0 s"]),
        (&["design", "good.toml", "--step", "-1"], &["step -1 s"]),
        (&["design", "good.toml", "--row", "2"], &["--row", "static"]),
        (&["design", "astatic-identifier", "--row", "1"], &["row 1", "offset", "2, 3"]),
        (&["design", "astatic-identifier", "--row", "9"], &["row 9", "1 to 6"]),
        (&["design", "astatic-identifier", "--integral-gain", "1e9"], &["integral gain", "unstable", "0 < gain <"]),
        (&["simulate", "good.toml", "--kind", "integral", "--seconds", "-1"], &["--seconds -1"]),
        (&["bode", "good.toml", "--omega", "10,0"], &["omega = 0"]),
    ];
    for (words, expected) in cases {
        let words = [&["observer"], words, &["--json", "new.json"]].concat();
        let RunOutput { status, out, err } = stand(folder.path(), &words);
        assert_eq!((status, out.as_str()), (Some(2), ""), "{words:?}: {err}");
        assert!(err.starts_with("stand: ") && err.trim_end().lines().count() == 1, "{words:?}: {err:?}");
        for word in expected {
            assert!(err.contains(word), "{words:?} should say {word:?}: {err}");
        }
    }
    assert!(before == files(folder.path()), "a refused command writes nothing");
    stand(folder.path(), &["observer", "design", "good.toml", "--poles", "-100,-120,-80+60i"]).succeeded();
}

/// A sample period at which a channel is unstable, though it is stable in continuous time.
#[test]
fn gains_unstable_at_the_step_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["observer", "design", "astatic-identifier-recovered", "--integral-gain", "8e6", "--step"];
    stand(folder.path(), &[&words[..], &["1e-4"]].concat()).succeeded();
    let RunOutput { status, err, .. } = stand(folder.path(), &[&words[..], &["1e-3"]].concat());
    assert!(status == Some(2) && err.contains("with a step of 0.001 s") && err.contains("unit circle"), "{err}");
}

/// With r₂ of the wrong sign the loop has a pole at +85 1/s (docs/theory.md §1.5 with the other sign): no steady state is printed.
#[test]
fn unstable_closed_loop_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["observer", "simulate", "astatic-identifier-recovered", "--regulator-rate", "-0.065", "--json", "new.json"];
    let RunOutput { status, out, err } = stand(folder.path(), &words);
    assert!(status == Some(2) && out.is_empty() && err.trim_end().lines().count() == 1, "{err}");
    assert!(err.contains("unstable") && err.contains("+85") && !folder.path().join("new.json").exists(), "{err}");
}

/// The slow pole of the integral channel leaves a rate error after 3 s; for t → ∞ it is 0.
#[test]
fn end_of_the_simulation_is_not_called_steady() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["observer", "simulate", "astatic-identifier-recovered", "--kind", "integral", "--seconds", "3"];
    let answer = stand(folder.path(), &[&words[..], &["--json", "-"]].concat()).succeeded().json();
    let rate = |which: &str, key: &str| numbers(&answer[which][key])[1];
    let (at_end, steady) = (rate("astatic", "at_end").abs(), rate("astatic", "rest").abs());
    assert!(at_end > 1e-7 && steady < 1e-12 && answer["astatic"]["at_end_s"].as_f64().unwrap() > 2.99, "{at_end} {steady}");
    let text = stand(folder.path(), &words).succeeded().out;
    assert!(text.contains("rate error at the end, 3 s, rad/s") && text.contains("steady (t → ∞) rate error, rad/s"), "{text}");
}

/// A log by the command: the rigid body of case V1, whose mean is −6.923191e-3 rad (docs/theory.md §2.3).
#[test]
fn simulated_vibration_is_compensated_within_the_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let sim = ["sim", "--gyro", "rate-observer", "--vibration", "1e-3,2", "--seconds", "30", "--out", "v.csv"];
    let said = stand(path, &sim).succeeded().out;
    assert!(said.contains("30 s at 1000 Hz") && said.contains("linear theory") && said.contains("0.006924"), "{said}");
    let answer = stand(path, &["vibration", "compensate", "v.csv", "--json", "-"]).succeeded().json();
    let number = |quantity: &str, key: &str| answer[quantity][key].as_f64().unwrap_or_else(|| panic!("{answer:#}"));
    let (part, expanded) = (number("vibration_part_rad", "value"), number("vibration_part_rad", "U"));
    // The converter has 12 bits, 16 µrad, and noise of one code.
    assert!((part + 6.923_191e-3).abs() <= expanded && expanded < 1e-3, "{part} ± {expanded}");
    // 30 s show where the precession of ten minutes stands, and the answer says so.
    assert!(answer["warnings"][0].as_str().unwrap().contains("shorter than a precession"), "{answer:#}");
    for (more, expected) in [
        (&["--vibration", "1e-3"][..], "two to four numbers"),
        (&["--vibration", "1,2"], "amplitude in g 1 is out of range"),
        (&["--vibration", "1e-3,400"], "frequency in Hz 400 is out of range"),
        (&["--vibration", "1e-3,2", "--gyro", "astatic-identifier"], "needs an element with four states"),
        (&["--vibration", "0.1,2", "--gyro"], "leaves the range of the angle sensor"),
        (&["--gyro"], "give --serve, or --vibration"),
    ] {
        let gyro: &[&str] = if more.contains(&"--gyro") { &[] } else { &["--gyro"] };
        let ran = stand(path, &[&["sim", "--out", "w.csv", "--seconds", "1"], more, gyro].concat());
        assert!(ran.status == Some(2) && ran.err.contains(expected), "{more:?}: {ran:?}");
        assert!(!path.join("w.csv").exists(), "{more:?}");
    }
}

/// The four-state element on a vibrating base, as a log; docs/theory.md §2.3, case V1.
/// A log of the free element under a constant moment: states and moment are learnt from the angle sensor alone.
#[test]
fn recorded_log_gives_states_and_learnt_moment_beside_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let simulate = |more: &[&str]| {
        let words = ["observer", "simulate", "astatic-identifier-recovered", "--angle", "1e-3", "--moment", "1e-5", "--seconds", "20"];
        stand(path, &[&words[..], &["--out", "log.csv", "--force"], more].concat())
    };
    let track = |more: &[&str]| {
        stand(path, &[&["observer", "track", "log.csv", "--omega", "20", "--json", "-"][..], more].concat()).succeeded().json()
    };
    let mut covered = 0;
    for seed in ["1", "2", "3", "4", "5", "6", "7", "8", "9", "10"] {
        simulate(&["--seed", seed]).succeeded();
        let found = track(&[]);
        let (moment, learnt) = (&found["moment_N_m"], &found["moment"]);
        let number = |key: &str| moment[key].as_f64().unwrap_or_else(|| panic!("{key}: {found}"));
        assert!((learnt["true_mean"].as_f64().unwrap() - 1e-5).abs() < 1e-15, "{found}");
        // The moment is known to a fifth.
        assert!(number("U") < 2e-6, "{found}");
        covered += u32::from((number("value") - 1e-5).abs() <= number("U"));
        let rms = |state: usize| found["states"][state]["rms_error"].as_f64().unwrap();
        assert!(rms(0) < 3e-4 && rms(1) < 0.03, "{found}");
    }
    // At least 8 of 10 at 95 %: less with probability 0.012.
    assert!(covered >= 8, "{covered}");
    // A static observer shows the moment as an error of the angle instead.
    let fixed = track(&["--kind", "static"]);
    assert!(fixed["moment"].is_null() && fixed["moment_N_m"].is_null() && fixed["states"].as_array().unwrap().len() == 6);
    let text = stand(path, &["observer", "track", "log.csv", "--omega", "20", "--out", "hat.csv"]).succeeded().out;
    assert!(text.contains("learnt moment") && text.contains("truth 1.0000 × 10⁻⁵"), "{text}");
    let hat = std::fs::read_to_string(path.join("hat.csv")).unwrap();
    assert!(hat.contains("hat_alpha_rad,alpha_rad") && hat.contains("hat_moment_N_m,moment_N_m"));
    // Refused, with the log and the reason.
    for (words, message) in [
        (&["--torquer", "0.05"][..], "log.csv: the moment of the torquer needs the column torquer_A (--torquer)"),
        (&["--angle-gain", "0"], "angle gain 0 V/rad"),
        (&["--model", "none.toml"], "none.toml"),
    ] {
        let ran = stand(path, &[&["observer", "track", "log.csv"][..], words].concat());
        assert!(ran.status == Some(2) && ran.err.contains(message) && ran.err.lines().count() == 1, "{ran:?}");
    }
    let free =
        |more: &[&str]| stand(path, &[&["observer", "simulate", "astatic-identifier-recovered", "--out", "short.csv"][..], more].concat());
    free(&["--angle", "1e-3"]).succeeded();
    let ran = stand(path, &["observer", "track", "short.csv", "--omega", "5"]);
    assert!(ran.status == Some(2) && ran.err.contains("short.csv: 3.000 s are too short: the observer settles in 2.000 s"), "{ran:?}");
    let ran = free(&["--angle", "0.05", "--force"]);
    assert!(ran.status == Some(2) && ran.err.contains("leaves the range of the angle sensor"), "{ran:?}");
}

#[test]
fn azimuth_is_corrected_for_vibration() {
    let folder = tempfile::tempdir().unwrap();
    let vibration = BaseVibration {
        overload_g: 1e-3,
        direction_rad: std::f64::consts::FRAC_PI_4,
        rate_rad_s: 4.0 * std::f64::consts::PI,
        phase_rad: 0.0,
    };
    let mut element = LinearElement::four(FourState::SET_B, vibration, -6.924e-3, 0.0);
    // The initial transient decays with the rotor's nutation: 3 s and more.
    (0..40_000).for_each(|_| element.advance(0.0, 1e-3));
    let mut text = "# angle_gain_V_rad: 20\nt_s,angle_sensor_V,gamma_rad,alpha_rate_rad_s,beta_rate_rad_s\n".to_owned();
    for k in 0..20_000 {
        let [alpha, alpha_rate, _, beta_rate, gamma, _] = *element.state();
        text += &format!("{},{},{gamma},{alpha_rate},{beta_rate}\n", f64::from(k) * 1e-3, 20.0 * alpha);
        element.advance(0.0, 1e-3);
    }
    std::fs::write(folder.path().join("log.csv"), text).unwrap();
    let answer = stand(folder.path(), &["vibration", "compensate", "log.csv", "--json", "-", "--html", "v.html"]).succeeded().json();
    let page = std::fs::read_to_string(folder.path().join("v.html")).unwrap();
    assert!(page.matches("<svg").count() == 2 && page.contains("corrected by the exact rates"), "{page}");
    // Period by period: the initial transient makes successive periods differ by about 200″; the means agree with the answer.
    let design = Request {
        plant: Plant::named("rate-observer").unwrap(),
        poles: Poles::Binomial(100.0),
        kind: Kind::Static,
        step_s: Some(1e-3),
        vibration_Hz: None,
    };
    let log =
        identification::log::Log::read_also(folder.path().join("log.csv"), &["gamma_rad", "alpha_rate_rad_s", "beta_rate_rad_s"]).unwrap();
    let column = |name: &str| log.columns().iter().find(|c| c.name == name).unwrap().values.as_slice();
    let alpha: Vec<f64> = column("angle_sensor_V").iter().map(|volts| volts / 20.0).collect();
    let exact = Some((column("alpha_rate_rad_s"), column("beta_rate_rad_s")));
    let measured = Measured { step_s: 1e-3, alpha_rad: &alpha, gamma_rad: column("gamma_rad"), exact };
    let found = compensate(&measured, &FourState::SET_B, &design.design().unwrap(), None, &VibrationUncertainties::default()).unwrap();
    let count = found.by_period.len() as f64;
    assert!(count >= 39.0, "{count}");
    let mean = |of: &dyn Fn(&Period) -> f64| found.by_period.iter().map(of).sum::<f64>() / count;
    let corrected = |correction: &Correction| found.alpha_rad - correction.with_inertia_rad;
    for (course, whole) in [
        (mean(&|p| p.alpha_rad), found.alpha_rad),
        (mean(&|p| p.estimated_rad), corrected(&found.response_corrected)),
        (mean(&|p| p.exact_rad.unwrap()), corrected(found.exact.as_ref().unwrap())),
    ] {
        assert!((course - whole).abs() < 0.01 * found.alpha_rad.abs(), "{course} {whole}");
    }
    assert!(found.by_period.iter().all(|p| p.estimated_rad.abs() < 0.3 * p.alpha_rad.abs()));
    let of = |which: &str, what: &str| answer[which][what].as_f64().unwrap();
    assert!((answer["vibration_Hz"].as_f64().unwrap() - 2.0).abs() < 1e-4);
    // The precession of 0.01 rad/s moves the mean within the record: 1 %.
    assert!((of("exact", "removed_by_rate_percent") - 100.0).abs() < 1.0, "{answer}");
    assert!((of("estimated", "removed_by_rate_percent") - 98.0).abs() < 1.0, "{answer}");

    // A true azimuth of 10 mrad does not change the part that vibration causes.
    let text = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    let turned: String = text
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            [t, volts, gamma, alpha_rate, beta_rate] if volts.parse::<f64>().is_ok() => {
                format!("{t},{},{gamma},{alpha_rate},{beta_rate}\n", volts.parse::<f64>().unwrap() + 20.0 * 0.01)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    std::fs::write(folder.path().join("turned.csv"), turned).unwrap();
    let other = stand(folder.path(), &["vibration", "compensate", "turned.csv", "--json", "-"]).succeeded().json();
    let number =
        |answer: &serde_json::Value, quantity: &str, key: &str| answer[quantity][key].as_f64().unwrap_or_else(|| panic!("{answer:#}"));
    let (part, expanded) = (number(&other, "vibration_part_rad", "value"), number(&other, "vibration_part_rad", "U"));
    assert!((part - number(&answer, "vibration_part_rad", "value")).abs() < 0.01 * part.abs(), "{other:#}");
    assert!((part - -6.923_97e-3).abs() <= expanded && expanded < 0.05 * part.abs(), "{part} ± {expanded}");
    let (azimuth, expanded) = (number(&other, "azimuth_rad", "value"), number(&other, "azimuth_rad", "U"));
    assert!((azimuth - number(&answer, "azimuth_rad", "value") - 0.01).abs() < 1e-4 && expanded < 5e-4, "{azimuth} ± {expanded}");
    // Errors of the roll channel are lines of the budget: a gain proportionally, a delay by 1 − cos ωδ, because γ is in phase with the
    // rate.
    let with = |option: &str, value: &str| {
        stand(folder.path(), &["vibration", "compensate", "turned.csv", option, value, "--json", "-"]).succeeded().json()
    };
    let line = |answer: &serde_json::Value, of: &str| {
        let budget = answer["azimuth_rad"]["budget"].as_array().unwrap();
        budget.iter().find(|line| line["of"] == of).and_then(|line| line["u"].as_f64()).unwrap_or_else(|| panic!("{of}: {answer:#}"))
    };
    let wide = with("--gamma-gain-error", "5");
    assert!((line(&wide, "γ: gain") / (0.05 * part.abs()) - 1.0).abs() < 1e-6, "{wide:#}");
    assert!(number(&wide, "azimuth_rad", "U") > 1.5 * expanded, "{wide:#}");
    let delayed = line(&with("--gamma-delay-error", "20"), "γ: delay") / part.abs();
    let second_order = 1.0 - (std::f64::consts::TAU * 2.0 * 0.02).cos();
    assert!(delayed >= second_order && delayed < 1.5 * second_order, "{delayed} {second_order}");

    for (words, expected) in [
        (&["log.csv", "--omega", "0"][..], "omega = 0"),
        (&["log.csv", "--model", "astatic-identifier"], "four states"),
        (&["log.csv", "--vibration-hz", "600"], "600 Hz"),
        (&["log.csv", "--angle-gain", "0"], "angle gain 0"),
        (&["missing.csv"], "missing.csv"),
    ] {
        let RunOutput { status, err, .. } = stand(folder.path(), &[&["vibration", "compensate"], words].concat());
        assert!(status == Some(2) && err.contains(expected) && err.trim_end().lines().count() == 1, "{words:?}: {err}");
    }
}
