//! Several logs together: what differs between them is found as that, and the time of each is its own.

use drive_model::Coordinate;
use hal_sim::plant::Stand;
use identification::identify::explain::criteria::JoiningCriteria;
use identification::identify::explain::join;
use identification::identify::fit;
use identification::identify::residual::{Difference, Misfit, Signature, misfits};
use identification::log::{Column, Log};
use identification::model::{Channel, Model};
use identification::recording;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;
use stand_tests::own;

/// Four logs of 10 s, with a change of a column in the third.
fn logs(change: impl Fn(&str, f64) -> f64) -> Vec<Log> {
    (1..=4)
        .map(|seed| {
            let log = own::log(&Stand::default(), Mode::Voltage, ProfileKind::MultiStep, 10.0, seed);
            let changed = |c: &Column| Column {
                name: c.name.clone(),
                values: c.values.iter().map(|v| if seed == 3 { change(&c.name, *v) } else { *v }).collect(),
            };
            Log::new(format!("{seed}.parquet"), log.columns().iter().map(changed).collect(), log.notes().to_vec()).expect("a log")
        })
        .collect()
}

/// What a fit of the default model leaves over.
fn left_over(logs: Vec<Log>) -> Vec<Misfit> {
    let (log, _) = join(logs, &JoiningCriteria::default()).expect("one log");
    let model = own::model(&[1.0; 6]);
    let (data, _) = recording::prepare(&log, &model, true).expect("the columns");
    let (system, parameters) = fit::build::system(&model, data.temp_C.is_some());
    let result = fit::fit(&system, &parameters, &data).expect("a fit");
    misfits(&log, &data, &result)
}

fn over_the_log(list: &[Misfit], channel: Channel) -> Option<Signature> {
    list.iter().find(|m| m.coordinate == Coordinate::Log && m.channel == channel).and_then(|m| m.signature)
}

#[test]
fn offset_of_one_log_differs_by_log() {
    let found = left_over(logs(|name, v| if name == "omega_rad_s" { v + 0.05 } else { v }));
    let wanted = Signature::ByLog { difference: Difference::Offset, channel: Some(Channel::Rate), is_voltage: false };
    assert_eq!(over_the_log(&found, Channel::Rate), Some(wanted), "{found:?}");
    assert_eq!(found.first().map(|m| m.coordinate), Some(Coordinate::Log), "{found:?}");
}

#[test]
fn scale_of_one_log_differs_by_log() {
    let found = left_over(logs(|name, v| if name == "i_A" { 1.1 * v } else { v }));
    assert!(matches!(over_the_log(&found, Channel::Current), Some(Signature::ByLog { .. })), "{found:?}");
}

#[test]
fn equal_logs_do_not_differ() {
    for seed in 0..3 {
        let all = (1..=4).map(|k| own::log(&Stand::default(), Mode::Voltage, ProfileKind::MultiStep, 10.0, 100 * seed + k)).collect();
        let found = left_over(all);
        assert!(found.iter().all(|m| m.coordinate != Coordinate::Log), "{found:?}");
    }
}

/// A torque from 4 s on, by the clock of each log.
#[test]
fn event_is_at_the_time_of_each_log() {
    let stand = |from_s: f64| {
        let mut stand = Stand::default();
        let parameters = [("load_step_N_m".to_owned(), 6e-4), ("load_from_s".to_owned(), from_s)];
        stand.effects.insert("load-step".to_owned(), parameters.into());
        stand
    };
    let all: Vec<Log> = (1..=3).map(|seed| own::log(&stand(4.0), Mode::Voltage, ProfileKind::MultiStep, 8.0, seed)).collect();
    let (log, _) = join(all, &JoiningCriteria::default()).expect("one log");
    assert_eq!(log.runs().len(), 3);
    let mut model = own::model(&[1.0; 6]);
    model.add("load-step").expect("an effect");
    model.set("load_from_s", 3.9).expect("a parameter");
    model.set("load_step_N_m", 5e-4).expect("a parameter");
    let (data, _) = recording::prepare(&log, &model, true).expect("the columns");
    let (low, high) = data.time_range_s();
    assert!(low < 0.1 && (high - 8.0).abs() < 0.1, "{low} {high}");
    let (system, parameters) = fit::build::system(&model, data.temp_C.is_some());
    let result = fit::fit(&system, &parameters, &data).expect("a fit");
    assert!(result.channels.iter().all(|c| c.rms / c.noise < 1.1), "the step is described in each log");
    let value = |model: &Model, name: &str| model.index(name).map(|k| result.parameters.list[k].value).expect("a parameter");
    assert!((value(&model, "load_from_s") - 4.0).abs() < 0.02);
    assert!((value(&model, "load_step_N_m") / 6e-4 - 1.0).abs() < 0.1);
}

/// A torque over the clock of each log: its phase begins again in each.
#[test]
fn timed_torque_counts_from_the_first_row_of_each_log() {
    let mut stand = Stand::default();
    let parameters =
        [("timed_torque_N_m".to_owned(), 8e-4), ("timed_torque_Hz".to_owned(), 1.37), ("timed_torque_phase_rad".to_owned(), 0.4)];
    stand.effects.insert("timed-torque".to_owned(), parameters.into());
    // Lengths that are no whole number of periods.
    let all: Vec<Log> = (1..=3).map(|seed| own::log(&stand, Mode::Voltage, ProfileKind::MultiStep, 8.1, seed)).collect();
    let (log, _) = join(all, &JoiningCriteria::default()).expect("one log");
    let mut model = own::model(&[1.0; 6]);
    model.add("timed-torque").expect("an effect");
    for (name, value) in [("timed_torque_N_m", 5e-4), ("timed_torque_Hz", 1.36), ("timed_torque_phase_rad", 0.4)] {
        model.set(name, value).expect("a parameter");
    }
    let (data, _) = recording::prepare(&log, &model, true).expect("the columns");
    assert_eq!(data.run_begins.len(), 3);
    assert!((data.longest_run_s() - 8.1).abs() < 0.1);
    let (system, parameters) = fit::build::system(&model, data.temp_C.is_some());
    let result = fit::fit(&system, &parameters, &data).expect("a fit");
    assert!(result.channels.iter().all(|c| c.rms / c.noise < 1.1), "one phase describes all logs");
    let value = |name: &str| model.index(name).map(|k| result.parameters.list[k].value).expect("a parameter");
    assert!((value("timed_torque_Hz") - 1.37).abs() < 1e-3, "{}", value("timed_torque_Hz"));
}
