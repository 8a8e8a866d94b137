//! Faults injected into the board and the chip while the flashed image drives.
#![allow(clippy::unwrap_used)]

use crate::common;
use chip_sim::board::BoardFaults;
use chip_sim::peripherals::rcc::ResetCause;
use chip_sim::time::{PER_MS, of_seconds};
use common::Chip;
use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::Stand;

/// Runs until a fault is latched, at most `seconds`; its name.
fn fault_within(chip: &mut Chip, seconds: f64) -> String {
    let end = chip.machine.now() + of_seconds(seconds);
    loop {
        chip.run_ms(20);
        let fault = chip.fault();
        if fault != "none" || chip.machine.now() > end {
            return fault;
        }
    }
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn disconnected_encoder_switches_off() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 10;MODE RATE");
    chip.run_s(2.0);
    chip.machine.soc.board.set_faults(BoardFaults { encoder_off: true, ..BoardFaults::default() });
    assert_eq!(fault_within(&mut chip, 1.0), "encoder lost");
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn low_supply_switches_off() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    chip.machine.soc.board.plant_mut().set_supply(Some(5.0));
    assert_eq!(fault_within(&mut chip, 1.0), "supply low");
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn silent_sensor_switches_off() {
    let mut chip = Chip::booted_on(&Stand { imu: Some(ImuSetup::default()), ..Stand::default() });
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(2.0);
    let rate_rad_s = chip.number("MEASure:GYRO?");
    assert!((rate_rad_s / 5.0 - 1.0).abs() < 0.05, "{rate_rad_s} rad/s");
    chip.machine.soc.board.set_faults(BoardFaults { sensor_silent: true, ..BoardFaults::default() });
    assert_eq!(fault_within(&mut chip, 1.0), "sensor silent");
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn silent_host_switches_off_when_it_is_watched() {
    let mut chip = Chip::booted();
    chip.command("HOST:UNATTended 0;ARM 0.5;:SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
    assert_eq!(chip.fault(), "host silent");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn image_starts_on_the_internal_oscillator_and_says_so() {
    let mut chip = Chip::on(&Stand::default());
    chip.machine.soc.stop_external_clock();
    chip.run_ms(300);
    let log = chip.log();
    assert!(log.iter().any(|line| line.contains("internal oscillator")), "{log:?}");
    assert!(chip.ask("*IDN?").starts_with("Rotary Stand"));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn hung_core_is_reset_and_the_motor_coasts() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 10;MODE RATE");
    chip.run_s(2.0);
    let begun = chip.machine.now();
    // The last tick began at most 0.1 ms ago.
    chip.machine.hang_until(begun + 5 * PER_MS);
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0), "the bridge brakes 5 ms after the last tick, without the core");
    chip.machine.hang_until(begun + of_seconds(5.0));
    let (at, cause) = *chip.machine.resets.last().expect("a reset");
    assert_eq!(cause, ResetCause::IndependentWatchdog);
    // The watchdog's time at its nominal 32 kHz.
    assert!(at - begun <= 2_010 * PER_MS, "{} ms", (at - begun) / PER_MS);
    assert_eq!(chip.machine.soc.board.command_V(), None, "the inputs of the bridge float after the reset");
    chip.run_ms(500);
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0), "the restarted program brakes");
    assert_eq!(chip.ask("FAULt?;:SYSTem:RESet:CAUSe?"), "0,none,nothing is wrong;watchdog");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn core_that_hangs_for_ten_milliseconds_is_a_clock_fault() {
    let mut chip = Chip::booted();
    chip.command("SOURce:VOLTage 1;MODE VOLTage");
    chip.run_s(0.5);
    let begun = chip.machine.now();
    chip.machine.hang_until(begun + 3 * PER_MS);
    assert!(chip.machine.soc.board.command_V().is_some_and(|volts| (volts - 1.0).abs() < 0.01), "driven so far");
    chip.machine.hang_until(begun + 10 * PER_MS);
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
    chip.run_ms(20);
    assert_eq!(chip.fault(), "clock");
    chip.command("*CLS;:FAULt:CLEar;:SOURce:VOLTage 1;MODE VOLTage");
    chip.run_s(0.5);
    let (volts, state) = (chip.machine.soc.board.command_V(), chip.ask("FAULt?;:OUTPut?;:SOURce:MODE?;VOLTage?"));
    assert!(volts.is_some_and(|volts| (volts - 1.0).abs() < 0.01), "driven again: {volts:?}, {state}");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn stuck_converter_switches_off() {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    chip.machine.soc.adc.is_stuck = true;
    chip.run_ms(1);
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
    chip.run_ms(5);
    assert_eq!(chip.fault(), "readings stale");
}

/// A failure that the chip notices by itself: the bridge is off within 0.1 ms, the chip starts anew, and the console names the cause.
fn failure_resets(fail: impl FnOnce(&mut Chip), cause: &str) {
    let mut chip = Chip::booted();
    chip.command("SOURce:RATE 5;MODE RATE");
    chip.run_s(1.0);
    fail(&mut chip);
    chip.run_until(chip.machine.now() + PER_MS / 10);
    // After the reset the pins float and the motor coasts.
    assert!(matches!(chip.machine.soc.board.command_V(), None | Some(0.0)));
    assert_eq!(chip.machine.resets.last().map(|(_, cause)| *cause), Some(ResetCause::Software));
    chip.run_ms(300);
    assert_eq!(chip.ask("SYSTem:RESet:CAUSe?;:OUTPut?"), format!("{cause};0"));
    assert_eq!(chip.machine.soc.board.command_V(), Some(0.0));
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn lost_external_clock_resets_onto_the_internal_one() {
    failure_resets(|chip| chip.machine.soc.stop_external_clock(), "clock failure");
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn falling_supply_of_the_chip_switches_off_and_resets() {
    failure_resets(
        |chip| {
            chip.machine.soc.set_voltage_low(true);
            chip.run_until(chip.machine.now() + PER_MS / 100);
            chip.machine.soc.set_voltage_low(false);
        },
        "supply dip",
    );
}
