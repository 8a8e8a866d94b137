//! Whatever can break is broken while the platform turns: the drive goes off, the first cause is latched and told with what to do, and the way
//! back is FAULt:CLEar when the cause is gone.
#![allow(clippy::unwrap_used)]

use hal_sim::faults::FaultKind;
use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::Stand;
use rayon::prelude::*;
use stand_firmware::status::Fault;
use stand_tests::bench::{Host, at_the_bench};

/// Turns at 10 rad/s.
async fn turn(host: &Host<'_, '_>) {
    host.tell("SOUR:RATE 10 RAD/S;:SOUR:MODE RATE").await;
    host.wait_s(1.5).await;
    let fault = host.ask("FAULt?").await;
    assert!((host.true_rate_rad_s() - 10.0).abs() < 0.3, "{} rad/s, {fault}", host.true_rate_rad_s());
}

/// The drive is off for this reason, stays so, and can be had again.
async fn is_latched(host: &Host<'_, '_>, fault: Fault, mend: impl FnOnce()) {
    let told = host.ask("FAULt?").await;
    assert_eq!(told, format!("{},{},{}", fault.code(), fault.name(), fault.advice()), "expected {}", fault.name());
    assert_eq!(host.ask("OUTP?").await, "0");
    let error = host.ask("SYST:ERR?").await;
    assert!(error.contains(fault.name()), "told without being asked: {error}");
    host.send(b"*CLS\n");
    assert!(host.refusal("SOUR:MODE RATE").await.starts_with("-221"), "{}: it is held off", fault.name());
    host.wait_s(1.0).await;
    mend();
    host.wait_s(1.0).await;
    assert_eq!(host.ask("FAULt?").await, told, "latched");
    host.wait_s(3.0).await;
    host.tell("FAULt:CLEar").await;
    host.wait_s(0.05).await;
    assert_eq!(host.number("FAULt?").await, 0.0, "cleared after {}", fault.name());
    turn(host).await;
}

#[test]
fn each_fault_that_is_injected_is_latched_by_its_name_and_can_be_cleared_when_mended() {
    let cases: [(FaultKind, f64, Option<f64>, Fault); 9] = [
        (FaultKind::EncoderAOff, f64::INFINITY, None, Fault::EncoderLost),
        (FaultKind::EncoderBOff, f64::INFINITY, None, Fault::EncoderLost),
        (FaultKind::CounterStuck, f64::INFINITY, None, Fault::EncoderLost),
        (FaultKind::CurrentSensorOff, f64::INFINITY, None, Fault::OverCurrent),
        (FaultKind::SupplyDip, f64::INFINITY, Some(6.0), Fault::SupplyLow),
        (FaultKind::SupplyDip, f64::INFINITY, Some(30.0), Fault::SupplyHigh),
        (FaultKind::WindingHot, f64::INFINITY, Some(104.0), Fault::Temperature),
        (FaultKind::LostTicks, 3e-4, None, Fault::Clock),
        (FaultKind::IndexOff, f64::INFINITY, None, Fault::IndexLost),
    ];
    cases.par_iter().for_each(|(what, for_s, size, fault)| {
        at_the_bench(&Stand::default(), async |host| {
            turn(host).await;
            host.break_(*what, *for_s, *size);
            host.wait_s(3.0).await;
            println!("{what:?}: {}", host.ask("FAULt?").await);
            let mend = || {
                host.mend(*what);
                if *what == FaultKind::WindingHot {
                    // This stand's winding knows no cooling of its own.
                    host.break_(*what, 0.01, Some(25.0));
                }
            };
            is_latched(host, *fault, mend).await;
        });
    });
}

#[test]
fn a_host_that_vanishes_while_armed_stops_the_drive_and_one_that_talks_does_not() {
    at_the_bench(&Stand::default(), async |host| {
        turn(host).await;
        host.tell("HOST:ARM 0.5 S").await;
        for _ in 0..10 {
            host.wait_s(0.3).await;
            assert_eq!(host.number("FAULt?").await, 0.0, "it talks");
        }
        host.wait_s(0.8).await;
        // A person who has no program watching says so.
        is_latched(host, Fault::HostSilent, || host.send(b"HOST:ARM 0\n")).await;
    });
}

#[test]
fn nobody_who_did_not_ask_for_it_is_watched() {
    at_the_bench(&Stand::default(), async |host| {
        turn(host).await;
        host.wait_s(20.0).await;
        assert_eq!(host.number("FAULt?").await, 0.0);
        assert!((host.true_rate_rad_s() - 10.0).abs() < 0.3);
    });
}

#[test]
fn too_much_voltage_is_overspeed_and_a_blocked_platform_a_stall() {
    at_the_bench(&Stand::default(), async |host| {
        host.tell("SOUR:VOLT 4 V;:SOUR:MODE VOLT").await;
        host.wait_s(5.0).await;
        is_latched(host, Fault::Overspeed, || ()).await;
    });
    let mut blocked = Stand::default();
    blocked.effects.insert("coulomb".to_owned(), [("coulomb_N_m".to_owned(), 0.1)].into());
    at_the_bench(&blocked, async |host| {
        host.tell("SOUR:RATE 5 RAD/S;:SOUR:MODE RATE").await;
        host.wait_s(5.0).await;
        let fault = host.ask("FAULt?").await;
        assert!(fault.contains("stall") || fault.contains("tracking"), "{fault}");
        assert_eq!(host.ask("OUTP?").await, "0");
    });
}

#[test]
fn a_power_cut_ends_the_drive_and_it_stays_off_when_the_supply_is_back() {
    at_the_bench(&Stand::default(), async |host| {
        turn(host).await;
        host.break_(FaultKind::PowerCut, 0.1, None);
        host.wait_s(6.0).await;
        host.heard();
        assert_eq!((host.ask("OUTP?").await.as_str(), host.power_cuts()), ("0", 1));
        assert!(host.true_rate_rad_s().abs() < 0.1);
        turn(host).await;
    });
}

/// A stand that carries the sensor under test.
fn with_sensor() -> Stand {
    Stand { imu: Some(ImuSetup::default()), ..Stand::default() }
}

#[test]
fn a_sensor_that_falls_silent_is_latched_and_its_chip_reported_and_both_come_back() {
    at_the_bench(&with_sensor(), async |host| {
        turn(host).await;
        assert!(host.ask("IMU?").await.contains("RUNNING"), "{}", host.ask("IMU?").await);
        host.break_(FaultKind::SensorSilent, f64::INFINITY, None);
        host.wait_s(1.0).await;
        let chip = host.ask("IMU?").await;
        assert!(chip.contains("FAILED"), "no register answers: {chip}");
        is_latched(host, Fault::SensorSilent, || host.mend(FaultKind::SensorSilent)).await;
        assert!(host.ask("IMU?").await.contains("RUNNING"), "found again and set up anew");
    });
}

#[test]
fn a_sensor_under_test_that_answers_rubbish_is_not_believed_and_counts_as_silent() {
    at_the_bench(&with_sensor(), async |host| {
        turn(host).await;
        host.break_(FaultKind::SensorRubbish, f64::INFINITY, None);
        host.wait_s(1.0).await;
        let chip = host.ask("IMU?").await;
        assert!(chip.contains("FAILED"), "with every second bit wrong nothing of it is believed: {chip}");
        is_latched(host, Fault::SensorSilent, || host.mend(FaultKind::SensorRubbish)).await;
        assert!(host.ask("IMU?").await.contains("RUNNING"), "found again: {}", host.ask("IMU?").await);
    });
}

#[test]
fn a_rate_sensor_that_answers_rubbish_moves_nothing_that_the_encoder_says() {
    at_the_bench(&Stand::default(), async |host| {
        turn(host).await;
        host.break_(FaultKind::SensorRubbish, f64::INFINITY, None);
        host.wait_s(2.0).await;
        assert!((host.number("MEAS:RATE?").await - 10.0).abs() < 0.2, "the rate is the encoder's");
        assert!((host.true_rate_rad_s() - 10.0).abs() < 0.2, "and is held");
    });
}

#[test]
fn a_rate_sensor_that_falls_silent_is_latched() {
    at_the_bench(&Stand::default(), async |host| {
        turn(host).await;
        host.break_(FaultKind::SensorSilent, f64::INFINITY, None);
        host.wait_s(1.0).await;
        is_latched(host, Fault::SensorSilent, || host.mend(FaultKind::SensorSilent)).await;
    });
}

#[test]
fn a_self_test_and_a_new_set_up_of_the_sensor_are_no_silence() {
    at_the_bench(&with_sensor(), async |host| {
        host.wait_s(1.0).await;
        host.tell("IMU:TEST:STARt").await;
        host.wait_s(2.5).await;
        assert!(host.ask("IMU:TEST?").await.starts_with("PASSED"), "{}", host.ask("IMU:TEST?").await);
        host.tell("IMU:DATarate 833").await;
        host.wait_s(2.5).await;
        assert!(host.ask("IMU?").await.contains("RUNNING"));
        assert_eq!(host.number("FAULt?").await, 0.0);
    });
}
