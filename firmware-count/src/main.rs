//! Counts the instructions that a control tick executes on the target's instruction set.
//!
//! Runs only under QEMU: `qemu-system-arm -M mps2-an386 -icount shift=10 -semihosting` (scripts/count-instructions.sh). The library's interrupt
//! runs unchanged. A small motor model replaces the registers. Scenes cover modes, limits, faults and incoming messages. The count starts at the
//! branch into the tick and ends at its return. It includes the check whether the torquer output is due, and `Interrupt::run` with mailboxes,
//! control law and report. It excludes the board's register accesses, about ten per tick.
//!
//! Output over semihosting: one line per scene, `scene|ticks|median|greatest`. A miscounting counter panics.
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
