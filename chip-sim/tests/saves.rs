//! Settings in the flash: saving stalls the chip for a quarter of a second now and then; nothing may follow from it.

mod common;

use chip_sim::time::{PER_MS, PER_S};
use common::Chip;

/// Saves at which the sectors have been erased once more: 16 KiB hold several records.
const SAVES: usize = 17;

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn seventeen_saves_at_rest_succeed_and_survive_a_power_cut() {
    let mut chip = Chip::booted();
    for k in 1..=SAVES {
        chip.command(&format!("SETTings:rate_gain_V_s_rad {}", k as f64 * 0.01));
        chip.command("SETTings:SAVE");
        chip.run_ms(700);
        assert_eq!(chip.fault(), "none", "after save {k}");
    }
    assert!(!chip.machine.soc.flash.erases.is_empty(), "no sector was erased");
    chip.machine.power_cycle();
    chip.run_ms(300);
    let gain = chip.number("SETTings:rate_gain_V_s_rad?");
    assert!((gain - SAVES as f64 * 0.01).abs() < 1e-6, "{gain}");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn saving_is_refused_while_the_platform_turns() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    let programmed = chip.machine.soc.flash.programmed;
    chip.say("SETTings:SAVE");
    let error = chip.ask("SYSTem:ERRor?");
    assert!(!error.starts_with("0,"), "{error}");
    chip.run_ms(500);
    assert_eq!(chip.machine.soc.flash.programmed, programmed, "flash was written");
    assert!((chip.rate_rad_s() - 5.0).abs() < 0.1);
    assert_eq!(chip.fault(), "none");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn saving_right_after_switching_off_waits_until_the_platform_stands() {
    let mut chip = Chip::booted();
    for _ in 0..2 {
        chip.command("SOURce:RATE 10;MODE RATE");
        chip.run_s(0.5);
        chip.say("OUTPut OFF;:SETTings:SAVE;:SYSTem:ERRor?");
        while chip.machine.soc.flash.programmed == 0 {
            chip.run_ms(1);
        }
        assert!(chip.rate_rad_s().abs() < 1.0, "written at {} rad/s", chip.rate_rad_s());
        assert_eq!(chip.machine.soc.board.command_V(), Some(0.0), "written while the bridge drove");
        chip.run_s(4.0);
        chip.machine.soc.flash.programmed = 0;
        let received = chip.take_received();
        assert!(received.ends_with(b"0,\"No error\"\r\n"), "{}", String::from_utf8_lossy(&received));
    }
}

/// Both sectors are full of other data, so that the save erases one: the core stands still for a quarter of a second.
#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn an_erase_holds_no_voltage_on_the_motor() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 30;MODE RATE");
    chip.run_s(0.3);
    while chip.machine.soc.board.command_V().is_some_and(|command_V| command_V < 2.0) && chip.machine.now() < 2 * PER_S {
        chip.run_ms(1);
    }
    chip.machine.soc.flash.bytes_mut()[0x4000..0xC000].fill(0);
    let asked = chip.machine.now();
    let before_V = chip.machine.soc.board.command_V().unwrap_or_default();
    chip.say("OUTPut OFF;:SETTings:SAVE");
    chip.run_ms(1);
    while chip.machine.soc.board.command_V() != Some(0.0) && chip.machine.now() < asked + 10 * PER_S {
        chip.run_ms(1);
    }
    let off = chip.machine.now();
    chip.run_s(5.0);
    let (_, erased) = *chip.machine.soc.flash.erases.first().expect("no sector was erased");
    println!("{before_V:.2} V; off {} ms, erase {} ms after the command", (off - asked) / PER_MS, (erased - asked) / PER_MS);
    assert!(erased >= off, "the erase began {} ms before the bridge braked, {before_V:.2} V", (off - erased) / PER_MS);
    assert_eq!(chip.fault(), "none");
}
