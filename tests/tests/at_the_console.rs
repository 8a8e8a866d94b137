//! What a person at the console does beside turning: goes to an angle and holds it, records what happened around a moment.
#![allow(clippy::unwrap_used)]

use hal_sim::plant::Stand;
use stand_tests::bench::{Host, at_the_bench};

/// Largest angle error where the drive's stiffness (0.4 N m/rad) holds the dry friction of the default stand (1 mN m), twice over.
const HELD_RAD: f64 = 5e-3;

/// Turns once past the index, stops, and counts angles from the index.
async fn find_the_index(host: &Host<'_, '_>) {
    host.tell("SOUR:RATE 6 RAD/S;:SOUR:MODE RATE").await;
    host.wait_s(3.0).await;
    host.tell("OUTP OFF").await;
    host.wait_s(2.0).await;
    host.tell("SOUR:POS:ZERO INDEX").await;
}

/// The true angle is so far from `asked_rad`, by whole turns apart, rad.
fn off_rad(host: &Host<'_, '_>, asked_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let off = host.true_angle_rad() - asked_rad;
    off - turn * (off / turn).round()
}

#[test]
fn an_angle_from_the_index_is_gone_to_and_held_from_either_side() {
    at_the_bench(&Stand::default(), async |host| {
        find_the_index(host).await;
        for degrees in [90.0, 30.0, -45.0, 180.0] {
            host.tell(&format!("SOUR:POS {degrees} DEG;:SOUR:MODE POS")).await;
            host.wait_s(3.0).await;
            let off = off_rad(host, f64::to_radians(degrees));
            assert!(off.abs() < HELD_RAD, "{degrees}°: off by {off} rad");
            assert!(host.true_rate_rad_s().abs() < 0.02, "{degrees}°: it stands, {} rad/s", host.true_rate_rad_s());
            let said = host.number("SOUR:POS?").await;
            assert!((said - f64::to_radians(degrees)).abs() < 1e-6, "{said}");
            assert_eq!(host.number("FAULt?").await, 0.0);
        }
    });
}

#[test]
fn several_turns_are_several_turns() {
    at_the_bench(&Stand::default(), async |host| {
        host.tell("SOUR:POS 0;:SOUR:MODE POS").await;
        host.wait_s(2.0).await;
        let from = host.true_angle_rad();
        host.tell("SOUR:POS 1440 DEG").await;
        host.wait_s(10.0).await;
        let went = host.true_angle_rad() - from;
        assert!((went - 8.0 * std::f64::consts::PI).abs() < 2.0 * HELD_RAD, "{went}");
    });
}

#[test]
fn the_zero_cannot_move_under_a_held_angle_and_no_index_is_no_zero() {
    at_the_bench(&Stand::default(), async |host| {
        assert!(host.refusal("SOUR:POS:ZERO INDEX").await.contains("turn the platform first"));
        find_the_index(host).await;
        host.tell("SOUR:POS 1;:SOUR:MODE POS").await;
        assert!(host.refusal("SOUR:POS:ZERO POW").await.contains("an angle is held"));
    });
}

/// A line of the record: s from the trigger, encoder counts, V, A, rad/s, command in rad/s.
fn samples(lines: &[String]) -> Vec<[f64; 6]> {
    lines.iter().map(|line| line.split(',').map(|n| n.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap()).collect()
}

#[test]
fn a_fault_leaves_a_record_of_every_tick_around_it_that_can_be_read_in_pieces() {
    at_the_bench(&Stand::default(), async |host| {
        assert_eq!(host.ask("FAULt:CAPTure?").await, "EMPTY");
        assert!(host.refusal("FAULt:CAPTure:DATA?").await.contains("there is no recording"));
        host.tell("SOUR:RATE 10 RAD/S;:SOUR:MODE RATE").await;
        host.wait_s(1.5).await;
        host.send(b"STOP\n");
        host.wait_s(1.0).await;
        let told = host.ask("FAULt:CAPTure?").await;
        let words: Vec<&str> = told.split(',').collect();
        assert_eq!((words.len(), words[2]), (4, "emergency stop"), "{told}");
        let (count, trigger): (usize, usize) = (words[0].parse().unwrap(), words[1].parse().unwrap());
        assert!(count > 1000 && trigger > 100 && trigger + 100 < count, "{told}");
        let all = samples(&host.list("FAULt:CAPTure:DATA?").await);
        assert_eq!(all.len(), count);
        assert!(all.windows(2).all(|w| (w[1][0] - w[0][0] - 1e-4).abs() < 1e-9), "a row per tick");
        assert_eq!(all[trigger][0], 0.0);
        // Before: 10 rad/s and a voltage that holds it; after: none, and the rate falls.
        let mean = |of: &[[f64; 6]], k: usize| of.iter().map(|s| s[k]).sum::<f64>() / of.len() as f64;
        assert!((mean(&all[..trigger], 4) - 10.0).abs() < 0.1 && mean(&all[..trigger], 2) > 0.2);
        let after = &all[trigger + 5..];
        assert!(after.iter().all(|s| s[2] == 0.0), "the drive is off");
        assert!(after[after.len() - 1][4] < all[trigger][4]);
        let piece = samples(&host.list(&format!("FAULt:CAPTure:DATA? {},3", trigger - 1)).await);
        assert_eq!(piece, all[trigger - 1..trigger + 2]);
        // Armed anew it waits for the next.
        host.send(b"*CLS\n");
        host.tell("FAULt:CLEar").await;
        host.tell("FAULt:CAPTure:ARM 500").await;
        assert_eq!(host.ask("FAULt:CAPTure?").await, "EMPTY");
        host.wait_s(0.5).await;
        host.tell("FAULt:CAPTure:TRIGger").await;
        host.wait_s(0.5).await;
        assert!(host.ask("FAULt:CAPTure?").await.contains(",500,"), "so many before it: {}", host.ask("FAULt:CAPTure?").await);
    });
}
