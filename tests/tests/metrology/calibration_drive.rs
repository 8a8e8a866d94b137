//! The stand's own drive: inertia by an added inertia, by coasting and by output error; bandwidth from a chirp; cogging by harmonic order.

use identification::log::Log;
use identification::statistics::{LeastSquares, least_squares};
use stand_analysis::calibrate::AbsenceReason;
use stand_tests::calibration::{assert_covers, calibrated, found, recorded};
use std::f64::consts::TAU;

const STEPS: &str = "
[[steps]]
name = 'steps'
mode = 'voltage'
profile = 'multi-step'
amplitude = 0.8
dwell_s = 0.5
seconds = 15.0
";

fn session(more: &str) -> String {
    format!("what = 'drive'\n{STEPS}{more}")
}

/// A stand with this current-scale error, the default effects and these further effects.
fn stand(current_scale: f64, more: &str) -> String {
    format!(
        "[effects.coulomb]\ncoulomb_N_m = 9e-4\n[effects.viscous]\nviscous_N_m_s = 2e-5\n[effects.inductance]\ninductance_H = 2.38e-4\n[effects.current-scale]\ncurrent_scale = {current_scale}\n{more}"
    )
}

#[test]
fn added_inertia_gives_the_inertia_independently_of_the_current_scale() {
    let session = session(&STEPS.replace("steps'", "loaded'").replace("seconds = 15.0", "seconds = 15.0\nadded_inertia_kg_m2 = 1.5e-4"));
    for (scale, seed) in [(0.01, 1), (-0.01, 2)] {
        let record = calibrated(&stand(scale, ""), &session, seed);
        assert_covers(&record.findings, "inertia_by_added_kg_m2", 2.5e-4, 3e-6);
        // The inertia from the motor constant contains the error of the current; its interval covers the truth.
        let fitted = found(&record.findings, "inertia_kg_m2");
        assert!(fitted.covers(2.5e-4), "{}", fitted.value);
        assert!((fitted.value / 2.5e-4 - 1.0).abs() > 0.5 * 0.01, "{}", fitted.value);
        let instruction = record.journal.steps[1].instruction.as_ref().expect("the operator added the inertia");
        assert!(instruction[0].contains("0.00015 kg m²"), "{}", instruction[0]);
    }
}

#[test]
fn added_inertia_is_removed_for_the_next_step() {
    let loaded = STEPS.replace("steps'", "loaded'").replace("seconds = 15.0", "seconds = 15.0\nadded_inertia_kg_m2 = 1.5e-4");
    let record = calibrated(&stand(0.0, ""), &format!("what = 'drive'\n{loaded}{STEPS}"), 3);
    assert_covers(&record.findings, "inertia_kg_m2", 2.5e-4, 8e-6);
    let instruction = record.journal.steps[1].instruction.as_ref().expect("the operator removed the inertia");
    assert!(instruction[0].contains("from the platform"), "{}", instruction[0]);
}

/// The rate follows with 1 s and has not settled on any level. Plateaus are cut to whole turns, so that their lengths differ.
#[test]
fn dead_band_is_found_before_the_rate_has_settled() {
    let session = "what = 'drive'\n[[steps]]\nname = 'voltages'\nmode = 'voltage'\nprofile = 'staircase'\namplitude = 0.6\nlevels = 4\ndwell_s = 2.5\nseconds = 42.0\n";
    let record = calibrated(&stand(0.0, ""), session, 4);
    // R c/K of the default stand.
    let truth = 2.32 * 9e-4 / 2.34e-2;
    assert_covers(&record.findings, "dead_band_V", truth, 1e-3);
    let noise = found(&record.findings, "dead_band_V").contributions[0].contribution();
    assert!(noise < 5e-5, "{noise} V: the plateaus are not on the two lines");
}

#[test]
fn coasting_gives_the_inertia() {
    let session = session(
        "
[[steps]]
name = 'coast'
mode = 'rate'
profile = 'constant'
amplitude = 30.0
drive_s = 3.0
seconds = 15.0
",
    );
    let findings = calibrated(&stand(0.0, ""), &session, 1).findings;
    assert_covers(&findings, "inertia_by_coasting_kg_m2", 2.5e-4, 1e-5);
}

#[test]
fn bandwidth_from_a_chirp_equals_that_of_the_linear_model() {
    let session = session(
        "
[[steps]]
name = 'sweep'
mode = 'voltage'
profile = 'chirp'
amplitude = 0.4
offset = 0.6
from_Hz = 0.05
to_Hz = 20.0
sweep_s = 40.0
seconds = 40.0
",
    );
    let (k, r, b) = (2.34e-2_f64, 2.32_f64, 2e-5_f64);
    for j in [1.8e-4, 2.5e-4, 4e-4] {
        let corner = (k * k / r + b) / j / TAU;
        let findings = calibrated(&stand(0.0, &format!("[drive]\ninertia_kg_m2 = {j}\n")), &session, 1).findings;
        assert_covers(&findings, "drive_bandwidth_Hz", corner, 0.01 * corner);
        assert_covers(&findings, "mechanical_time_constant_s", 1.0 / (TAU * corner), 0.05 / (TAU * corner));
    }
}

const SLOW: &str = "
[[steps]]
name = 'slow turns'
mode = 'rate'
profile = 'constant'
amplitude = 2.0
seconds = 20.0
";

#[test]
fn cogging_is_found_only_at_its_harmonic_order() {
    let cogging = stand(0.0, "[effects.cogging]\ncogging_N_m = 1.5e-3\ncogging_order = 7\n");
    let findings = calibrated(&cogging, &session(SLOW), 1).findings;
    assert_covers(&findings, "order_7_N_m", 1.5e-3, 1e-4);
    let others: Vec<_> = findings.quantities.iter().filter(|q| q.name.starts_with("order_") && q.name != "order_7_N_m").collect();
    assert!(others.is_empty(), "{:?}", others.iter().map(|q| (&q.name, q.value)).collect::<Vec<_>>());
}

#[test]
fn drive_without_cogging_has_no_harmonic() {
    let findings = calibrated(&stand(0.0, ""), &session(SLOW), 2).findings;
    let orders: Vec<_> = findings.quantities.iter().filter(|q| q.name.starts_with("order_")).collect();
    assert!(orders.is_empty(), "{:?}", orders.iter().map(|q| (&q.name, q.value)).collect::<Vec<_>>());
    assert!(findings.absent.iter().any(|a| a.quantity == "cogging_N_m" && matches!(a.reason, AbsenceReason::NoHarmonic { .. })));
}

/// docs/theory.md §4: R 2.3 Ω, L 0.5 mH, k 0.02 N m/A, J 1e-4 kg m², b 2e-6 N m s, Mc 1e-3 N m.
const THEORY: &str = "
[drive]
inertia_kg_m2 = 1e-4
motor_constant_N_m_A = 0.02
resistance_ohm = 2.3
[effects.coulomb]
coulomb_N_m = 1e-3
[effects.viscous]
viscous_N_m_s = 2e-6
[effects.inductance]
inductance_H = 0.5e-3
";

#[test]
fn drive_of_theory_4_has_its_time_constant() {
    let findings = calibrated(THEORY, &session("").replace("amplitude = 0.8", "amplitude = 0.7"), 1).findings;
    assert_covers(&findings, "mechanical_time_constant_s", 0.568_462_679, 5e-3);
    assert_covers(&findings, "electrical_time_constant_s", 0.5e-3 / 2.3, 1e-5);
}

/// docs/theory.md §4: J Ω′ = k i − b Ω − Mc integrated over noisy records of 20 s, the rate regressed on [∫i, −∫Ω, −t].
///
/// The current's noise is a random walk in ∫i, on this stand larger than the rate's noise: σ of b would be ten times too small. The
/// differenced law between successive rates is also valid, and its noise is white.
#[test]
fn integrated_law_identifies_the_drive_from_its_own_current() {
    let one_way = "what = 'drive'
[[steps]]
name = 'one way'
mode = 'voltage'
profile = 'chirp'
amplitude = 0.3
offset = 0.5
from_Hz = 0.05
to_Hz = 1.0
sweep_s = 20.0
seconds = 21.0
";
    let expected = [("k/J", 0.02 / 1e-4, 1e-3), ("b/J", 2e-6 / 1e-4, 0.03), ("Mc/J", 1e-3 / 1e-4, 0.01)];
    let seeds = [1, 2, 3, 4];
    let mut means = [0.0; 3];
    for seed in seeds {
        let (steps, _) = recorded(THEORY, one_way, seed);
        let fit = integrated_law(&steps[0].log);
        for (k, (name, truth, part)) in expected.iter().enumerate() {
            let (off, sigma) = (fit.coefficients[k] / truth - 1.0, fit.sigma(k) / truth);
            println!("seed {seed}: {name} {off:.2e}, σ {sigma:.2e}");
            assert!(sigma < *part && off.abs() < 3.0 * sigma, "{name}: off by {off}, and σ is {sigma}");
            means[k] += off / seeds.len() as f64;
        }
    }
    for ((name, _, part), off) in expected.iter().zip(means) {
        assert!(off.abs() < *part, "{name}: off by {off} in the mean");
    }
}

/// [k/J, b/J, Mc/J] from rates 82 ms apart, each the slope of the angle over 41 rows. The first second is the spin-up.
fn integrated_law(log: &Log) -> LeastSquares {
    let [t_s, theta, i_A] = ["t_s", "theta_rad", "i_A"].map(|name| log.column(name).expect("it was recorded"));
    let mut charge = 0.0;
    let mut points: Vec<[f64; 4]> = Vec::new();
    for k in 0..t_s.len() - 21 {
        if k >= 1000 && k % 82 == 0 {
            let square: f64 = (k - 20..=k + 20).map(|row| (t_s[row] - t_s[k]).powi(2)).sum();
            let cross: f64 = (k - 20..=k + 20).map(|row| (t_s[row] - t_s[k]) * (theta[row] - theta[k])).sum();
            points.push([charge, -theta[k], -t_s[k], cross / square]);
        }
        charge += i_A[k] * (t_s[k + 1] - t_s[k]);
    }
    assert!(points.iter().all(|[.., rate]| *rate > 1.0), "one direction");
    let steps = points.windows(2).map(|pair| std::array::from_fn::<f64, 4, _>(|k| pair[1][k] - pair[0][k]));
    let (rows, rates): (Vec<_>, Vec<_>) = steps.map(|[charge, angle, time, rate]| (vec![charge, angle, time], rate)).unzip();
    least_squares(&rows, &rates).expect("the columns are linearly independent")
}
