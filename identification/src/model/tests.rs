use drive_model::{Contributions, Law, Point, Reading};
use proptest::prelude::*;

use super::*;

const EXAMPLE: &str = r#"# my stand
[drive]
input   = "u_V"                              # terminal voltage
outputs = ["omega_rad_s", "i_A", "theta_rad"]
effects = ["viscous", "coulomb"] # so far

[parameters]
# from the data sheet
inertia_kg_m2 = 2.5e-4
motor_constant_N_m_A = { value = 0.05, fixed = true }
resistance_ohm = 5.0
viscous_N_m_s = 6e-5 # a guess
coulomb_N_m = 1e-3

[effect.seal-drag]                           # an effect of the user's own
torque_N_m = "-a * tanh(omega / w0) * (1 + m * sin(theta))"
parameters = { a = 1e-3, w0 = 0.5, m = 0.1 }
"#;

const BARE: &str =
    "[drive]\ninput = \"u_V\"\neffects = []\n[parameters]\ninertia_kg_m2 = 1e-4\nmotor_constant_N_m_A = 0.05\nresistance_ohm = 5\n";

fn example() -> Model {
    Model::parse(EXAMPLE, "drive.toml").unwrap()
}

fn message(text: &str) -> String {
    let message = Model::parse(text, "m.toml").unwrap_err().to_string();
    assert!(message.starts_with("m.toml: ") && !message.contains('\n'), "{message}");
    message["m.toml: ".len()..].to_owned()
}

fn with(effects: &str, more: &str) -> String {
    BARE.replace("effects = []", &format!("effects = [{effects}]")) + more
}

#[test]
fn example_model_is_parsed() {
    let model = example();
    assert_eq!(model.input(), Input::Voltage);
    assert_eq!(model.outputs().unwrap(), [Channel::Rate, Channel::Current, Channel::Angle]);
    assert_eq!(model.effect_names(), ["viscous", "coulomb", "seal-drag"]);
    let names: Vec<_> = model.parameters().iter().map(|p| p.name.as_str()).collect();
    let base = ["inertia_kg_m2", "motor_constant_N_m_A", "resistance_ohm", "viscous_N_m_s", "coulomb_N_m"];
    assert_eq!(names, [&base[..], &["seal-drag.a", "seal-drag.w0", "seal-drag.m"]].concat());
    assert!(model.parameter("motor_constant_N_m_A").unwrap().fixed && !model.parameter("resistance_ohm").unwrap().fixed);
    assert_eq!(model.value("seal-drag.w0"), Some(0.5));
    assert!(model.remarks().is_empty());
    assert_eq!(model.to_toml(), EXAMPLE);
    assert_eq!(model.effects()[1].parameters, [4]);
    assert_eq!(model.user_effects()[0].parameters, [5, 6, 7]);
}

#[test]
fn second_instance_has_suffixed_parameters() {
    let more = "cogging_order = 7\n\"cogging_order#2\" = 14\n\"cogging_N_m#2\" = 2e-3\n";
    let in_list = Model::parse(&with("\"cogging\", \"cogging#2\"", more), "m").unwrap();
    assert_eq!(in_list.value("cogging_order#2"), Some(14.0));
    assert_eq!(in_list.effects()[1].name(), "cogging#2");
    let more = "cogging_order = 7\n[effect.\"cogging#2\"]\ncogging_order = 14\n\"cogging_N_m#2\" = 2e-3\n";
    let mut in_table = Model::parse(&with("\"cogging\", \"cogging#2\"", more), "m").unwrap();
    for name in ["cogging_order#2", "cogging_N_m#2", "cogging_order"] {
        assert_eq!(in_table.value(name), in_list.value(name));
    }
    assert!(
        in_table.remarks().iter().any(|r| r.contains("cogging_phase_rad#2 is missing in the model file; its start value is")),
        "{:?}",
        in_table.remarks()
    );
    assert!(in_table.user_effects().is_empty());
    in_table.set("cogging_order#2", 21.0).unwrap();
    assert!(in_table.to_toml().contains("[effect.\"cogging#2\"]\ncogging_order = 21.0"), "{}", in_table.to_toml());
}

#[test]
fn invalid_model_gives_one_line_with_position_and_key() {
    let own = |body: &str| format!("{BARE}[effect.rub]\n{body}\n");
    for (text, wants) in [
        (String::new(), "[drive] is missing; a model file begins with: [drive] input = \"u_V\""),
        ("[drive]\n".to_owned(), "line 1, column 1: [drive]: input is missing"),
        ("[drive\n".to_owned(), "line 1, column 7: not TOML"),
        (BARE.replace("u_V", "u_v"), "line 2, column 9: [drive] input: unknown input 'u_v'; did you mean 'u_V'?"),
        (BARE.replace("\"u_V\"", "3"), "line 2, column 9: [drive] input: expected a column name in quotes"),
        (BARE.replace("effects = []", "efects = []"), "line 3, column 1: [drive] efects: unknown key 'efects'; did you mean 'effects'?"),
        (BARE.replace("[parameters]", "[parameter]"), "line 4, column 2: parameter: unknown table 'parameter'; did you mean 'parameters'?"),
        (with("\"vicous\"", ""), "line 3, column 12: [drive] effects: unknown effect 'vicous'; did you mean 'viscous'?"),
        (
            with("\"viscous\", \"viscous\"", ""),
            "line 3, column 23: [drive] effects: effect 'viscous' is listed twice; write 'viscous#2' for a second instance",
        ),
        (
            with("\"cogging#1\"", ""),
            "line 3, column 12: [drive] effects: 'cogging#1' is not the name of an effect; write 'cogging#2' for a second instance",
        ),
        (with("\"inductance\", \"inductance#2\"", ""), "line 3, column 26: [drive] effects: 'inductance' changes the structure"),
        (with("\"compliance\", \"backlash\"", ""), "line 3, column 26: [drive] effects: 'compliance' and 'backlash' exclude each other"),
        (
            with("", "viscous_N_m_s = 1e-5\n"),
            "line 8, column 1: [parameters] viscous_N_m_s: no effect of the model has the parameter 'viscous_N_m_s'; add \"viscous\" to [drive] effects",
        ),
        (
            with("", "\"cogging_order#2\" = 7\n"),
            "line 8, column 1: [parameters] cogging_order#2: no effect of the model has the parameter 'cogging_order#2'; add \"cogging#2\"",
        ),
        (
            with("\"viscous\"", "viscous_N_s = 1e-5\n"),
            "line 8, column 1: [parameters] viscous_N_s: unknown parameter 'viscous_N_s'; did you mean 'viscous_N_m_s'?",
        ),
        (
            with("\"viscous\"", "viscous_N_m_s = -1e-5\n"),
            "line 8, column 1: [parameters] viscous_N_m_s: -0.00001 is outside the physical range from 0 N m s",
        ),
        (
            with("\"cogging\"", "cogging_order = 0\n"),
            "line 8, column 1: [parameters] cogging_order: 0 is outside the physical range from 1 to 400 1/turn",
        ),
        (with("\"cogging\"", "cogging_order = 7.5\n"), "line 8, column 1: [parameters] cogging_order: 7.5 is not a whole number"),
        (BARE.replace("= 5\n", "= 0\n"), "line 7, column 1: [parameters] resistance_ohm: 0 is outside the physical range above 0 Ω"),
        (BARE.replace("= 5\n", "= nan\n"), "line 7, column 18: [parameters] resistance_ohm: NaN is not a finite number"),
        (BARE.replace("= 5\n", "= \"5\"\n"), "line 7, column 18: [parameters] resistance_ohm: expected a number or { value"),
        (
            BARE.replace("= 5\n", "= { value = 5, fixd = true }\n"),
            "line 7, column 31: [parameters] resistance_ohm fixd: unknown key 'fixd'; did you mean 'fixed'?",
        ),
        (BARE.replace("= 5\n", "= { value = 5, fixed = 1 }\n"), "line 7, column 18: [parameters] resistance_ohm: expected a number or"),
        (
            BARE.replace("resistance_ohm = 5\n", ""),
            "line 1, column 1: 'resistance_ohm' is missing in [parameters]; a model with input u_V needs it, e.g. resistance_ohm = 5.0",
        ),
        (
            BARE.replace("effects", "outputs = [\"omega\"]\neffects"),
            "line 3, column 12: [drive] outputs: unknown output 'omega'; valid outputs",
        ),
        (
            BARE.replace("effects", "outputs = [\"u_V\"]\neffects"),
            "line 3, column 12: [drive] outputs: 'u_V' is not an output for the input u_V; valid outputs: omega_rad_s, i_A, theta_rad",
        ),
        (BARE.replace("effects", "outputs = []\neffects"), "line 3, column 11: [drive] outputs: expected at least one output"),
        (
            own("torque_N_m = \"-a * omga\"\nparameters = { a = 1 }"),
            "line 9, column 14: [effect.rub] torque_N_m: unknown name 'omga' at column 6; did you mean 'omega'?",
        ),
        (
            own("parameters = { a = 1 }"),
            "line 8, column 9: [effect.rub]: a user effect needs exactly one of torque_N_m, dry_N_m, voltage_V, omega_rad_s, theta_rad, i_A = \"expression\"; this effect has 0",
        ),
        (
            own("torque_N_m = \"1\"\nvoltage_V = \"1\""),
            "line 8, column 9: [effect.rub]: a user effect needs exactly one of torque_N_m, dry_N_m, voltage_V, omega_rad_s, theta_rad, i_A = \"expression\"; this effect has 2",
        ),
        (own("torque = \"1\""), "line 9, column 1: [effect.rub] torque: unknown key 'torque'"),
        (
            own("torque_N_m = \"1\"\nparameters = { omega = 1 }"),
            "line 10, column 16: [effect.rub] parameters: 'omega' is not a valid parameter name",
        ),
        (
            own("torque_N_m = \"1\"\nparameters = { a = 1 }"),
            "line 10, column 16: [effect.rub]: the expression does not use the parameter 'a'",
        ),
        (
            format!("{BARE}[effect.viscous]\ntorque_N_m = \"1\"\n"),
            "line 8, column 9: [effect.viscous]: 'viscous' is an effect of the catalogue",
        ),
        (
            format!("{BARE}[effect.viscous]\nviscous_N_m_s = 1\n"),
            "line 8, column 9: [effect.viscous]: no effect of the model has the parameter 'viscous'; add \"viscous\"",
        ),
        (
            with("\"viscous\"", "viscous_N_m_s = 1\n[effect.viscous]\nviscous_N_m_s = 1\n"),
            "line 10, column 1: [effect.viscous] viscous_N_m_s: parameter 'viscous_N_m_s' is listed twice",
        ),
    ] {
        let found = message(&text);
        assert!(found.starts_with(wants), "{text}\n found {found}\n wants {wants}");
    }
    let missing = Model::read("nowhere/m.toml").unwrap_err().to_string();
    assert!(missing.starts_with("nowhere/m.toml: cannot be read"), "{missing}");
}

#[test]
fn each_input_needs_its_base_parameters() {
    let text = |input: &str, parameters: &str| format!("[drive]\ninput = \"{input}\"\n[parameters]\n{parameters}");
    assert!(Model::parse(&text("torque_N_m", "inertia_kg_m2 = 1"), "m").is_ok());
    assert!(Model::parse(&text("i_A", "inertia_kg_m2 = 1"), "m").is_err());
    assert!(Model::parse(&text("theta_rad", ""), "m").is_ok());
    let compared = text("theta_rad", "").replace("[parameters]", "outputs = [\"i_A\"]\n[parameters]");
    assert!(Model::parse(&compared, "m").unwrap_err().to_string().contains("'motor_constant_N_m_A' is missing"));
    let of_a_servo = text("torque_N_m", "inertia_kg_m2 = 1\nservo_limit_V = 5");
    assert!(Model::parse(&of_a_servo, "m").unwrap_err().to_string().contains("theta_cmd_rad"));
    for input in Input::ALL {
        let blank = Model::new(input, "new").unwrap();
        assert_eq!(blank.input(), input);
        assert!(blank.remarks().is_empty() && blank.effects().is_empty());
    }
}

#[test]
fn every_effect_can_be_added_and_removed() {
    for card in drive_model::cards() {
        let mut model = example();
        if model.effects().iter().any(|e| e.card.id == card.id) {
            continue;
        }
        model.add(card.id).unwrap();
        let text = model.to_toml();
        assert!(model.effect_names().contains(&card.id.to_owned()) && model.parameters().iter().all(|p| !p.filled_in), "{text}");
        for comment in ["# my stand", "# terminal voltage", "# from the data sheet", "# a guess", "# so far"] {
            assert!(text.contains(comment), "{text}");
        }
        let next = model.next_name(card.id);
        assert_eq!(next, format!("{}#2", card.id));
        let before = model.to_toml();
        match model.add(&next) {
            Ok(()) => model.remove(&next).unwrap(),
            Err(error) => assert!(error.to_string().contains("cannot have a second instance"), "{error}"),
        }
        assert_eq!(model.to_toml(), before);
        assert!(model.add(card.id).is_err());
        model.remove(card.id).unwrap();
        assert_eq!(model.to_toml(), EXAMPLE);
    }
}

#[test]
fn edits_keep_comments_and_order() {
    let mut model = example();
    model.set("viscous_N_m_s", 7.5e-5).unwrap();
    model.set("motor_constant_N_m_A", 0.06).unwrap();
    model.set("seal-drag.a", 2e-3).unwrap();
    model.set("inertia_kg_m2", 1.0 / 3.0).unwrap();
    let wants = EXAMPLE
        .replace("6e-5 # a guess", "7.5e-5 # a guess")
        .replace("value = 0.05", "value = 0.06")
        .replace("a = 1e-3,", "a = 0.002,")
        .replace("= 2.5e-4", "= 0.3333333333333333");
    assert_eq!(model.to_toml(), wants);
    model.fix("viscous_N_m_s", true).unwrap();
    assert!(model.to_toml().contains("viscous_N_m_s = { value = 7.5e-5, fixed = true } # a guess"), "{}", model.to_toml());
    model.fix("viscous_N_m_s", false).unwrap();
    assert_eq!(model.to_toml(), wants);
    model.remove("viscous").unwrap();
    assert!(model.to_toml().contains("effects = [\"coulomb\"] # so far"), "{}", model.to_toml());
    model.remove("seal-drag").unwrap();
    assert!(model.user_effects().is_empty() && !model.to_toml().contains("seal"));
    model.add_user_effect("seal", SummingPoint::Torque, "-a * tanh(omega)", &[("a", 1e-4)]).unwrap();
    assert!(
        model.to_toml().ends_with("[effect.seal]\ntorque_N_m = \"-a * tanh(omega)\"\nparameters = { a = 1e-4 }\n"),
        "{}",
        model.to_toml()
    );
    assert!(model.add_user_effect("seal", SummingPoint::Torque, "1", &[]).is_err());
}

#[test]
fn invalid_edit_changes_nothing() {
    let mut model = example();
    for (error, wants) in [
        (model.set("viscous_N_m_s", -1.0), "outside the physical range"),
        (model.set("viscos_N_m_s", 1.0), "the model has no parameter 'viscos_N_m_s'; did you mean 'viscous_N_m_s'?"),
        (model.set_all([("coulomb_N_m", 2e-3), ("resistance_ohm", f64::NAN)]), "NaN is not a finite number"),
        (model.remove("cogging"), "the model has no effect 'cogging'; the model has viscous, coulomb, seal-drag"),
        (model.add("cogging#x"), "write 'cogging#2' for a second instance"),
        (model.add("viscous"), "is listed twice"),
        (model.set_input(Input::Motion), "is not an output for the input"),
    ] {
        let message = error.unwrap_err().to_string();
        assert!(message.contains(wants), "{message}");
    }
    assert_eq!(model.to_toml(), EXAMPLE);
}

#[test]
fn effects_without_influence_are_remarked() {
    let remarks = |effects: &str| Model::parse(&with(effects, ""), "m").unwrap().remarks().join("\n");
    assert!(remarks("\"viscous-temperature\"").contains("has no effect: it needs viscous"));
    assert!(remarks("\"presliding\"").contains("has no effect: it needs coulomb or stribeck"));
    assert!(!remarks("\"presliding\", \"coulomb\"").contains("nothing"));
    let own = format!("{BARE}[effect.rub]\ntorque_N_m = \"-sign(omega) * 1e-3\"\n");
    assert!(Model::parse(&own, "m").unwrap().remarks()[0].contains("discontinuous at rest"));
}

#[test]
fn phase_is_taken_modulo_one_turn() {
    let model = Model::parse(&with("\"cogging\"", "cogging_phase_rad = -1.0\n"), "m").unwrap();
    assert!((model.value("cogging_phase_rad").unwrap() - (std::f64::consts::TAU - 1.0)).abs() < 1e-12);
}

#[test]
fn user_effect_acts_at_each_summing_point() {
    let x = Point {
        from_s: 1.0,
        to_s: 1.5,
        start_s: 0.0,
        theta: 0.3,
        theta_measured: false,
        omega: 2.0,
        current: 0.4,
        voltage: 6.0,
        temp_C: 30.0,
        supply_ratio: 1.0,
        rate_from_encoder: false,
        reference_angle: false,
        columns: Default::default(),
    };
    for place in SummingPoint::ALL {
        let mut model = example();
        model.add_user_effect("mine", place, "k * (t + theta + omega + i + u + T)", &[("k", 2.0)]).unwrap();
        let own = &model.user_effects()[1];
        let (mut acts, mut reading) = (Contributions::<f64>::none(), Reading::of(0.0, 0.0, 0.0));
        own.contribute(&[2.0], &x, &mut acts);
        own.measure(&[2.0], &x, &mut reading);
        let all = [acts.torque.value(), acts.coulomb_torque.value(), acts.voltage.value(), reading.omega, reading.theta, reading.current];
        let at = SummingPoint::ALL.iter().position(|p| *p == place).unwrap();
        for (k, value) in all.into_iter().enumerate() {
            let wants = if k == at { 2.0 * (1.25 + 0.3 + 2.0 + 0.4 + 6.0 + 30.0) } else { 0.0 };
            assert!((value - wants).abs() < 1e-12, "{place:?}: {value}");
        }
    }
}

#[test]
#[ignore = "needs the external records: set STAND_DATA"]
fn models_of_the_external_cases_are_parsed() {
    let data = std::env::var_os("STAND_DATA").expect("the environment variable STAND_DATA names the folder of the external records");
    let cases = std::fs::read_dir(std::path::Path::new(&data).join("cases")).unwrap();
    let mut count = 0;
    for path in cases.map(|e| e.unwrap().path().join("model.toml")).filter(|p| p.is_file()) {
        let model = Model::read(&path).unwrap();
        assert!(model.remarks().is_empty() && !model.effects().is_empty(), "{path:?} {:?}", model.remarks());
        count += 1;
    }
    assert_eq!(count, 31);
}

proptest! {
    #[test]
    fn parser_never_panics(text in any::<String>()) {
        let _ = Model::parse(&text, "m");
    }

    #[test]
    fn parser_never_panics_on_a_damaged_file(at in 0usize..2000, length in 0usize..30, with in "[-+a-z0-9#\"'{}=,.\\[\\]\n ]{0,8}") {
        let mut text = EXAMPLE.to_owned();
        let from = at % text.len();
        let to = (from + length).min(text.len());
        text.replace_range(from..to, &with);
        match Model::parse(&text, "m") {
            Ok(mut model) => {
                let _ = model.add("cogging");
                let _ = model.set("cogging_N_m", 1e-3);
                let _ = model.fix("coulomb_N_m", true);
                let _ = model.add_user_effect("x", SummingPoint::Voltage, "u", &[]);
                for name in model.effect_names() {
                    model.remove(&name).unwrap();
                }
            }
            Err(error) => prop_assert!(!error.to_string().contains('\n')),
        }
    }

    #[test]
    fn parser_never_panics_on_any_toml(key in "(drive|parameters|effect|drive\\.effects|effect\\.x|parameters\\.coulomb_N_m|\"effect\"\\.\"cogging#2\")", value in "(1|true|\"u_V\"|\\[\\]|\\[1\\]|\\[\\[\\]\\]|\\{\\}|\\{ value = 1 \\}|\\{ input = \"u_V\" \\}|nan|1979-05-27)") {
        if let Ok(mut model) = Model::parse(&format!("{key} = {value}\n"), "m") {
            let _ = model.add("viscous");
        }
        let _ = Model::parse(&format!("{BARE}[other]\n{key} = {value}\n"), "m");
        let _ = Model::parse(&format!("[[{key}]]\na = {value}\n"), "m");
    }

    #[test]
    fn set_value_is_read_back_exactly(value in proptest::num::f64::POSITIVE | proptest::num::f64::NORMAL) {
        let mut model = example();
        if model.set("seal-drag.a", value).is_ok() {
            prop_assert_eq!(model.value("seal-drag.a"), Some(value));
            prop_assert_eq!(Model::parse(&model.to_toml(), "m").unwrap().value("seal-drag.a"), Some(value));
        } else {
            prop_assert!(!value.is_finite());
        }
    }
}
