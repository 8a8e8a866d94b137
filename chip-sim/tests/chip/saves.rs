//! Settings in the flash: saving stalls the chip for a quarter of a second now and then; nothing may follow from it.

use crate::common;
use chip_sim::time::{PER_MS, PER_S, PER_US};
use common::{Chip, Rows};
use stand_firmware::board::TICKS_PER_S;

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

/// Makes both sectors of the settings full of other data, so that the next save erases: the core stands still for 250 ms per sector.
fn fill_settings(chip: &mut Chip) {
    chip.machine.soc.flash.bytes_mut()[0x4000..0xC000].fill(0);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn an_erase_holds_no_voltage_on_the_motor() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 30;MODE RATE");
    chip.run_s(0.3);
    while chip.machine.soc.board.command_V().is_some_and(|command_V| command_V < 2.0) && chip.machine.now() < 2 * PER_S {
        chip.run_ms(1);
    }
    fill_settings(&mut chip);
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

/// Ticks between the newest row and the present, least of 300 instants: the delay of the line, if the chip's time is right.
fn ticks_behind(chip: &mut Chip, rows: &mut Rows) -> i64 {
    let mut least = i64::MAX;
    for _ in 0..300 {
        chip.run_until(chip.machine.now() + 50 * PER_US);
        rows.take(&chip.take_received(), |_| {});
        if let Some(row) = &rows.last {
            least = least.min(chip.machine.soc.updates as i64 - (row.at / (TICKS_PER_S / 10_000)) as i64);
        }
    }
    least
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn the_chip_keeps_its_time_through_erases() {
    let mut chip = Chip::booted();
    let mut rows = Rows::default();
    chip.command("STReam:CHANnels i_A");
    chip.say("STReam ON");
    chip.run_ms(100);
    let before = ticks_behind(&mut chip, &mut rows);
    for save in 0..8 {
        fill_settings(&mut chip);
        // The length of the line moves the end of the stall within the tick.
        chip.say(&format!("{}SETTings:SAVE", " ".repeat(17 * save)));
        chip.run_s(1.0);
    }
    rows.take(&chip.take_received(), |_| {});
    let after = ticks_behind(&mut chip, &mut rows);
    println!("{} erases: {before} ticks behind, {after} after", chip.machine.soc.flash.erases.len());
    assert!(chip.machine.soc.flash.erases.len() >= 8);
    assert!((after - before).abs() <= 1, "{} ticks", after - before);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn an_erase_at_rest_latches_no_fault() {
    let mut chip = Chip::booted();
    fill_settings(&mut chip);
    chip.say("SETTings:SAVE");
    chip.run_s(1.0);
    assert!(!chip.machine.soc.flash.erases.is_empty(), "no sector was erased");
    // An image that reports lost bytes after the erase drops this empty line, and its fault can be read.
    chip.say("");
    chip.run_ms(100);
    assert_eq!(chip.fault(), "none");
}
