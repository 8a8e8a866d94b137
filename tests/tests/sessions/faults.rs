//! Every injected fault during rotation switches the drive off. The first cause is latched and reported with advice. FAULt:CLEar restores
//! operation after the cause is gone.
#![allow(clippy::unwrap_used)]

use hal_sim::faults::FaultKind;
use hal_sim::peripherals::imu::ImuSetup;
use hal_sim::plant::Stand;
use rayon::prelude::*;
use stand_firmware::status::Fault;
use stand_tests::bench::{Host, with_stand};

/// Turns at 10 rad/s.
async fn turn(host: &Host<'_, '_>) {
    host.command("SOUR:RATE 10 RAD/S;:SOUR:MODE RATE").await;
    host.wait_s(1.5).await;
    let fault = host.query("FAULt?").await;
    assert!((host.true_rate_rad_s() - 10.0).abs() < 0.3, "{} rad/s, {fault}", host.true_rate_rad_s());
}

/// Asserts that this fault is latched, blocks the drive, and can be cleared.
async fn is_latched(host: &Host<'_, '_>, fault: Fault, repair: impl FnOnce()) {
    let report = host.query("FAULt?").await;
    assert_eq!(report, format!("{},{},{}", fault.code(), fault.name(), fault.advice()), "expected {}", fault.name());
    assert_eq!(host.query("OUTP?").await, "0");
    let error = host.query("SYST:ERR?").await;
    assert!(error.contains(fault.name()), "reported in the error queue: {error}");
    host.send(b"*CLS\n");
    assert!(host.refusal("SOUR:MODE RATE").await.starts_with("-221"), "{}: the drive stays off", fault.name());
    host.wait_s(1.0).await;
    repair();
    host.wait_s(1.0).await;
    assert_eq!(host.query("FAULt?").await, report, "latched");
    host.wait_s(3.0).await;
    host.command("FAULt:CLEar").await;
    host.wait_s(0.05).await;
    assert_eq!(host.number("FAULt?").await, 0.0, "cleared after {}", fault.name());
    turn(host).await;
}

#[test]
fn every_injected_fault_is_latched_and_can_be_cleared() {
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
        with_stand(&Stand::default(), async |host| {
            turn(host).await;
            host.inject_fault(*what, *for_s, *size);
            host.wait_s(3.0).await;
            println!("{what:?}: {}", host.query("FAULt?").await);
            let repair = || {
                host.clear_fault(*what);
                if *what == FaultKind::WindingHot {
                    // This stand's winding model has no cooling.
                    host.inject_fault(*what, 0.01, Some(25.0));
                }
            };
            is_latched(host, *fault, repair).await;
        });
    });
}

#[test]
fn silent_host_stops_an_armed_drive_and_an_active_host_does_not() {
    with_stand(&Stand::default(), async |host| {
        turn(host).await;
        host.command("HOST:UNATTended 0;ARM 0.5 S").await;
        for _ in 0..10 {
            host.wait_s(0.3).await;
            host.command("HOST:ALIVe").await;
            assert_eq!(host.number("FAULt?").await, 0.0, "the host is active");
        }
        host.wait_s(0.8).await;
        // Ends the supervision: no program is watching.
        is_latched(host, Fault::HostSilent, || host.send(b"HOST:ARM 0;UNATTended 1E6\n")).await;
    });
}

#[test]
fn drive_of_a_vanished_host_stops_after_two_seconds_and_a_client_that_only_measures_does_not_keep_it_on() {
    with_stand(&Stand::default(), async |host| {
        host.command("HOST:UNATTended 0").await;
        turn(host).await;
        host.command("HOST:ALIVe").await;
        host.wait_s(1.8).await;
        assert!((host.true_rate_rad_s() - 10.0).abs() < 0.3);
        for query in ["*CLS;*IDN?", "MEASure:RATE?", "*OPC?", "FAULt?"] {
            host.query(query).await;
            host.wait_s(0.1).await;
        }
        assert!(host.true_rate_rad_s().abs() < 9.0, "{} rad/s", host.true_rate_rad_s());
        is_latched(host, Fault::HostSilent, || host.send(b"HOST:UNATTended 1E6\n")).await;
    });
}

#[test]
fn unattended_drive_runs_for_the_stated_time() {
    with_stand(&Stand::default(), async |host| {
        host.command("HOST:UNATTended 5").await;
        turn(host).await;
        host.wait_s(4.0).await;
        assert!((host.true_rate_rad_s() - 10.0).abs() < 0.3);
        assert_eq!(host.number("FAULt?").await, 0.0);
        host.wait_s(4.0).await;
        is_latched(host, Fault::HostSilent, || host.send(b"HOST:UNATTended 1E6\n")).await;
    });
}

#[test]
fn excess_voltage_is_overspeed_and_a_blocked_platform_a_stall() {
    with_stand(&Stand::default(), async |host| {
        host.command("SOUR:VOLT 4 V;:SOUR:MODE VOLT").await;
        host.wait_s(5.0).await;
        is_latched(host, Fault::Overspeed, || ()).await;
    });
    let mut blocked = Stand::default();
    blocked.effects.insert("coulomb".to_owned(), [("coulomb_N_m".to_owned(), 0.1)].into());
    with_stand(&blocked, async |host| {
        host.command("SOUR:RATE 5 RAD/S;:SOUR:MODE RATE").await;
        host.wait_s(5.0).await;
        let fault = host.query("FAULt?").await;
        assert!(fault.contains("stall") || fault.contains("tracking"), "{fault}");
        assert_eq!(host.query("OUTP?").await, "0");
    });
}

#[test]
fn power_cut_stops_the_drive_and_it_stays_off() {
    with_stand(&Stand::default(), async |host| {
        turn(host).await;
        host.inject_fault(FaultKind::PowerCut, 0.1, None);
        host.wait_s(6.0).await;
        host.received();
        assert_eq!((host.query("OUTP?").await.as_str(), host.power_cuts()), ("0", 1));
        assert!(host.true_rate_rad_s().abs() < 0.1);
        turn(host).await;
    });
}

/// A stand with the sensor under test.
fn with_sensor() -> Stand {
    Stand { imu: Some(ImuSetup::default()), ..Stand::default() }
}

#[test]
fn silent_sensor_is_latched_and_recovers_with_its_chip() {
    with_stand(&with_sensor(), async |host| {
        turn(host).await;
        assert!(host.query("IMU?").await.contains("RUNNING"), "{}", host.query("IMU?").await);
        host.inject_fault(FaultKind::SensorSilent, f64::INFINITY, None);
        host.wait_s(1.0).await;
        let chip = host.query("IMU?").await;
        assert!(chip.contains("FAILED"), "no register answers: {chip}");
        is_latched(host, Fault::SensorSilent, || host.clear_fault(FaultKind::SensorSilent)).await;
        assert!(host.query("IMU?").await.contains("RUNNING"), "detected and configured again");
    });
}

#[test]
fn invalid_replies_of_the_dut_count_as_silence() {
    with_stand(&with_sensor(), async |host| {
        turn(host).await;
        host.inject_fault(FaultKind::SensorRubbish, f64::INFINITY, None);
        host.wait_s(1.0).await;
        let chip = host.query("IMU?").await;
        assert!(chip.contains("FAILED"), "with every second bit wrong, no reply is accepted: {chip}");
        is_latched(host, Fault::SensorSilent, || host.clear_fault(FaultKind::SensorRubbish)).await;
        assert!(host.query("IMU?").await.contains("RUNNING"), "detected again: {}", host.query("IMU?").await);
    });
}

#[test]
fn invalid_replies_of_the_rate_sensor_do_not_change_the_encoders_rate() {
    with_stand(&Stand::default(), async |host| {
        turn(host).await;
        host.inject_fault(FaultKind::SensorRubbish, f64::INFINITY, None);
        host.wait_s(2.0).await;
        assert!((host.number("MEAS:RATE?").await - 10.0).abs() < 0.2, "the rate is the encoder's");
        assert!((host.true_rate_rad_s() - 10.0).abs() < 0.2, "the rate is controlled");
    });
}

#[test]
fn silent_rate_sensor_is_latched() {
    with_stand(&Stand::default(), async |host| {
        turn(host).await;
        host.inject_fault(FaultKind::SensorSilent, f64::INFINITY, None);
        host.wait_s(1.0).await;
        is_latched(host, Fault::SensorSilent, || host.clear_fault(FaultKind::SensorSilent)).await;
    });
}

#[test]
fn self_test_and_reconfiguration_of_the_sensor_are_not_silence() {
    with_stand(&with_sensor(), async |host| {
        host.wait_s(1.0).await;
        host.command("IMU:TEST:STARt").await;
        host.wait_s(2.5).await;
        assert!(host.query("IMU:TEST?").await.starts_with("PASSED"), "{}", host.query("IMU:TEST?").await);
        host.command("IMU:DATarate 833").await;
        host.wait_s(2.5).await;
        assert!(host.query("IMU?").await.contains("RUNNING"));
        assert_eq!(host.number("FAULt?").await, 0.0);
    });
}
