//! The derivatives of the rig in dual numbers equal the finite differences of the rig in `f64`.
//!
//! Every effect, each of its parameters, the base and the initial states; away from reversals, where the derivative jumps.
#![allow(clippy::unwrap_used)]

use crate::common;
use common::{ROW_S, span};
use drive_model::{Law, LawScalar};
use drive_rig::{Base, DriveState, Input, Rig, RowInput, Servo};

type Dual = drive_model::Dual<8>;

fn seeded(value: f64, lane: usize) -> Dual {
    Dual::unknown(value, lane)
}

fn slope(x: &Dual, lane: usize) -> f64 {
    x.slopes[lane]
}

/// Base and initial states, then the effects' parameters.
const STATES: usize = 7;

struct Case {
    input: Input,
    effects: Vec<&'static str>,
    /// J, K, R, ω, i, twist, bristle, heat; then the parameters.
    values: Vec<f64>,
}

/// Readings of rate, angle and current at every tenth of 60 rows.
fn run<S: LawScalar>(case: &Case, values: &[S]) -> Vec<S> {
    let servo = Servo { gain_V_rad: S::from(4.0), damping_V_s_rad: S::from(0.01), limit_V: S::from(12.0) };
    let servo = (case.input == Input::Setpoint).then_some(servo);
    let base = Base { inertia: values[0], motor_constant: values[1], resistance: values[2], servo };
    let mut rest = &values[STATES + 1..];
    let mut list: Vec<(Box<dyn Law<S>>, Vec<S>)> = Vec::new();
    for id in &case.effects {
        let n = drive_model::card(id).unwrap().parameters.len();
        list.push((drive_model::law::<S>(id).unwrap(), rest[..n].to_vec()));
        rest = &rest[n..];
    }
    let rig = Rig::new(base, case.input, list);
    let mut state = DriveState::turning(values[3], S::from(0.2));
    state.current = values[4];
    state.twist = values[5];
    state.bristle = values[6];
    state.heat_K = values[7];
    let mut seen = Vec::new();
    for n in 0..60 {
        let t = f64::from(n) * ROW_S;
        let input = match case.input {
            Input::Voltage => 1.5 + 0.4 * (40.0 * t).sin(),
            Input::Current => 0.4 + 0.1 * (40.0 * t).sin(),
            Input::Torque => 8e-3 + 2e-3 * (40.0 * t).sin(),
            Input::Setpoint => 0.5 + 9.0 * t,
        };
        let span = RowInput { supply_ratio: 0.97, rate_from_encoder: true, ..span(t, ROW_S, input, None) };
        let before = (state.omega, state.theta, state.heat_K);
        let mean = rig.advance(&mut state, &span);
        if n % 10 == 9 {
            let y = rig.read(before, &span, mean);
            seen.extend([y.omega, y.theta, y.current]);
        }
    }
    seen
}

/// Asserts each derivative; returns for each lane whether it changed an output.
fn check(case: &Case, name: &str) -> Vec<bool> {
    let n = case.values.len();
    let mut moved = vec![false; n];
    let plain = run::<f64>(case, &case.values);
    for block in (0..n).step_by(8) {
        let lanes: Vec<Dual> = (0..n)
            .map(|k| if (block..block + 8).contains(&k) { seeded(case.values[k], k - block) } else { Dual::from(case.values[k]) })
            .collect();
        let dual = run::<Dual>(case, &lanes);
        for k in block..n.min(block + 8) {
            // A step of 1e-6 of the value: truncation 1e-12, rounding 1e-10 of the output over it.
            let h = 1e-6 * case.values[k].abs().max(1e-3);
            let at = |by: f64| {
                let mut values = case.values.clone();
                values[k] += by;
                run::<f64>(case, &values)
            };
            let (plus, minus) = (at(h), at(-h));
            // Each channel has its own unit: relative to its greatest derivative in the record.
            for channel in 0..3 {
                let rows: Vec<usize> = (channel..dual.len()).step_by(3).collect();
                let greatest = rows.iter().map(|&m| slope(&dual[m], k - block).abs()).fold(0.0, f64::max);
                let level = rows.iter().map(|&m| plain[m].abs()).fold(1e-3, f64::max);
                moved[k] |= greatest > 0.0;
                for &m in &rows {
                    // To rounding: a quotient of duals is a product with the reciprocal.
                    common::close(dual[m].re, plain[m], 1e-13 * level, name);
                    let difference = (plus[m] - minus[m]) / (2.0 * h);
                    let off = (slope(&dual[m], k - block) - difference).abs();
                    // Rounding of a difference of outputs that are sums over 60 rows: 1e-13 of the output over the step.
                    let allowed = 1e-4 * greatest + 1e-13 * level / h;
                    assert!(off <= allowed, "{name} value {k} channel {channel}: {} {difference}", slope(&dual[m], k - block));
                }
            }
        }
    }
    moved
}

/// Drive and states of all cases: turning, and nothing at a kink.
const BEGIN: [f64; STATES + 1] = [2.5e-4, 0.0234, 2.32, 9.0, 0.3, 1.3e-3, 2e-4, 8.0];

/// Values within the range, none of them at a kink or at zero.
fn usual(id: &str) -> Vec<f64> {
    match id {
        "asymmetric-friction" => vec![3e-4, 2e-5],
        "load" => vec![-4e-4],
        "cable-spring" => vec![2e-5, 0.7],
        "load-step" => vec![6e-4, 0.02345],
        "compliance" => vec![0.6, 4e-4, 0.3],
        "backlash" => vec![2e-3, 6.0, 0.02, 0.3],
        "rate-scale" | "current-scale" => vec![0.03],
        "rate-bias" | "rate-bias-temperature" | "current-offset" => vec![0.02],
        "friction-drift" => vec![0.3, -0.2, 0.05],
        "bridge-nonlinearity" => vec![0.03, -0.01],
        "rate-scale-nonlinearity" => vec![1e-4, 5e-5],
        _ => {
            let card = drive_model::card(id).unwrap();
            card.parameters.iter().map(|p| if p.kind == drive_model::ParameterKind::Phase { 0.6 } else { p.start }).collect()
        }
    }
}

/// The effect with the effects that it requires.
fn case(id: &'static str, input: Input) -> Case {
    let mut list = vec!["viscous", "coulomb"];
    list.retain(|e| *e != id);
    list.push(id);
    let mut values = BEGIN.to_vec();
    for e in &list {
        values.extend(usual(e));
    }
    Case { input, effects: list, values }
}

#[test]
fn every_parameter_of_every_effect_has_the_derivative_of_its_finite_difference() {
    for card in drive_model::cards() {
        for input in [Input::Voltage, Input::Current, Input::Torque, Input::Setpoint] {
            let case = case(card.id, input);
            let moved = check(&case, &format!("{} {input:?}", card.id));
            if input == Input::Voltage && !matches!(card.id, "sensor-lag" | "time-skew") {
                // Lag and skew are filters of the finished series; else every parameter moves an output.
                let first = case.values.len() - card.parameters.len();
                // A fit sees no slope by the time of a jump: it lies between two rows.
                let has_slope = |name: &str| name != "lost_at_s";
                for (k, p) in card.parameters.iter().enumerate().filter(|(_, p)| has_slope(p.name)) {
                    assert!(moved[first + k], "{} {} changes nothing", card.id, p.name);
                }
                assert!(moved[..4].iter().all(|m| *m), "{}: J, K, R and the first rate", card.id);
            }
        }
    }
}

#[test]
fn initial_states_have_correct_derivatives() {
    for (id, lane) in [("inductance", 4), ("compliance", 5), ("backlash", 5), ("presliding", 6), ("resistance-temperature", 7)] {
        let moved = check(&case(id, Input::Voltage), id);
        assert!(moved[lane], "{id}: the state changes the readings");
    }
}

#[test]
fn combined_effects_have_correct_derivatives() {
    let together = [
        vec!["viscous", "coulomb", "stribeck", "inductance", "brush-drop", "cogging", "magnetic-saturation"],
        vec!["viscous", "coulomb", "presliding", "inductance", "torque-ripple", "supply-droop"],
        vec!["viscous", "coulomb", "viscous-temperature", "resistance-temperature", "inductance", "compliance"],
    ];
    for list in together {
        let mut values = BEGIN.to_vec();
        for e in &list {
            values.extend(usual(e));
        }
        check(&Case { input: Input::Voltage, effects: list.clone(), values }, &format!("{list:?}"));
    }
}

#[test]
fn the_derivative_by_the_load_time_is_exact_within_a_row() {
    // ω = l (t − t0)/J: −l/J, exactly, whether t0 is at the edge of a row or within.
    for t0 in [0.02, 0.0203, 0.02999] {
        let laws: Vec<(Box<dyn Law<Dual>>, Vec<Dual>)> =
            vec![(drive_model::law::<Dual>("load-step").unwrap(), vec![Dual::from(6e-4), seeded(t0, 0)])];
        let base = Base { inertia: Dual::from(1e-4), motor_constant: Dual::from(0.02), resistance: Dual::from(2.0), servo: None };
        let rig = Rig::new(base, Input::Torque, laws);
        let mut state = DriveState::turning(Dual::from(1.0), Dual::from(0.0));
        for n in 0..50 {
            rig.advance(&mut state, &span(f64::from(n) * ROW_S, ROW_S, 0.0, None));
        }
        common::close_rel(state.omega.re, 1.0 + 6.0 * (0.05 - t0), 1e-12, "rate");
        if t0 != 0.02 {
            common::close_rel(slope(&state.omega, 0), -6.0, 1e-9, "derivative");
        }
    }
}

#[test]
fn the_derivatives_of_a_slide_are_exact_through_rest() {
    // ω0 > 0, stopped within the step and turned round: end = (τ + c)/J (h − ω0 J/(c − τ)), its slope by ω0 is −(τ + c)/(c − τ).
    let (torque, dry, j) = (-3e-3, 1e-3, 1e-4);
    let (end, _) = drive_rig::slide(seeded(0.01, 0), Dual::from(torque), seeded(dry, 1), seeded(j, 2), 1e-3);
    common::close_rel(end.re, (torque + dry) / j * (1e-3 - 0.01 * j / (dry - torque)), 1e-12, "end");
    common::close_rel(slope(&end, 0), -(torque + dry) / (dry - torque), 1e-12, "by the rate");
}
