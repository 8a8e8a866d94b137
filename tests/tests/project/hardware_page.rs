//! docs/hardware.md agrees with the board's drivers: pins with their peripherals, and the scales of the analog inputs.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_firmware::board::Hardware;
use stand_tests::bench::with_stand;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn page() -> String {
    std::fs::read_to_string(root().join("docs/hardware.md")).unwrap()
}

/// The rows of the table under a heading, as cells.
fn table(page: &str, heading: &str) -> Vec<Vec<String>> {
    let section = page.split(&format!("## {heading}\n")).nth(1).unwrap_or_else(|| panic!("no section {heading}"));
    let section = section.split("\n## ").next().unwrap();
    let rows = section.lines().skip_while(|line| !line.starts_with('|')).take_while(|line| line.starts_with('|')).skip(2);
    rows.map(|row| row.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect()).collect()
}

/// Words that begin with one of `starts` and go on with digits or capitals, in the order of the text.
fn words<'t>(text: &'t str, starts: &[&str]) -> Vec<&'t str> {
    let all = text.split(|c: char| !c.is_ascii_alphanumeric());
    all.filter(|word| {
        starts.iter().any(|start| word.strip_prefix(start).is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit())))
    })
    .collect()
}

fn is_pin(word: &str) -> bool {
    word.len() >= 3
        && word.as_bytes()[0] == b'P'
        && word.as_bytes()[1].is_ascii_uppercase()
        && word[2..].chars().all(|c| c.is_ascii_digit())
}

const PERIPHERALS: [&str; 5] = ["TIM", "ADC", "DAC", "SPI", "USART"];

/// The source of the board's binary without comments.
fn source() -> String {
    let mut text = String::new();
    for entry in std::fs::read_dir(root().join("firmware/src/bin/stand")).unwrap() {
        let file = std::fs::read_to_string(entry.unwrap().path()).unwrap();
        file.lines().filter(|line| !line.trim_start().starts_with("//")).for_each(|line| text += &format!("{line}\n"));
    }
    text
}

/// The statement in which each pin is taken (`p.PA8`).
fn taken_pins(source: &str) -> BTreeMap<String, String> {
    let mut pins = BTreeMap::new();
    for statement in source.split(';') {
        for (at, _) in statement.match_indices("p.P") {
            let pin: String = statement[at + 2..].chars().take_while(char::is_ascii_alphanumeric).collect();
            if is_pin(&pin) {
                let before = pins.insert(pin.clone(), statement.to_owned());
                assert!(before.is_none(), "{pin} is taken twice");
            }
        }
    }
    pins
}

#[test]
fn the_page_lists_exactly_the_pins_that_the_drivers_take() {
    let documented: Vec<String> =
        table(&page(), "Pins").iter().flat_map(|row| row[0].split(", ").map(str::to_owned).collect::<Vec<_>>()).collect();
    let unique: BTreeSet<String> = documented.iter().cloned().collect();
    assert_eq!(unique.len(), documented.len(), "a pin has two rows: {documented:?}");
    let taken: BTreeSet<String> = taken_pins(&source()).into_keys().collect();
    assert!(taken.len() > 20, "{taken:?}");
    assert_eq!(unique, taken);
}

#[test]
fn each_pin_has_the_peripheral_of_its_statement() {
    let source = source();
    let pins = taken_pins(&source);
    for row in table(&page(), "Pins") {
        let function = &row[2];
        for pin in row[0].split(", ") {
            let statement = &pins[pin];
            let named = words(statement, &PERIPHERALS);
            let documented: BTreeSet<&str> = words(function, &PERIPHERALS).into_iter().collect();
            if function.starts_with("GPIO: ") {
                assert!(statement.contains("gpio::") && named.is_empty(), "{pin} is {function}, but: {statement}");
                // `let stop_contact = …`: a word of the variable's name is in the row.
                let name = statement.split("let ").nth(1).unwrap().split('=').next().unwrap().trim().to_owned();
                assert!(name.split('_').any(|word| function.to_lowercase().contains(word)), "{pin}: {name}, {function}");
            } else if documented.contains("SPI2") {
                let fields = BTreeMap::from([("SCK", "clock"), ("MISO", "from_sensor"), ("MOSI", "to_sensor"), ("CS", "select")]);
                let signals: Vec<&str> = function.split_once(": ").unwrap().1.split(", ").collect();
                let signal = signals[row[0].split(", ").position(|other| other == pin).unwrap()];
                assert!(statement.contains(&format!("{}: p.{pin}", fields[signal])), "{pin} is {signal}, but: {statement}");
            } else {
                assert_eq!(documented.len(), 1, "{pin}: one peripheral in {function}");
                let is_named = named.iter().any(|name| documented.contains(name));
                // The receiving pin's call names the transmitter, which was made from the peripheral.
                let is_receiver = documented.contains("USART2") && statement.contains("Receiver::new");
                assert!(is_named || is_receiver, "{pin} is {function}, but: {statement}");
            }
        }
    }
}

/// The sequence of the analog inputs in the table is that of the sweep's constants.
#[test]
fn analog_inputs_are_in_the_order_of_the_sweep() {
    let rows = table(&page(), "Pins");
    let analog: Vec<&Vec<String>> = rows.iter().filter(|row| row[2].starts_with("ADC1: ")).collect();
    let source = source();
    for (constant, word) in
        [("CURRENT", "motor current"), ("SUPPLY", "supply"), ("TEMPERATURE", "temperature"), ("ANGLE", "angle"), ("TORQUER", "torquer")]
    {
        let index = source.split(&format!("const {constant}: usize = ")).nth(1).unwrap().split(';').next().unwrap();
        let row = analog[index.parse::<usize>().unwrap()];
        assert!(row[2].contains(word), "{constant}: {row:?}");
    }
}

#[test]
fn scales_and_figures_are_the_firmwares_defaults() {
    let (page, h) = (page(), Hardware::default());
    let rows = table(&page, "Analog inputs");
    let per_code = |input: &str| rows.iter().find(|row| row[0] == input).unwrap()[2].clone();
    assert_eq!(per_code("motor current"), format!("{:.4} mA", 1e3 * h.current_A_per_code));
    assert_eq!(per_code("supply"), format!("{:.3} mV", 1e3 * h.supply_V_per_code));
    assert_eq!(per_code("angle sensor"), format!("{:.4} mV", 1e3 * h.angle_V_per_code));
    assert_eq!(per_code("torquer current"), format!("{:.5} mA", 1e3 * h.torquer_A_per_code));
    assert_eq!(h.current_zero_code, 2048.0, "1.65 V");
    let settings = stand_firmware::speed_loop::Settings::default();
    let drive = Stand::default().drive;
    assert_eq!((drive.inertia_kg_m2, settings.inertia_kg_m2), (2.5e-4, 2.5e-4));
    let turns = h.counts_per_turn as u32;
    for figure in [
        format!("{} lines, {} {:03} counts", turns / 4, turns / 1000, turns % 1000),
        format!("{} Ω, 0.238 mH, {:.1} mN m/A", drive.resistance_ohm, 1e3 * drive.motor_constant_N_m_A),
        format!("`over_current_A`, {} A", settings.safety.over_current_A),
        format!("overspeed limit of {} rad/s", settings.overspeed_rad_s),
        format!("{} rad/s², 0.64 A", settings.acceleration_rad_s2),
        format!("0.13 kg: ½ m r² = {:.2}·10⁻⁴ kg m²", 1e4 * 0.5 * 0.13 * 0.06_f64.powi(2)),
        format!("= {:.2} J", 0.5 * drive.inertia_kg_m2 * 34.9_f64.powi(2)),
        format!("{:.1} mm in aluminium", 1e3 * 0.13 / (2700.0 * std::f64::consts::PI * 0.06_f64.powi(2))),
    ] {
        assert!(page.contains(&figure), "{figure}");
    }
}

/// The console commands of docs/bring-up.md: words in backquotes with a header of several words or a common command.
fn bring_up_commands() -> Vec<String> {
    let page = std::fs::read_to_string(root().join("docs/bring-up.md")).unwrap();
    let spans: Vec<String> = page.split('`').skip(1).step_by(2).map(str::to_owned).collect();
    let is_command = |span: &String| {
        let header = span.split([' ', '?', ';']).next().unwrap();
        let is_word = |word: &str| word.len() >= 3 && word[..3].chars().all(|c| c.is_ascii_uppercase());
        header.starts_with('*')
            || header == "STOP"
            || header.contains(':') && header.split(':').next().is_some_and(is_word)
            || span.ends_with('?') && is_word(header)
    };
    spans.into_iter().filter(is_command).collect()
}

#[test]
fn the_stand_accepts_the_commands_of_the_first_hour() {
    let commands = bring_up_commands();
    assert!(commands.len() > 20, "{commands:?}");
    with_stand(&Stand::default(), async |host| {
        host.wait_s(0.5).await;
        for command in &commands {
            host.send(format!("FAULt:CLEar;*CLS\n{command}\n").as_bytes());
            host.wait_s(0.2).await;
            host.received();
            // Positive numbers are faults that a command causes: STOP.
            let error = host.query("SYST:ERR?").await;
            assert!(!error.starts_with('-'), "{command}: {error}");
            host.command("OUTPut OFF").await;
            host.wait_s(0.5).await;
        }
    });
}

/// The figures of the first volt follow from the default stand's constants.
#[test]
fn the_first_volt_is_that_of_the_drive() {
    let (drive, page) = (Stand::default().drive, std::fs::read_to_string(root().join("docs/bring-up.md")).unwrap());
    let (coulomb_N_m, viscous_N_m_s) = (9e-4, 2e-5);
    let (k, r) = (drive.motor_constant_N_m_A, drive.resistance_ohm);
    let rate_rad_s = (1.0 - r * coulomb_N_m / k) / (k + r * viscous_N_m_s / k);
    let current_A = (coulomb_N_m + viscous_N_m_s * rate_rad_s) / k;
    assert!(
        page.contains(&format!("about {current_A:.2} A")) && page.contains(&format!("about {rate_rad_s:.0} RAD/S")),
        "{current_A} {rate_rad_s}"
    );
    let low_us = 50.0 / drive.supply_V;
    assert!(page.contains(&format!("low for {low_us:.2} µs")), "{low_us}");
}
