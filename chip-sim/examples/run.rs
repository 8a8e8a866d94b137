//! Runs an image on the default stand: `cargo run -p chip-sim --example run -- IMAGE SECONDS [MS:LINE …]`.
//!
//! Each `MS:LINE` is sent over the serial line at that time. Prints the log, the serial line and the measurements.

use chip_sim::board::Board;
use chip_sim::image::Image;
use chip_sim::machine::{Machine, TICK};
use chip_sim::time::{PER_MS, of_seconds, seconds};
use hal_sim::plant::Plant;
use hal_sim::plant::stand::Stand;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(path), Some(duration_s)) = (arguments.next(), arguments.next()) else { return Err("IMAGE SECONDS [MS:LINE …]".into()) };
    let image = Image::read(Path::new(&path))?;
    let stand = Stand::default();
    let plant = Plant::new(&stand, 0.1)?;
    let board = Board::new(&stand.setup(), Box::new(plant), stand.drive.motor_constant_N_m_A, 1);
    let mut machine = Machine::new(&image, board);
    let begun = Instant::now();
    let mut sent = String::new();
    for argument in arguments {
        let Some((ms, line)) = argument.split_once(':') else { return Err("MS:LINE".into()) };
        let at: u64 = ms.parse()?;
        if let Err(halt) = machine.run_until(at * PER_MS) {
            println!("halt: {halt}");
            break;
        }
        machine.send(format!("{line}\n").as_bytes(), 921_600);
        sent.push_str(&String::from_utf8_lossy(&machine.take_sent()));
    }
    if let Err(halt) = machine.run_until(of_seconds(duration_s.parse()?)) {
        println!("halt: {halt}");
    }
    let wall_s = begun.elapsed().as_secs_f64();
    sent.push_str(&String::from_utf8_lossy(&machine.take_sent()));
    for message in chip_sim::log::messages(machine.log(), &image) {
        println!("log: {message}");
    }
    println!("serial line:\n{sent}");
    let reached_s = seconds(machine.now());
    let measures = &machine.measures;
    println!("{reached_s:.3} s in {wall_s:.2} s, {:.0} million instructions per second", measures.instructions as f64 / wall_s / 1e6);
    println!("load {:.1} %, lowest stack {:#x}", 100.0 * measures.load(machine.soc.cycles), measures.lowest_stack);
    if let Some(tick) = measures.handlers.get(&TICK) {
        println!("tick: {tick:?}, worst latency {} cycles", measures.worst_tick_latency_cycles);
    }
    println!("resets {:?}; accesses without a clock {:x?}", machine.resets, machine.soc.gated);
    println!("rate {:.4} rad/s, command {:?} V", machine.soc.board.plant().true_rate_rad_s(), machine.soc.board.command_V());
    Ok(())
}
