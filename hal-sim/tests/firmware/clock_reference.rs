//! The crystal's frequency error on the simulated stand, and its comparison with a clock reference.
#![allow(clippy::unwrap_used)]

use crate::common::host;
use hal_sim::board::linear_motor::LinearMotor;
use hal_sim::clock::VirtualClock;
use hal_sim::controller::{Controller, flash};
use hal_sim::faults::{Fault, FaultKind, Faults};
use hal_sim::peripherals::{ClockSetup, ReferenceSetup};
use hal_sim::plant::{Plant, Stand, StandError};
use hal_sim::session::{SessionRequest, run};
use hal_sim::setup::StandSetup;
use stand_firmware::board::Hardware;
use stand_firmware::profile::ProfileKind;
use stand_firmware::speed_loop::Mode;

use host::Host;

/// The reply to the query `seconds` after a restart of the comparison, on a stand with this crystal, reference and faults.
fn compared(crystal_ppm: f64, reference: Option<ReferenceSetup>, faults: &[Fault], seconds: f64) -> [f64; 5] {
    let faults = Faults::of(faults.iter().copied()).unwrap();
    let stand = StandSetup { clock: ClockSetup { crystal_ppm, reference }, faults, ..StandSetup::default() };
    let clock = VirtualClock::default();
    let controller = Controller::new(&clock, &stand, LinearMotor::default(), flash(1), 1).unwrap();
    let host = Host { controller: &controller };
    let reply = controller.run(
        async {
            host.command("MEASure:CLOCk:RESet").await;
            host.wait_s(seconds).await;
            host.query("MEASure:CLOCk?").await
        },
        |_| (),
    );
    let reply = reply.unwrap();
    let numbers: Vec<f64> = reply.split(',').map(|word| word.parse().unwrap_or_else(|_| panic!("{reply}"))).collect();
    numbers.try_into().unwrap_or_else(|_| panic!("{reply}"))
}

fn error_ppm([_, _, seconds, steps, _]: [f64; 5]) -> f64 {
    1e6 * (steps / (seconds * Hardware::default().edge_timer_Hz) - 1.0)
}

/// 20 ns rms and 11 ns of resolution at each end.
fn tolerance_ppm([_, _, seconds, ..]: [f64; 5]) -> f64 {
    3.0 * 1e6 * 2_f64.sqrt() * 21e-9 / seconds
}

#[test]
fn the_reply_is_the_crystals_error() {
    for crystal_ppm in [40.0, 0.0, -120.0] {
        let reply = compared(crystal_ppm, Some(ReferenceSetup::default()), &[], 20.0);
        let [pulses, rejected, seconds, _, deviation_Hz] = reply;
        assert!((19.0..=20.0).contains(&pulses) && rejected == 0.0 && seconds == pulses - 1.0, "{reply:?}");
        assert!((error_ppm(reply) - crystal_ppm).abs() < tolerance_ppm(reply), "{} ppm, true {crystal_ppm}", error_ppm(reply));
        // √2 × 20 ns × 90 MHz, with the steps of the timer.
        assert!((1.0..5.0).contains(&deviation_Hz), "{deviation_Hz}");
    }
}

#[test]
fn the_references_own_error_and_jitter_show() {
    let slow = compared(40.0, Some(ReferenceSetup { error_ppm: -5.0, ..ReferenceSetup::default() }), &[], 20.0);
    assert!((error_ppm(slow) - 45.0).abs() < 0.02, "{}", error_ppm(slow));
    let [.., deviation_Hz] = compared(40.0, Some(ReferenceSetup { jitter_s: 1e-7, ..ReferenceSetup::default() }), &[], 30.0);
    assert!((deviation_Hz / (2_f64.sqrt() * 1e-7 * 90e6) - 1.0).abs() < 0.5, "{deviation_Hz}");
}

#[test]
fn missing_pulses_and_interference_do_not_change_the_frequency() {
    let reference = Some(ReferenceSetup::default());
    let off = compared(40.0, reference, &[Fault::new(FaultKind::ReferenceOff, 5.0, 4.0)], 20.0);
    let [pulses, rejected, seconds, ..] = off;
    assert!(pulses == seconds - 3.0 && rejected == 0.0, "four pulses are missing: {off:?}");
    assert!((error_ppm(off) - 40.0).abs() < tolerance_ppm(off), "{off:?}");
    let glitches = [3.111, 7.222, 7.333, 12.444].map(|at_s| Fault::new(FaultKind::ReferenceInterference, at_s, 1e-4));
    let disturbed = compared(40.0, reference, &glitches, 20.0);
    let [pulses, rejected, seconds, ..] = disturbed;
    assert!(pulses == seconds + 1.0 && rejected == 4.0, "{disturbed:?}");
    assert!((error_ppm(disturbed) - 40.0).abs() < tolerance_ppm(disturbed), "{disturbed:?}");
}

#[test]
fn a_crystal_beyond_200_ppm_and_an_absent_reference_give_no_frequency() {
    let far = compared(300.0, Some(ReferenceSetup::default()), &[], 10.0);
    assert!(far[0] == 1.0 && far[1] >= 8.0 && far[2] == 0.0, "{far:?}");
    assert_eq!(compared(40.0, None, &[], 5.0)[..4], [0.0; 4]);
}

/// The plant has true time: by a fast crystal a rate of 7 rad/s is higher, a turn shorter than what the stand shows.
#[test]
fn rates_and_times_of_the_stand_are_wrong_by_the_crystals_error() {
    let rate_rad_s = 7.0;
    let true_rate = |crystal_ppm: f64| {
        let stand = Stand { clock: ClockSetup { crystal_ppm, reference: None }, ..Stand::default() };
        let mut request = SessionRequest::new(Mode::Rate, ProfileKind::Constant, 11.0, 1);
        request.profile.amplitude = rate_rad_s;
        let record = run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap();
        let rows = (10.0 * std::f64::consts::TAU / rate_rad_s * 1e3).round() as usize;
        let theta = &record.true_theta_rad;
        // A row is a millisecond of the crystal.
        let seconds = rows as f64 * 1e-3 / (1.0 + crystal_ppm * 1e-6);
        let turn_s = *record.column("turn_s").unwrap().last().unwrap();
        ((theta[1000 + rows] - theta[1000]) / seconds / rate_rad_s, turn_s)
    };
    let (ideal, _) = true_rate(0.0);
    // Larger than a real one, so that the encoder's steps do not hide it.
    let (fast, turn_s) = true_rate(2000.0);
    assert!((ideal - 1.0).abs() < 1e-5 && (fast - 1.002).abs() < 2e-5, "{ideal} {fast}");
    assert!((turn_s * rate_rad_s / std::f64::consts::TAU - 1.0).abs() < 2e-4, "the stand sees the rate that was commanded: {turn_s} s");
}

#[test]
fn a_stand_file_has_crystal_and_reference_and_is_checked() {
    let stand = Stand::parse("[clock]\ncrystal_ppm = 40.0\nreference = { jitter_s = 1e-7 }\n").unwrap();
    assert_eq!(stand.clock, ClockSetup { crystal_ppm: 40.0, reference: Some(ReferenceSetup { jitter_s: 1e-7, error_ppm: 0.0 }) });
    for (text, key) in [("crystal_ppm = 2e4", "clock.crystal_ppm"), ("reference = { jitter_s = -1.0 }", "clock.reference.jitter_s")] {
        match Stand::parse(&format!("[clock]\n{text}\n")) {
            Err(StandError::OutOfRange { key: found, .. }) => assert_eq!(found, key),
            other => panic!("{other:?}"),
        }
    }
    assert!(matches!(Stand::parse("[clock]\ncrystal = 1.0\n"), Err(StandError::Toml(_))));
}

#[test]
fn a_reference_does_not_change_the_motion() {
    let theta = |reference| {
        let stand = Stand { clock: ClockSetup { crystal_ppm: 0.0, reference }, ..Stand::default() };
        let request = SessionRequest::new(Mode::Rate, ProfileKind::MultiStep, 2.0, 1);
        run(stand.setup(), Plant::new(&stand, 0.0).unwrap(), request).unwrap()
    };
    assert_eq!(theta(None), theta(Some(ReferenceSetup::default())));
}
