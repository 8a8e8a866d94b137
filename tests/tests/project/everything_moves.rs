//! Every effect with each of its parameters, every number of a stand's file, and every profile with each of its parameters changes an
//! output.
//!
//! `hal-sim/tests/firmware/settings.rs` tests settings on a linear motor. Here the numbers of the stand's file are enumerated, so that new
//! ones are tested too. `stand/tests/command/options.rs` tests the options of the command.
#![allow(clippy::unwrap_used)]

use drive_model::{Card, Domain, Parameter, ParameterKind, cards};
use hal_sim::gyro::SingleAxis;
use hal_sim::plant::{Plant, Stand};
use hal_sim::session::{Record, SessionRequest, run};
use rayon::prelude::*;
use stand_acquire::hidden;
use stand_firmware::config::ConfigError;
use stand_firmware::profile::{Profile, ProfileConfig, ProfileKind};
use stand_firmware::speed_loop::Mode;
use stand_tests::bench::with_gyro;
use toml::{Table, Value};

const MODES: [Mode; 2] = [Mode::Voltage, Mode::Rate];

/// An experiment with high excitation: steps through zero, short dwells.
fn steps(mode: Mode, seconds: f64) -> SessionRequest {
    let mut request = SessionRequest::new(mode, ProfileKind::MultiStep, seconds, 5);
    request.profile.dwell_s = 0.3;
    request
}

fn session(stand: &Stand, request: SessionRequest) -> Record {
    run(stand.setup(), Plant::new(stand, 0.0).unwrap(), request).unwrap()
}

fn column<'a>(record: &'a Record, name: &str) -> &'a [f64] {
    record.column(name).unwrap()
}

/// Names of the parameters that are times of the record.
fn event_times() -> impl Iterator<Item = &'static str> {
    cards().iter().flat_map(|card| card.parameters).filter(|p| p.kind == ParameterKind::EventTime).map(|p| p.name)
}

/// Long enough that delayed effects have started.
fn seconds(stand: &Stand) -> f64 {
    let moment = stand.effects.values().find_map(|p| event_times().find_map(|name| p.get(name))).copied();
    moment.map_or(2.0, |t| t + 1.0)
}

#[test]
fn every_hidden_effect_changes_the_log_open_and_closed_loop() {
    let silent: Vec<String> = cards()
        .par_iter()
        .flat_map_iter(|card| MODES.map(|mode| (card, mode)))
        .filter_map(|(card, mode)| {
            let mut stand = Stand::default();
            hidden::hide(card.id, &mut stand).unwrap();
            let request = steps(mode, seconds(&stand));
            let (null, other) = (session(&Stand::default(), request), session(&stand, request));
            (null.columns == other.columns).then(|| format!("{} {mode:?}", card.id))
        })
        .collect();
    assert!(silent.is_empty(), "{silent:?}");
}

#[test]
fn open_loop_measurement_effect_moves_only_its_reading() {
    for card in cards().iter().filter(|c| c.domain == Domain::Measurement) {
        let mut stand = Stand::default();
        hidden::hide(card.id, &mut stand).unwrap();
        let request = steps(Mode::Voltage, seconds(&stand));
        let (null, other) = (session(&Stand::default(), request), session(&stand, request));
        let motion = |r: &Record| (r.true_theta_rad.clone(), r.true_omega_rad_s.clone(), column(r, "u_V").to_vec());
        assert!(motion(&null) == motion(&other), "{}: the motion and what drives it are the same", card.id);
        let reading = if card.id.starts_with("current") {
            "i_A"
        } else if ["encoder-eccentricity", "lost-counts"].contains(&card.id) {
            "theta_rad"
        } else {
            "omega_rad_s"
        };
        for name in ["i_A", "theta_rad", "omega_rad_s"] {
            let moved = column(&null, name) != column(&other, name);
            assert_eq!(moved, name == reading, "{}: {name}", card.id);
        }
    }
}

/// Another permitted value of the parameter.
fn another(p: &Parameter, value: f64) -> f64 {
    match p.kind {
        ParameterKind::HarmonicOrder => value + 1.0,
        ParameterKind::Phase => (value + 1.0) % std::f64::consts::TAU,
        ParameterKind::EventTime => value + 0.5,
        ParameterKind::Fraction => 0.5 * (value + p.range.1.min(1.0)),
        _ if value == 0.0 => p.simulated_range.1.max(p.start).max(1e-3),
        _ => (1.5 * value).clamp(p.range.0, p.range.1),
    }
}

/// The default stand's file with one hidden effect.
fn file_with(card: &Card) -> Table {
    let mut stand = Stand::default();
    hidden::hide(card.id, &mut stand).unwrap();
    let mut file = Table::try_from(&stand).unwrap();
    for name in event_times() {
        if let Some(moment) = file["effects"][card.id].get_mut(name) {
            // Within the short session.
            *moment = Value::Float(0.7);
        }
    }
    file
}

fn run_file(file: &Table, request: SessionRequest) -> Record {
    session(&Stand::parse(&toml::to_string(file).unwrap()).unwrap(), request)
}

/// Changes parameters in the stand's file, effect by effect. Winding heating is visible within seconds in the measured temperature and in
/// the winding resistance. The true series is not compared, because no sensor measures it.
#[test]
fn every_parameter_of_every_effect_changes_the_record() {
    let silent: Vec<String> = cards()
        .par_iter()
        .flat_map_iter(|card| {
            let file = file_with(card);
            let request = steps(Mode::Voltage, 2.0);
            let before = run_file(&file, request);
            card.parameters
                .iter()
                .filter_map(|p| {
                    let mut changed = file.clone();
                    let value = changed["effects"][card.id][p.name].as_float().unwrap();
                    let new = another(p, value);
                    assert_ne!(value, new, "{}.{}", card.id, p.name);
                    changed["effects"][card.id][p.name] = Value::Float(new);
                    let after = run_file(&changed, request);
                    let moved = before.columns != after.columns || before.true_omega_rad_s != after.true_omega_rad_s;
                    (!moved).then(|| format!("{}.{}: {value} to {new}", card.id, p.name))
                })
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(silent.is_empty(), "{silent:?}");
}

/// All numbers of a table, as paths of keys.
fn numbers(table: &Table, path: &[String]) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for (key, value) in table {
        let path: Vec<String> = path.iter().cloned().chain([key.clone()]).collect();
        match value {
            // compensation.rs tests these with a learned compensation.
            Value::Table(_) if key == "compensation" => {}
            // A safety threshold has no effect without a fault: hal-sim/tests/firmware/safety.rs.
            Value::Table(_) if key == "safety" => {}
            // Approach to an angle: hal-sim/tests/firmware/safety.rs.
            _ if key == "approach_rad_s" => {}
            // States the board's filter for the notes of `stand record`; a session uses the sensor's.
            _ if key == "rate_cutoff_Hz" => {}
            Value::Table(inner) => found.extend(numbers(inner, &path)),
            Value::Float(_) | Value::Integer(_) => found.push(path),
            Value::String(_) => assert_eq!(path, ["name"], "the name is the only text value"),
            other => panic!("{path:?}: {other}"),
        }
    }
    found
}

fn at<'a>(file: &'a mut Table, path: &[String]) -> &'a mut Value {
    let (first, rest) = path.split_first().unwrap();
    rest.iter().fold(file.get_mut(first).unwrap(), |value, key| value.get_mut(key).unwrap())
}

/// Limits have an effect only when in force: far below the demand.
fn changed(name: &str, value: &Value) -> Value {
    match (name, value) {
        ("firmware.overspeed_rad_s", _) => Value::Float(10.0),
        ("firmware.voltage_limit_V", _) => Value::Float(0.5),
        ("firmware.current_limit_A", _) => Value::Float(0.2),
        ("firmware.slip_rad", _) => Value::Float(0.01),
        // Below the amplitude of the gyro's angle sensor in a cycle.
        ("firmware.gyro.angle_limit_V", _) => Value::Float(0.005),
        ("sensors.rate_full_scale_rad_s", _) => Value::Float(5.0),
        ("sensors.current_per_tick", _) => Value::Integer(4),
        // The firmware's voltage limit is 11.4 V: a nominal supply below it would be refused.
        ("hardware.supply_nominal_V", _) => Value::Float(24.0),
        // So low that the converter saturates at the currents of a session.
        ("hardware.current_zero_code", _) => Value::Float(100.0),
        (_, Value::Integer(n)) => Value::Integer(n * 7 / 10),
        (_, Value::Float(x)) => Value::Float(0.7 * x),
        _ => panic!("{name} is no number"),
    }
}

/// A cycle of the drift measurement on such a stand, as exact numbers; or the rejected setting.
fn cycle(file: &Table) -> String {
    let stand = Stand::parse(&toml::to_string(file).unwrap()).unwrap();
    with_gyro(&stand, SingleAxis::default(), async |host| {
        host.wait_s(0.2).await;
        // 0.1 °/s are 0.087 A of the torquer's 0.09.
        let refused = host.refusal("DRIF:DUR 0.2 S;PER 0;REST 0.6 S;RATE 0.1 DEG/S;COUN 1;STAR").await;
        host.wait_s(2.0).await;
        format!("{refused} {}", host.query("DRIF:CYCL?").await)
    })
}

/// The roll is used only by an observer under vibration: hal-sim/tests/firmware/observer.rs.
const TESTED_ELSEWHERE: [&str; 1] = ["hardware.roll_rad_per_code"];

#[test]
fn every_number_of_a_stands_file_changes_a_record() {
    let mut stand = Stand::default();
    stand.firmware.acceleration_rad_s2 = 200.0;
    // All keys are written out, so that none depends on another.
    let file = Table::try_from(&stand).unwrap();
    let mut fast = steps(Mode::Rate, 2.0);
    fast.profile.amplitude = 34.0;
    let experiments = [fast, steps(Mode::Voltage, 2.0)];
    let before = experiments.map(|request| run_file(&file, request));
    let cycle_before = cycle(&file);
    let numbers_found = numbers(&file, &[]);
    assert!(numbers_found.len() >= 35, "drive, effects, sensors, hardware, firmware: {}", numbers_found.len());
    let silent: Vec<String> = numbers_found
        .par_iter()
        .filter_map(|path| {
            let name = path.join(".");
            let mut other = file.clone();
            let value = at(&mut other, path);
            *value = changed(&name, value);
            let moved = experiments.iter().zip(&before).any(|(request, before)| {
                let after = run_file(&other, *request);
                before.columns != after.columns || before.fault != after.fault
            });
            let moved = moved || TESTED_ELSEWHERE.contains(&name.as_str()) || cycle(&other) != cycle_before;
            (!moved).then_some(name)
        })
        .collect();
    assert!(silent.is_empty(), "{silent:?}");
}

/// A file that only specifies another drive gets a firmware with the default's pole locations.
#[test]
fn firmware_follows_the_drive_unless_the_file_overrides_it() {
    let default = Stand::parse("").unwrap();
    type Follows = fn(&Stand) -> f64;
    let inertia: [(&str, Follows); 3] = [
        ("inertia_kg_m2", |s| s.firmware.inertia_kg_m2),
        ("rate_gain_V_s_rad", |s| s.firmware.rate_gain_V_s_rad),
        ("position_gain_V_rad", |s| s.firmware.position_gain_V_rad),
    ];
    let heavy = Stand::parse("[drive]\ninertia_kg_m2 = 5e-4\n").unwrap();
    for (name, follows) in inertia {
        assert!(follows(&heavy) > 1.9 * follows(&default), "{name}: {} {}", follows(&heavy), follows(&default));
        let overridden = Stand::parse(&format!("[drive]\ninertia_kg_m2 = 5e-4\n[firmware]\n{name} = 0.7\n")).unwrap();
        assert_eq!(follows(&overridden), 0.7, "{name}: the file's value has priority");
    }
    let other = Stand::parse("[drive]\nresistance_ohm = 5.0\nmotor_constant_N_m_A = 0.05\nsupply_V = 24.0\n").unwrap();
    assert_eq!((other.firmware.resistance_ohm, other.firmware.motor_constant_N_m_A), (5.0, 0.05));
    assert_eq!(other.hardware.supply_nominal_V, 24.0);
}

#[test]
fn two_effects_of_one_kind_both_act() {
    let one = "[effects.cogging]\ncogging_N_m = 1e-3\ncogging_order = 7\n";
    let both = format!("{one}[effects.\"cogging#2\"]\ncogging_N_m = 1e-3\ncogging_order = 11\n");
    let request = steps(Mode::Voltage, 1.0);
    let [one, both] = [one, &both].map(|text| session(&Stand::parse(text).unwrap(), request));
    assert_ne!(one.columns, both.columns);
}

/// Change of a profile's parameter.
type Change = fn(&mut ProfileConfig);

/// All parameters of a profile. A new field does not compile here without an entry.
fn parameters() -> [(&'static str, Change); 14] {
    let ProfileConfig {
        kind: _,
        amplitude: _,
        offset: _,
        dwell_s: _,
        levels: _,
        bit_s: _,
        from_Hz: _,
        to_Hz: _,
        sweep_s: _,
        frequency_Hz: _,
        acceleration: _,
        jerk: _,
        cycles: _,
        turns: _,
        seed: _,
    } = ProfileConfig::new(ProfileKind::Constant, 1.0, 1);
    [
        ("amplitude", |c| c.amplitude *= 1.5),
        ("offset", |c| c.offset += 0.5),
        ("dwell_s", |c| c.dwell_s *= 0.5),
        ("levels", |c| c.levels -= 2),
        ("bit_s", |c| c.bit_s *= 0.5),
        ("from_Hz", |c| c.from_Hz *= 2.0),
        ("to_Hz", |c| c.to_Hz *= 0.5),
        ("sweep_s", |c| c.sweep_s *= 0.5),
        ("frequency_Hz", |c| c.frequency_Hz *= 2.0),
        ("acceleration", |c| c.acceleration *= 0.5),
        ("jerk", |c| c.jerk *= 0.5),
        ("cycles", |c| c.cycles += 1),
        ("turns", |c| c.turns -= 1),
        ("seed", |c| c.seed += 1),
    ]
}

#[test]
fn profile_depends_on_its_own_parameters_only() {
    for kind in ProfileKind::ALL {
        let values = |config: &ProfileConfig| {
            let mut profile = Profile::new(config)?;
            // Longer than one chirp and one staircase.
            Ok::<_, ConfigError>((0..40_000).map(|_| profile.next_value()).collect::<Vec<f64>>())
        };
        let usual = ProfileConfig::new(kind, 2.0, 1);
        for (name, change) in parameters() {
            let mut other = usual;
            change(&mut other);
            // Turns have no offset and refuse one.
            let refused = kind == ProfileKind::Turns && name == "offset";
            let used = kind.parameters().contains(&name) || refused;
            assert_eq!(values(&usual) != values(&other), used, "{kind}: {name}");
            assert_eq!(values(&other).is_err(), refused, "{kind}: {name}");
        }
    }
}

#[test]
fn every_profile_and_seed_gives_a_different_log() {
    for mode in MODES {
        let kinds: Vec<ProfileKind> = ProfileKind::ALL.into_iter().filter(|kind| mode == Mode::Rate || !kind.is_a_rate()).collect();
        let request = |kind| {
            let mut request = SessionRequest::new(mode, kind, 2.0, 1);
            request.profile.dwell_s = 0.2; // ABBA differs from alternating from its third level on
            request
        };
        let records: Vec<Record> = kinds.iter().map(|kind| session(&Stand::default(), request(*kind))).collect();
        for (k, one) in records.iter().enumerate() {
            assert!(records[..k].iter().all(|other| other.columns != one.columns), "{mode:?} {}", kinds[k]);
        }
        let noise = session(&Stand::default(), SessionRequest { seed: 2, ..request(ProfileKind::Multisine) });
        assert_ne!(noise.columns, records[2].columns, "{mode:?}: another seed is another noise");
    }
}
