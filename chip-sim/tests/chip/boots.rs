//! The flashed image starts on the emulated chip, with the right clocks, and answers.

use crate::common;
use chip_sim::machine::TICK;
use chip_sim::time::PER_S;
use common::{Chip, image};

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn image_starts_and_answers_its_name() {
    let mut chip = Chip::booted();
    let log = chip.log();
    // The option bytes of a new chip have no brown-out level.
    assert!(
        log.len() == 3 && log[0].starts_with("INFO start after") && log[1].contains("brown-out") && log[2].contains("ready"),
        "{log:?}"
    );
    assert_eq!(chip.ask("SYSTem:RESet:CAUSe?"), "power-on");
    let name = chip.ask("*IDN?");
    assert!(name.starts_with("Rotary Stand,NUCLEO-F446RE,"), "{name}");
    assert_eq!(chip.machine.resets, []);
    assert!(chip.machine.soc.gated.is_empty(), "accesses to peripherals without a clock: {:x?}", chip.machine.soc.gated);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn identity_names_the_commit() {
    let name = Chip::booted().ask("*IDN?");
    let (_, commit) = name.rsplit_once('+').unwrap_or_else(|| panic!("no commit: {name}"));
    assert!(commit == "unknown" || commit.len() >= 7, "{name}");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn core_runs_at_180_MHz_and_a_tick_takes_18_000_cycles() {
    let mut chip = Chip::booted();
    assert_eq!(PER_S / chip.machine.soc.core_period(), 180_000_000);
    let (updates, now) = (chip.machine.soc.updates, chip.machine.now());
    chip.run_ms(1000);
    let elapsed = chip.machine.now() - now;
    let ticks = chip.machine.soc.updates - updates;
    assert!(ticks.abs_diff(elapsed * 10_000 / PER_S) <= 1, "{ticks} ticks in a second");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn flash_is_read_with_prefetch_and_both_caches() {
    let chip = Chip::booted();
    // Five wait states at 180 MHz and 3.3 V (RM0390, table 5).
    assert_eq!(chip.machine.soc.flash.wait_states(), 5);
    assert_eq!(chip.machine.soc.flash.accelerated(), [true; 3], "prefetch, instruction cache, data cache");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn every_tick_is_handled() {
    let mut chip = Chip::booted();
    chip.machine.start_measuring();
    let updates = chip.machine.soc.updates;
    chip.run_ms(500);
    let handled = chip.machine.measures.handlers[&TICK].calls;
    assert!(handled.abs_diff(chip.machine.soc.updates - updates) <= 1, "{handled} of {}", chip.machine.soc.updates - updates);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn converter_runs_at_20_kHz() {
    let mut chip = Chip::booted();
    let before = chip.machine.soc.adc.sequences;
    chip.run_ms(100);
    let sequences = chip.machine.soc.adc.sequences - before;
    assert!(sequences.abs_diff(2_000) <= 1, "{sequences} sequences in 0.1 s");
    assert_eq!(chip.machine.soc.adc.missed_triggers, 0);
    let supply_V = chip.number("MEASure:SUPPly?");
    assert!((supply_V - 12.0).abs() < 0.02, "{supply_V} V");
    let temperature_C = chip.number("MEASure:TEMPerature?");
    assert!((temperature_C - 25.0).abs() < 0.5, "{temperature_C} °C");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn runs_are_identical() {
    let run = || {
        let mut chip = Chip::booted();
        let reply = chip.ask("MEASure:CURRent?");
        (reply, chip.machine.soc.cycles, chip.machine.measures.instructions)
    };
    assert_eq!(run(), run());
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn loaded_segments_leave_the_settings_alone() {
    for (address, bytes) in &image().segments {
        let end = address + bytes.len() as u32;
        assert!(end <= 0x0800_4000 || *address >= 0x0800_C000, "segment {address:#x}..{end:#x}");
    }
}
