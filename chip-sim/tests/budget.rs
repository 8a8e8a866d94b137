//! Costs of the flashed image on the emulated chip, against `firmware/budget.toml`: the whole handler of the tick, CPU load, stack.
//!
//! The scene is heavy normal use: 30 rad/s with eight harmonics, the default stream at 1 kHz, queries of all estimates. `--nocapture` prints the table
//! of docs/emulated-chip.md.
#![allow(clippy::unwrap_used)]

mod common;

use chip_sim::machine::TICK;
use chip_sim::soc::{RAM, RAM_BYTES};
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
