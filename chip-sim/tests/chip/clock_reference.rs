//! The flashed image compares its crystal with a reference of one pulse per second on PB10.

use crate::common;
use common::Chip;
use hal_sim::peripherals::{ClockSetup, ReferenceSetup};
use hal_sim::plant::Stand;

fn chip(clock: ClockSetup) -> Chip {
    Chip::booted_on(&Stand { clock, ..Stand::default() })
}

fn numbers(reply: &str) -> Vec<f64> {
    reply.split(',').map(|word| word.parse().unwrap_or_else(|_| panic!("{reply}"))).collect()
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn crystal_is_compared_with_the_reference() {
    let reference = Some(ReferenceSetup::default());
    for crystal_ppm in [40.0, -25.0] {
        let mut chip = chip(ClockSetup { crystal_ppm, reference });
        chip.run_s(5.2);
        let [pulses, rejected, seconds, steps, deviation_Hz] = numbers(&chip.ask("MEASure:CLOCk?"))[..] else { panic!("five numbers") };
        let timer_Hz = chip.number("SETTings:edge_timer_Hz?");
        assert!((5.0..=6.0).contains(&pulses) && rejected == 0.0 && seconds == pulses - 1.0, "{pulses} {rejected} {seconds}");
        assert_eq!(timer_Hz, 90e6);
        let found_ppm = 1e6 * (steps / (seconds * timer_Hz) - 1.0);
        // 20 ns rms and 11 ns of resolution at each end of four seconds or more.
        assert!((found_ppm - crystal_ppm).abs() < 0.03, "{found_ppm} ppm, true {crystal_ppm}");
        assert!((0.0..10.0).contains(&deviation_Hz), "{deviation_Hz}");
        chip.command("MEASure:CLOCk:RESet");
        assert_eq!(numbers(&chip.ask("MEASure:CLOCk?"))[..4], [0.0; 4]);
    }
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn without_a_reference_no_pulse_is_counted() {
    let mut chip = chip(ClockSetup::default());
    chip.run_s(1.5);
    assert_eq!(numbers(&chip.ask("MEASure:CLOCk?"))[..4], [0.0; 4]);
}
