//! The law of the tick on recorded inputs, to compare the chip's arithmetic with the host's bit for bit (chip-sim/tests/chip/replay.rs).
//!
//! The host writes a batch of inputs into `REPLAY_INPUT` and sets `REPLAY_GO`; this program computes the ticks, writes their outputs into
//! `REPLAY_OUTPUT` and clears `REPLAY_GO`. It is run on the emulated chip only.
#![no_std]
#![no_main]

mod words;

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m_rt::entry;
use stand_firmware::speed_loop::SpeedLoop;
use words::{BATCH, INPUT, OUTPUT, TickInput, config, tick};

#[unsafe(no_mangle)]
static REPLAY_INPUT: [[AtomicU32; INPUT]; BATCH] = [const { [const { AtomicU32::new(0) }; INPUT] }; BATCH];
#[unsafe(no_mangle)]
static REPLAY_OUTPUT: [[AtomicU32; OUTPUT]; BATCH] = [const { [const { AtomicU32::new(0) }; OUTPUT] }; BATCH];
#[unsafe(no_mangle)]
static REPLAY_GO: AtomicU32 = AtomicU32::new(0);

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        cortex_m::asm::nop();
    }
}

#[entry]
fn main() -> ! {
    if let Some(config) = config() {
        let mut speed_loop = SpeedLoop::new(config);
        loop {
            while REPLAY_GO.load(Ordering::Acquire) == 0 {}
            for (input, output) in REPLAY_INPUT.iter().zip(&REPLAY_OUTPUT) {
                let input = TickInput::of_words(&core::array::from_fn(|k| input.get(k).map_or(0, |word| word.load(Ordering::Relaxed))));
                for (place, word) in output.iter().zip(tick(&mut speed_loop, &input)) {
                    place.store(word, Ordering::Relaxed);
                }
            }
            REPLAY_GO.store(0, Ordering::Release);
        }
    }
    loop {
        cortex_m::asm::nop();
    }
}
