//! Noise-free motion of two sines: the fit returns the parameters of the simulation.
#![allow(clippy::unwrap_used)]

use super::*;
use crate::log::Column;

const DT_S: f64 = 1e-3;

/// A log of ten seconds with the instantaneous torque `torque(θ, ω, α)`.
fn log(torque: impl Fn(f64, f64, f64) -> f64) -> Log {
    let t_s: Vec<f64> = (0..10_000).map(|k| f64::from(k) * DT_S).collect();
    let motion = |t: f64| {
        let (a, b) = (std::f64::consts::TAU * 0.3, std::f64::consts::TAU * 1.1);
        let theta = 2.0 * (a * t).sin() + 0.5 * (b * t).cos();
        let omega = 2.0 * a * (a * t).cos() - 0.5 * b * (b * t).sin();
        let alpha = -2.0 * a * a * (a * t).sin() - 0.5 * b * b * (b * t).cos();
        (theta, omega, alpha)
    };
    let columns = [
        ("theta_rad", t_s.iter().map(|&t| motion(t).0).collect()),
        ("torque_N_m", t_s.iter().map(|&t| motion(t)).map(|(theta, omega, alpha)| torque(theta, omega, alpha)).collect()),
        ("t_s", t_s.clone()),
    ];
    let columns = columns.into_iter().map(|(name, values)| Column { name: name.to_owned(), values }).collect();
    Log::new("sines.csv", columns, vec![("torque_N_m".to_owned(), "at t".to_owned())]).unwrap()
}

fn model(effects: &str, more: &str) -> Model {
    let text = format!(
        "[drive]\ninput = \"torque_N_m\"\noutputs = [\"theta_rad\"]\neffects = [{effects}]\n[parameters]\ninertia_kg_m2 = 1.0\n{more}"
    );
    Model::parse(&text, "model.toml").unwrap()
}

#[track_caller]
fn refused(effects: &str, more: &str) -> String {
    let log = log(|_, omega, alpha| 0.5 * alpha + 0.2 * omega);
    fit(&log, &model(effects, more), Settings::usual(&log)).unwrap_err().to_string()
}

/// Tolerance 1e-3: central differences of the faster sine have an error of (ω h)²/6 = 8e-6; the low-pass smooths the steps of the Coulomb
/// torque.
#[test]
fn fit_returns_true_parameters_from_any_start() {
    let (a, phase) = (0.4, 2.0);
    let log = log(|theta, omega, alpha| {
        0.5 * alpha + 0.2 * omega + 0.3 * omega.signum() - a * (7.0 * theta + phase).sin() - 0.1 + 0.05 * theta.powi(3)
    });
    let own = "cogging_order = 7\n[effect.seal]\ntorque_N_m = \"-k * theta^3\"\nparameters = { k = 1.0 }\n";
    for start in ["", "viscous_N_m_s = 5.0\n", "cogging_N_m = 3.0\ncogging_phase_rad = 5.0\n"] {
        let model = model("\"viscous\", \"coulomb\", \"load\", \"cogging\"", &format!("{start}{own}"));
        let found = fit(&log, &model, Settings::usual(&log)).unwrap();
        let truth = [
            ("inertia_kg_m2", 0.5),
            ("viscous_N_m_s", 0.2),
            ("coulomb_N_m", 0.3),
            ("load_N_m", 0.1),
            ("cogging_N_m", a),
            ("cogging_phase_rad", phase),
            ("seal.k", 0.05),
        ];
        for (name, value) in truth {
            let k = found.parameters.list.iter().position(|p| p.name == name).unwrap();
            let (got, sigma) = (found.parameters.list[k].value, found.sigmas[k]);
            assert!((got - value).abs() < 1e-3, "{name}: {got} for {value}");
            assert!(sigma > 0.0 && sigma < 1e-3, "{name}: ± {sigma}");
        }
        assert!(found.error_percent < 0.2, "{}", found.error_percent);
    }
}

/// The model requires twice the measured torque: the residual is as large as the measured torque.
#[test]
fn comparison_gives_unexplained_fraction() {
    let log = log(|_, _, alpha| 0.5 * alpha);
    let result = compare(&log, &model("", ""), Settings::usual(&log)).unwrap();
    assert!((result.error_percent - 100.0).abs() < 0.01, "{} %", result.error_percent);
    assert!(result.sigmas.iter().all(|s| *s == 0.0));
}

#[test]
fn unsuitable_parameters_and_effects_are_refused_by_name() {
    let nonlinear = refused("\"stribeck\"", "stribeck_N_m = 1e-3\n");
    assert!(nonlinear.contains("sines.csv") && nonlinear.contains("stribeck_rate_rad_s"), "{nonlinear}");
    assert!(refused("\"load\", \"asymmetric-friction\"", "").contains("load_N_m and asymmetry_N_m"));
    for effect in ["compliance", "presliding", "encoder-eccentricity", "time-skew"] {
        let message = refused(&format!("\"{effect}\""), "");
        assert!(message.contains(effect), "{message}");
    }
    let zero = refused("\"viscous\", \"viscous-temperature\"", "");
    assert!(zero.contains("viscous_temperature_per_K"), "{zero}");
}

#[test]
fn fixed_nonlinear_parameter_is_accepted() {
    let log = log(|_, omega, alpha| 0.5 * alpha + (0.3 + 0.2 * (-(omega / 0.7f64).powi(2)).exp()) * omega.signum());
    let model = model("\"coulomb\", \"stribeck\"", "stribeck_rate_rad_s = { value = 0.7, fixed = true }\n");
    let found = fit(&log, &model, Settings::usual(&log)).unwrap();
    let value = |name: &str| found.parameters.list.iter().find(|p| p.name == name).unwrap().value;
    // The two friction torques differ only near a reversal, where the low-pass smooths.
    assert!((value("coulomb_N_m") - 0.3).abs() < 2e-3 && (value("stribeck_N_m") - 0.2).abs() < 5e-3, "{:?}", found.parameters);
}

#[test]
fn cutoff_above_limit_is_refused_with_limit() {
    let log = log(|_, _, alpha| alpha);
    let message = Settings::with_cutoff(&log, 300.0).unwrap_err().to_string();
    assert!(message.contains("300") && message.contains("200"), "{message}");
    assert!(Settings::with_cutoff(&log, f64::NAN).is_err() && Settings::with_cutoff(&log, 0.0).is_err());
}
