//! How many instructions a tick takes, counted one by one on the target's instruction set.
//!
//! Runs under QEMU alone: `qemu-system-arm -M mps2-an386 -icount shift=10 -semihosting`; scripts/count-instructions.sh does it.
//! The library's interrupt runs as it is on the board, with a small motor in the place of the registers, along scenes that go
//! through modes, limits, faults and arrivals. What is counted is what a tick calls, from the branch to the return: the look whether the torquer is due, and
//! `Interrupt::run` with mailboxes, law and report; without the registers of the board, of which a tick reads and writes some ten.
//!
//! Out, over semihosting: a line for each scene, `scene|ticks|median|greatest`. A counter that does not count right is a panic.
#![no_std]
#![no_main]

mod meter;
mod motor;
mod scenes;
mod tally;

use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use panic_semihosting as _;

#[entry]
fn main() -> ! {
    let Some(core) = cortex_m::Peripherals::take() else { panic!("the core's peripherals were taken before") };
    let meter = meter::Meter::calibrate(core.SYST);
    hprintln!("# {} steps of the timer in {} instructions", meter.steps, meter.instructions);
    for scene in scenes::SCENES {
        let tally = scenes::play(scene, &meter);
        hprintln!("{}|{}|{}|{}", scene.name, tally.ticks(), tally.median(), tally.greatest());
    }
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}
