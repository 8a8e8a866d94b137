//! The flashed image drives the simulated platform: voltage, rate, emergency stop, stop contact, button.

#![allow(clippy::unwrap_used)]

use crate::common;
use chip_sim::board::{BUTTON, STOP_CONTACT};
use chip_sim::time::{PER_US, Time};
use common::Chip;

/// Time until the bridge brakes, in steps of 10 µs; `None`: not within 10 ms.
fn time_until_off(chip: &mut Chip) -> Option<Time> {
    let begun = chip.machine.now();
    while chip.machine.soc.board.command_V() != Some(0.0) {
        if chip.machine.now() > begun + 10_000 * PER_US {
            return None;
        }
        chip.run_until(chip.machine.now() + 10 * PER_US);
    }
    Some((chip.machine.now() - begun) / PER_US)
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn one_volt_turns_the_platform_by_the_motor_equations() {
    let mut chip = Chip::booted();
    chip.command("SOURce:VOLTage 1;MODE VOLTage");
    // Eight time constants J·R/K².
    chip.run_s(8.5);
    let command_V = chip.machine.soc.board.command_V().unwrap();
    assert!((command_V - 1.0).abs() < 1e-9, "{command_V} V");
    // Steady state of the default stand: V = R·i + K·ω, K·i = 0.9 mN m + 20 µN m s · ω.
    let (K, R) = (2.34e-2, 2.32);
    let rate_rad_s = (K - R * 9e-4) / (K * K + R * 2e-5);
    let held = chip.rate_rad_s();
    assert!((held / rate_rad_s - 1.0).abs() < 0.01, "{held} rad/s, expected {rate_rad_s}");
    let measured = chip.number("MEASure:RATE?");
    assert!((measured / held - 1.0).abs() < 0.005, "measured {measured}, true {held}");
    let current_A = chip.number("MEASure:CURRent?");
    assert!((current_A - (9e-4 + 2e-5 * held) / K).abs() < 5e-3, "{current_A} A");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn one_radian_per_second_is_held() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 1;MODE RATE");
    chip.run_s(3.0);
    let mut mean = 0.0;
    for _ in 0..200 {
        chip.run_ms(5);
        mean += chip.rate_rad_s() / 200.0;
    }
    assert!((mean - 1.0).abs() < 2e-4, "{mean} rad/s");
    assert_eq!(chip.fault(), "none");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn thirty_radians_per_second_with_eight_harmonics_are_held() {
    let mut chip = Chip::booted();
    for order in 1..=8 {
        chip.command(&format!("COMPensation:HARMonic {},2E-5,0.3", 3 * order));
    }
    chip.command("SOURce:RATE 20;MODE RATE");
    chip.run_s(2.0);
    chip.command("SOURce:RATE 30");
    chip.run_s(2.0);
    let rate = chip.rate_rad_s();
    assert!((rate - 30.0).abs() < 0.05, "{rate} rad/s; limits {}; fault {}", chip.ask("FAULt:LIMits?"), chip.fault());
    assert_eq!(chip.fault(), "none");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn control_x_switches_off_within_three_tenths_of_a_millisecond() {
    let mut chip = Chip::booted();
    chip.command("SOURce:VOLTage 2;MODE VOLTage");
    chip.run_s(0.5);
    chip.machine.send(b"\x18", common::BAUD);
    let off_us = time_until_off(&mut chip).expect("the bridge still drives");
    // 11 µs of these are the byte on the line.
    assert!(off_us <= 311, "{off_us} µs");
    // The console knows it with the next row.
    chip.run_ms(5);
    assert_eq!(chip.fault(), "emergency stop");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn open_stop_contact_switches_off_within_a_millisecond() {
    let mut chip = Chip::booted();
    chip.command("SOURce:VOLTage 2;MODE VOLTage");
    chip.run_s(0.5);
    chip.machine.soc.gpio.drive(STOP_CONTACT, true);
    let off_us = time_until_off(&mut chip).expect("the bridge still drives");
    // Debounced for 0.5 ms; the output of a tick acts from the next one on.
    assert!(off_us <= 800, "{off_us} µs");
    chip.run_ms(5);
    assert_eq!(chip.fault(), "emergency stop");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn button_stops_a_turning_platform() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    chip.machine.soc.gpio.drive(BUTTON, false);
    chip.run_ms(100);
    chip.machine.soc.gpio.drive(BUTTON, true);
    chip.run_s(1.0);
    assert_eq!(chip.fault(), "emergency stop");
    assert!(chip.rate_rad_s().abs() < 1e-3);
    // No press clears an emergency stop; the console does, and starts on the same line.
    for ms in [50, 200, 2500] {
        press(&mut chip, ms);
        assert_eq!(chip.ask("FAULt?;:OUTPut?").split(',').nth(1), Some("emergency stop"), "{ms} ms");
    }
    chip.command("*CLS;:PROFile:TYPE CONSTANT;AMPLitude 5;DURation 60");
    chip.command("FAULt:CLEar;:PROFile:STARt");
    assert_eq!(chip.ask("FAULt?;:OUTPut?"), "0,none,nothing is wrong;1");
}

/// Presses the button for `ms`.
fn press(chip: &mut Chip, ms: u64) {
    chip.machine.soc.gpio.drive(BUTTON, false);
    chip.run_ms(ms);
    chip.machine.soc.gpio.drive(BUTTON, true);
    chip.run_ms(200);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn button_clears_a_fault_with_one_press_and_starts_with_the_next() {
    let mut chip = Chip::booted();
    chip.command("PROFile:TYPE CONSTANT;AMPLitude 5;DURation 60;:SOURce:VOLTage 2;MODE VOLTage");
    chip.run_ms(100);
    let now = chip.machine.now();
    chip.machine.hang_until(now + 10_000 * PER_US);
    chip.run_ms(100);
    assert_eq!(chip.fault(), "clock");
    press(&mut chip, 200);
    assert_eq!(chip.ask("FAULt?;:OUTPut?"), "0,none,nothing is wrong;0", "cleared, not started");
    press(&mut chip, 200);
    assert_eq!(chip.ask("OUTPut?"), "1");
}
