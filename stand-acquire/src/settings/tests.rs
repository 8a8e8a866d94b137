//! Settings as a file and as commands.

use super::file::{FileError, parse, text};
use super::*;
use stand_firmware::settings::FIELDS;

/// Settings without a round number, with harmonics and an observer of seven states.
fn settings() -> StandSettings {
    let of = |(n, field): (usize, &Field)| {
        let value =
            if field.name == "duty_full_scale" { 4500.0 } else { field.least + (field.greatest - field.least) * (n as f64 + 0.1) / 71.0 };
        Setting { name: field.name.to_owned(), value, unit: field.quantity().unit.to_owned() }
    };
    let harmonics = [(7, 1.0 / 3e4, -0.3), (14, 2e-5, 1.0 / 7.0)];
    let mut observer = ObserverParameters::default();
    observer.0.iter_mut().enumerate().for_each(|(n, number)| *number = -1.0 / (n as f64 + 3.0));
    for (field, value) in [(STATES, 7.0), (MOMENT, 1.0), (TORQUER, 0.013), (SETTLE, 0.7)] {
        observer.get_mut(field).fill(value);
    }
    StandSettings {
        settings: FIELDS.iter().enumerate().map(of).collect(),
        harmonics: harmonics.map(|(order, torque_N_m, phase_rad)| Harmonic { order, torque_N_m, phase_rad }).into(),
        observer,
    }
}

const IDENTITY: &str = "Rotary Stand,NUCLEO-F446RE,0123,0.1.0+1234abc";

#[test]
fn a_file_reads_back_bit_for_bit() {
    for observer in [settings().observer, ObserverParameters::default()] {
        let settings = StandSettings { observer, ..settings() };
        let content = parse(&text(&settings, IDENTITY, "2026-01-01")).unwrap();
        assert_eq!(content.source, "NUCLEO-F446RE,0123,0.1.0+1234abc");
        let blank = StandSettings {
            settings: settings.settings.iter().map(|s| Setting { value: 0.0, ..s.clone() }).collect(),
            harmonics: Vec::new(),
            observer: self::settings().observer,
        };
        assert_eq!(blank.with(&content).unwrap(), settings);
    }
}

#[test]
fn the_commands_read_back_bit_for_bit_and_fit_into_a_line() {
    let settings = settings();
    let mut read_back = StandSettings { settings: Vec::new(), harmonics: Vec::new(), observer: ObserverParameters::default() };
    for command in settings.commands() {
        assert!(command.len() <= 191, "{command}");
        read_back.take(&command).unwrap();
    }
    assert_eq!(read_back, settings);
    assert_eq!(settings.differences(&read_back), []);
}

#[test]
fn every_number_is_compared() {
    let before = settings();
    for n in 0..before.settings.len() {
        let mut after = before.clone();
        after.settings[n].value *= 1.0 + 1e-13;
        assert_eq!(before.differences(&after).len(), 1, "{}", before.settings[n].name);
    }
    for n in 0..before.observer.0.len() {
        let mut after = before.clone();
        after.observer.0[n] += 1.0;
        assert_eq!(before.differences(&after).len(), 1, "number {n} of the observer");
    }
    let mut after = before.clone();
    after.harmonics[0].phase_rad += 1e-9;
    after.harmonics.remove(1);
    assert_eq!(before.differences(&after).len(), 2);
}

#[test]
fn a_wrong_value_is_named_with_its_key() {
    let good = text(&settings(), IDENTITY, "2026-01-01");
    let bad = |from: &str, to: &str| {
        assert!(good.contains(from), "{from}");
        parse(&good.replacen(from, to, 1)).unwrap_err().to_string()
    };
    let line = |name: &str| good.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    assert_eq!(bad("format = 1", "format = 2"), "format = 2: this program reads format 1");
    assert_eq!(parse("name = 1").unwrap_err(), FileError::NoFormat);
    assert!(bad("[stand]", "[stand").starts_with("line 6: "), "{}", bad("[stand]", "[stand"));
    assert_eq!(bad(&line("slip_rad"), "slip_rad = 99"), "settings.slip_rad = 99: expected a number from 0.0001 to 6.3");
    assert_eq!(bad(&line("slip_rad"), "slip_rad = nan"), "settings.slip_rad = nan: expected a number from 0.0001 to 6.3");
    assert_eq!(bad(&line("slip_rad"), "slip_rad = \"1\""), "settings.slip_rad = \"1\": expected a number");
    assert_eq!(bad("slip_rad =", "slip_rda ="), "settings.slip_rda: there is no such key; did you mean `slip_rad`?");
    assert_eq!(bad("duty_full_scale = 4500.0", "duty_full_scale = 4500.5"), "scales.duty_full_scale = 4500.5: expected a whole number");
    assert!(bad("[scales]", "[scalse]").contains("did you mean `scales`?"));
    assert_eq!(bad("order = 14", "order = 7"), "compensation.harmonics[1].order = 7: expected a whole number that no other harmonic has");
    assert!(bad("order = 14", "order = 401").contains("from 1.0 to 400.0"));
    assert!(bad("torque_N_m = 2e-5", "torque_N_m = 0").contains("more than 0"));
    assert!(bad("torque_N_m = 2e-5, ", "").contains("compensation.harmonics[1].torque_N_m is missing"));
    assert_eq!(bad("states = 7", "states = 8"), "observer.states = 8: expected 0 or a whole number from 2 to 7");
    assert!(bad("states = 7", "states = 6").contains("observer.phi"));
    assert_eq!(bad("moment = true", "moment = 1"), "observer.moment = 1: expected true or false");
    assert!(bad(&line("settle_s"), "settle_s = -1").starts_with("observer.settle_s = -1: expected"));
    assert!(bad(&line("torquer_N_m_A"), "torquer_N_m_A = 1e-15").contains("0 or a number from 1e-12"));
    assert!(bad(&line("vibration"), "vibration = [1]").contains("a list of 3 numbers"));
}
