//! Costs of the flashed image on the emulated chip, against `firmware/budget.toml`: the whole handler of the tick, CPU load, stack.
//!
//! The scene is heavy normal use: 30 rad/s with eight harmonics, the default stream at 1 kHz, queries of all estimates. `--nocapture`
//! prints the table of docs/emulated-chip.md.
#![allow(clippy::unwrap_used)]

use crate::common;
use chip_sim::machine::TICK;
use chip_sim::soc::{RAM, RAM_BYTES};
use chip_sim::time::PER_MS;
use common::{Chip, Rows, image};

/// A limit of `firmware/budget.toml`.
fn budget(name: &str) -> f64 {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware/budget.toml");
    let text = std::fs::read_to_string(path).unwrap();
    let line = text.lines().find(|line| line.split('=').next().is_some_and(|key| key.trim() == name));
    line.and_then(|line| line.split('=').nth(1)).and_then(|value| value.trim().parse().ok()).unwrap_or_else(|| panic!("no {name}"))
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn heavy_use_stays_within_the_budget() {
    let mut chip = Chip::on(&hal_sim::plant::Stand::default());
    // The start-up counts for the stack.
    chip.run_ms(300);
    let start_stack = chip.machine.measures.lowest_stack;
    for order in 1..=8 {
        chip.command(&format!("COMPensation:HARMonic {},2E-5,0.3", 3 * order));
    }
    chip.say("SOURce:RATE 30;MODE RATE;:STReam ON");
    chip.run_s(4.0);
    chip.take_received();
    let tasks = chip.machine.watch("TaskStorage");
    assert!(tasks >= 2, "{tasks} tasks of the executors in the image");
    chip.machine.start_measuring();
    let mut received = Rows::default();
    for second in 0..10 {
        chip.say(["MEASure:DRIVe?", "MEASure:STABility?", "MEASure:TURN?", "SYSTem:ERRor?", "FAULt?"][second % 5]);
        chip.run_s(1.0);
        received.take(&chip.take_received(), |_| {});
    }
    let measures = &chip.machine.measures;
    let tick = measures.handlers[&TICK];
    let load_percent = 100.0 * measures.load(chip.machine.soc.cycles);
    let bottom = image().symbol("__sheap").expect("end of the static data");
    let top = RAM + RAM_BYTES;
    let lowest = start_stack.min(measures.lowest_stack);
    let stack_free_percent = 100.0 * f64::from(lowest - bottom) / f64::from(top - bottom);
    println!("| quantity | value | limit |\n|---|---|---|");
    let row = |name: &str, value: f64, limit: &str| println!("| {name} | {value:.0} | {} |", budget(limit));
    row("instructions of the tick's handler, greatest", tick.most_instructions as f64, "whole_handler_instructions");
    row("cycles of the tick's handler, greatest", tick.most_cycles as f64, "whole_handler_cycles");
    row("cycles from the update event to the handler, greatest", measures.worst_tick_latency_cycles as f64, "tick_latency_cycles");
    row("CPU load, %", load_percent, "cpu_load_percent");
    row("free stack, %", stack_free_percent, "stack_free_percent");
    for (address, poll) in measures.functions.iter().filter(|(_, poll)| poll.most_instructions > 1000) {
        let name = image().place(*address);
        println!("longest poll of {name}: {} instructions, interrupts included", poll.most_instructions);
    }
    println!("mean instructions of the handler: {}", tick.instructions / tick.calls.max(1));
    println!("stack: {} of {} bytes in use, {} of them at the start", top - lowest, top - bottom, top - start_stack);
    assert!(received.rows > 9_900 && received.missing_rows == 0, "{} rows, {} missing", received.rows, received.missing_rows);
    assert!(tick.most_instructions as f64 <= budget("whole_handler_instructions"), "{tick:?}");
    assert!(tick.most_cycles as f64 <= budget("whole_handler_cycles"), "{tick:?}");
    assert!(measures.worst_tick_latency_cycles as f64 <= budget("tick_latency_cycles"), "{} cycles", measures.worst_tick_latency_cycles);
    assert!(load_percent <= budget("cpu_load_percent"), "{load_percent} %");
    assert!(stack_free_percent >= budget("stack_free_percent"), "{stack_free_percent} %");
}

/// A scene: its name, the commands that begin it, and what happens in each of its hundredths of a second.
type Scene = (&'static str, &'static str, fn(&mut Chip, u32));

/// Compensation with eight harmonics, as the last part of a line.
const HARMONICS: [u32; 8] = [3, 6, 9, 12, 15, 18, 21, 24];

fn nothing(_: &mut Chip, _: u32) {}

/// The core hangs for a millisecond, and the fault is cleared by the next line.
fn hang_and_clear(chip: &mut Chip, hundredth: u32) {
    if hundredth.is_multiple_of(20) {
        let now = chip.machine.now();
        chip.machine.hang_until(now + PER_MS);
        chip.say("FAULt:CLEar;:SOURce:RATE 5;MODE RATE");
    }
}

/// The stop line and its clearing.
fn stop_and_clear(chip: &mut Chip, hundredth: u32) {
    match hundredth % 20 {
        0 => chip.machine.send(b"\x18", common::BAUD),
        10 => chip.say("FAULt:CLEar;:SOURce:RATE 5;MODE RATE"),
        _ => {}
    }
}

const SCENES: [Scene; 9] = [
    ("off", "OUTPut OFF", nothing),
    ("voltage", "SOURce:VOLTage 1;MODE VOLTage", nothing),
    ("rate", "SOURce:RATE 5;MODE RATE", nothing),
    ("rate, steps at the acceleration limit", "PROFile:TYPE MULTI-STEP;AMPLitude 20;DURation 60;:PROFile:STARt", nothing),
    ("rate, chirp", "PROFile:TYPE CHIRP;AMPLitude 5;DURation 60;:PROFile:STARt", nothing),
    ("position", "SOURce:POSition 300;MODE POSition", nothing),
    ("voltage, current limit", "PROFile:TYPE MULTI-STEP;MODE VOLTage;AMPLitude 4;DWELl_s 0.3;DURation 60;:PROFile:STARt", nothing),
    ("emergency stop, cleared", "SOURce:RATE 5;MODE RATE", stop_and_clear),
    ("lost ticks, cleared", "SOURce:RATE 5;MODE RATE", hang_and_clear),
];

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn handler_of_every_scene_stays_within_the_budget() {
    println!("| scene, with eight harmonics | mean instructions | greatest | greatest, cycles |\n|---|---|---|---|");
    let mut worst = 0;
    for (name, begin, step) in SCENES {
        let mut chip = Chip::booted();
        for order in HARMONICS {
            chip.command(&format!("COMPensation:HARMonic {order},2E-5,0.3"));
        }
        chip.command(begin);
        chip.run_ms(500);
        chip.machine.start_measuring();
        for hundredth in 0..200 {
            step(&mut chip, hundredth);
            chip.run_ms(10);
        }
        let tick = chip.machine.measures.handlers[&TICK];
        println!("| {name} | {} | {} | {} |", tick.instructions / tick.calls.max(1), tick.most_instructions, tick.most_cycles);
        worst = worst.max(tick.most_instructions);
    }
    assert!(worst as f64 <= budget("whole_handler_instructions"), "{worst}");
}

/// The exception of UART5, in which the measurement's executor runs.
const MEASUREMENT: u32 = TICK - 25 + 53;

/// Instructions of the measurement's handler per row, mean and greatest of a call, preempting handlers excluded, with this observer.
fn row_instructions(observer: &[String]) -> (f64, u64) {
    const ROWS: u32 = 1000;
    let mut chip = Chip::booted();
    for line in observer {
        chip.command(line);
    }
    chip.run_ms(500);
    if !observer.is_empty() {
        assert!(chip.ask("OBServer:PHASe?").starts_with("SETTL"), "{}", chip.ask("OBServer:PHASe?"));
    }
    chip.machine.start_measuring();
    chip.run_ms(ROWS.into());
    let handler = chip.machine.measures.handlers[&MEASUREMENT];
    (handler.instructions as f64 / f64::from(ROWS), handler.most_instructions)
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn row_and_step_of_an_observer_stay_within_the_budget() {
    let list = |value: &dyn Fn(usize) -> f64| (0..7).map(|column| value(column).to_string()).collect::<Vec<_>>().join(",");
    let mut observer = vec!["OBServer:NEW 7,ON".to_owned()];
    observer.extend((0..7).map(|row| format!("OBServer:PHI {},{}", row + 1, list(&|column| if column == row { 0.5 } else { 0.0131 }))));
    observer.push(format!("OBServer:GAMMa {}", list(&|_| 0.37)));
    observer.push(format!("OBServer:GAIN {}", list(&|_| 0.113)));
    observer.push("OBServer:TORQuer 0.01;STATe ON".to_owned());
    let ((without, most), (with, _)) = (row_instructions(&[]), row_instructions(&observer));
    println!("| quantity | instructions | limit |\n|---|---|---|");
    println!("| a row of the measurement, mean | {without:.0} | {} |", budget("row_instructions"));
    println!("| the measurement's handler, greatest | {most} | |");
    println!("| a step of an observer with seven states | {:.0} | {} |", with - without, budget("observer_step_instructions"));
    assert!(without <= budget("row_instructions"), "{without}");
    assert!(with - without <= budget("observer_step_instructions"), "{}", with - without);
}
