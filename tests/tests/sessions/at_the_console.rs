//! Positioning from the console, and recordings around an event.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_tests::bench::{Host, with_stand};

/// Twice the angle error at which the drive's stiffness (0.4 N m/rad) balances the default stand's Coulomb friction (1 mN m).
const POSITION_TOLERANCE_RAD: f64 = 5e-3;

/// Turns once past the index, stops, and counts angles from the index.
async fn find_the_index(host: &Host<'_, '_>) {
    host.command("SOUR:RATE 6 RAD/S;:SOUR:MODE RATE").await;
    host.wait_s(3.0).await;
    host.command("OUTP OFF").await;
    host.wait_s(2.0).await;
    host.command("SOUR:POS:ZERO INDEX").await;
}

/// Distance of the true angle from `asked_rad`, modulo whole turns, rad.
fn off_rad(host: &Host<'_, '_>, asked_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let off = host.true_angle_rad() - asked_rad;
    off - turn * (off / turn).round()
}

#[test]
fn angle_from_the_index_is_reached_and_held_from_both_sides() {
    with_stand(&Stand::default(), async |host| {
        find_the_index(host).await;
        for degrees in [90.0, 30.0, -45.0, 180.0] {
            host.command(&format!("SOUR:POS {degrees} DEG;:SOUR:MODE POS")).await;
            host.wait_s(3.0).await;
            let off = off_rad(host, f64::to_radians(degrees));
            assert!(off.abs() < POSITION_TOLERANCE_RAD, "{degrees}°: off by {off} rad");
            assert!(host.true_rate_rad_s().abs() < 0.02, "{degrees}°: the platform is at rest, {} rad/s", host.true_rate_rad_s());
            let reported = host.number("SOUR:POS?").await;
            assert!((reported - f64::to_radians(degrees)).abs() < 1e-6, "{reported}");
            assert_eq!(host.number("FAULt?").await, 0.0);
        }
    });
}

#[test]
fn position_command_counts_whole_turns() {
    with_stand(&Stand::default(), async |host| {
        host.command("SOUR:POS 0;:SOUR:MODE POS").await;
        host.wait_s(2.0).await;
        let from = host.true_angle_rad();
        host.command("SOUR:POS 1440 DEG").await;
        host.wait_s(10.0).await;
        let turned_rad = host.true_angle_rad() - from;
        assert!((turned_rad - 8.0 * std::f64::consts::PI).abs() < 2.0 * POSITION_TOLERANCE_RAD, "{turned_rad}");
    });
}

#[test]
fn zero_change_is_refused_while_an_angle_is_held_and_without_an_index() {
    with_stand(&Stand::default(), async |host| {
        assert!(host.refusal("SOUR:POS:ZERO INDEX").await.contains("turn the platform first"));
        find_the_index(host).await;
        host.command("SOUR:POS 1;:SOUR:MODE POS").await;
        assert!(host.refusal("SOUR:POS:ZERO POW").await.contains("an angle is held"));
    });
}

/// A line of the recording: s from the trigger, encoder counts, V, A, rad/s, command in rad/s.
fn samples(lines: &[String]) -> Vec<[f64; 6]> {
    lines.iter().map(|line| line.split(',').map(|n| n.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap()).collect()
}

#[test]
fn fault_records_every_tick_around_it_readable_in_pieces() {
    with_stand(&Stand::default(), async |host| {
        assert_eq!(host.query("FAULt:CAPTure?").await, "EMPTY");
        assert!(host.refusal("FAULt:CAPTure:DATA?").await.contains("there is no recording"));
        host.command("SOUR:RATE 10 RAD/S;:SOUR:MODE RATE").await;
        host.wait_s(1.5).await;
        host.send(b"STOP\n");
        host.wait_s(1.0).await;
        let status = host.query("FAULt:CAPTure?").await;
        let words: Vec<&str> = status.split(',').collect();
        assert_eq!((words.len(), words[2]), (4, "emergency stop"), "{status}");
        let (count, trigger): (usize, usize) = (words[0].parse().unwrap(), words[1].parse().unwrap());
        assert!(count > 1000 && trigger > 100 && trigger + 100 < count, "{status}");
        let all = samples(&host.list("FAULt:CAPTure:DATA?").await);
        assert_eq!(all.len(), count);
        assert!(all.windows(2).all(|w| (w[1][0] - w[0][0] - 1e-4).abs() < 1e-9), "a row per tick");
        assert_eq!(all[trigger][0], 0.0);
        // Before the fault: 10 rad/s with its voltage. After: zero voltage and a falling rate.
        let mean = |of: &[[f64; 6]], k: usize| of.iter().map(|s| s[k]).sum::<f64>() / of.len() as f64;
        assert!((mean(&all[..trigger], 4) - 10.0).abs() < 0.1 && mean(&all[..trigger], 2) > 0.2);
        let after = &all[trigger + 5..];
        assert!(after.iter().all(|s| s[2] == 0.0), "the drive is off");
        assert!(after[after.len() - 1][4] < all[trigger][4]);
        let piece = samples(&host.list(&format!("FAULt:CAPTure:DATA? {},3", trigger - 1)).await);
        assert_eq!(piece, all[trigger - 1..trigger + 2]);
        // Armed again, it waits for the next event.
        host.send(b"*CLS\n");
        host.command("FAULt:CLEar").await;
        host.command("FAULt:CAPTure:ARM 500").await;
        assert_eq!(host.query("FAULt:CAPTure?").await, "EMPTY");
        host.wait_s(0.5).await;
        host.command("FAULt:CAPTure:TRIGger").await;
        host.wait_s(0.5).await;
        assert!(
            host.query("FAULt:CAPTure?").await.contains(",500,"),
            "500 samples before the trigger: {}",
            host.query("FAULt:CAPTure?").await
        );
    });
}
