use super::*;
use crate::identify::fit::{ChannelFit, InitialStates, Unidentifiable, build};

const MODEL: &str = "[drive]\ninput = \"u_V\"\neffects = [\"coulomb\"]\n[parameters]\ninertia_kg_m2 = 2.2e-4\nmotor_constant_N_m_A = 0.0234\nresistance_ohm = 2.32\ncoulomb_N_m = 8.6e-4\n";

/// A fit that multiplies inertia, motor constant, resistance and friction by these factors.
fn fitted(model: &Model, factors: [f64; 4]) -> FitResult {
    let (_, mut parameters) = build::system(model, false);
    for (p, factor) in parameters.list.iter_mut().zip(factors) {
        p.value *= factor;
    }
    let channel = |channel| ChannelFit {
        channel,
        is_increment: channel == Channel::Angle,
        rms: 1.0,
        heldout_rms: None,
        noise: 1.0,
        fit_percent: 99.0,
        white_p: 1.0,
        rows: 100,
        residual: Vec::new(),
    };
    FitResult {
        sigmas: vec![0.0; parameters.list.len()],
        covariance: nalgebra::DMatrix::zeros(parameters.list.len(), parameters.list.len()),
        parameters,
        initial_states: InitialStates { kinds: vec![], values: vec![], prior: vec![], prior_sigma: vec![] },
        channels: vec![channel(Channel::Rate), channel(Channel::Current)],
        unidentifiable: Vec::new(),
        at_bound: Vec::new(),
        converged: true,
        steps: 1,
        chi2: 1.0,
        rests_on_course: false,
    }
}

fn columns(model: &Model, factors: [f64; 4]) -> Vec<&'static str> {
    by_shifts(model, &fitted(model, factors)).map_or(Vec::new(), |defect| defect.columns())
}

#[test]
fn columns_in_thousandths_are_named_by_their_pattern() {
    let model = Model::parse(MODEL, "m.toml").unwrap();
    // Inertia, motor constant, resistance, friction.
    assert_eq!(columns(&model, [1e3, 1.0, 1e-3, 1e3]), ["i_A"]);
    assert_eq!(columns(&model, [700.0, 1.1, 1.4e-3, 1e3]), ["i_A"], "a start value is known to a factor of three");
    assert_eq!(columns(&model, [1e3, 1e3, 1e3, 1e3]), ["u_V"]);
    assert_eq!(columns(&model, [1e6, 1e3, 1.0, 1e6]), ["u_V", "i_A"]);
    assert!(columns(&model, [1e3, 1.0, 1.0, 1.0]).is_empty(), "an inertia alone has no such pattern");
    assert!(columns(&model, [2.0, 0.5, 3.0, 1e4]).is_empty(), "friction is not judged");
    assert!(columns(&model, [30.0, 1.0, 0.03, 30.0]).is_empty(), "a factor of thirty is no prefix");
}

#[test]
fn motor_constant_over_inertia_names_the_current_as_input() {
    let text = MODEL.replace("u_V", "i_A").replace("resistance_ohm = 2.32\n", "");
    let model = Model::parse(&text, "m.toml").unwrap();
    assert_eq!(columns(&model, [30.0, 0.03, 1.0, 1.0]), ["i_A"], "only the ratio of the two is determined");
    assert!(columns(&model, [10.0, 10.0, 1.0, 1.0]).is_empty());
}

#[test]
fn measured_multiple_of_the_modelled_channel_is_found() {
    let modelled: Vec<f64> = (0..100).map(|k| (0.1 * k as f64).sin()).collect();
    let measured: Vec<f64> = modelled.iter().enumerate().map(|(k, m)| 1e3 * m + if k % 2 == 0 { 100.0 } else { -100.0 }).collect();
    let mut residual: Vec<f64> = measured.iter().zip(&modelled).map(|(a, b)| a - b).collect();
    residual[7] = f64::NAN;
    assert!(multiple(&measured, &residual).is_some_and(|m| (m - 1e3).abs() < 50.0));
    let unrelated: Vec<f64> = (0..100).map(|k| 1e3 * (0.37 * k as f64).cos()).collect();
    let residual: Vec<f64> = unrelated.iter().zip(&modelled).map(|(a, b)| a - b).collect();
    assert_eq!(multiple(&unrelated, &residual), None);
}

#[test]
fn constants_shifted_by_a_decade_are_questioned() {
    let model = Model::parse(MODEL, "m.toml").unwrap();
    let names = |result: &FitResult| shifted(&model, result).into_iter().map(|s| s.parameter).collect::<Vec<_>>();
    assert_eq!(names(&fitted(&model, [0.09, 1.0, 12.0, 1e3])), ["inertia_kg_m2", "resistance_ohm"]);
    assert!(names(&fitted(&model, [8.0, 0.2, 3.0, 1e-3])).is_empty());
    let mut undetermined = fitted(&model, [20.0, 1.0, 1.0, 1.0]);
    undetermined.unidentifiable = vec![Unidentifiable { parameter: "inertia_kg_m2".to_owned(), partner: None }];
    assert!(names(&undetermined).is_empty());
}

#[test]
fn unknown_start_values_are_exempt() {
    let text = MODEL.replace("= 2.32", "= { value = 2.32, fixed = true }");
    let model = Model::parse(&text, "m.toml").unwrap();
    assert!(shifted(&model, &fitted(&model, [1.0, 1.0, 20.0, 1.0])).is_empty());
    // The inertia of the catalogue, and nothing else to judge: another drive.
    let text = "[drive]\ninput = \"torque_N_m\"\n[parameters]\ninertia_kg_m2 = 2.5e-4\n";
    let model = Model::parse(text, "m.toml").unwrap();
    assert!(columns(&model, [1e3, 1.0, 1.0, 1.0]).is_empty());
    let model = Model::parse(&text.replace("2.5e-4", "2.2e-4"), "m.toml").unwrap();
    assert_eq!(columns(&model, [1e3, 1.0, 1.0, 1.0]), ["torque_N_m"]);
}
