//! A serial line that damages, loses and inserts bytes, with the complete controller: no damaged command is executed, and the platform can
//! always be stopped.
#![allow(clippy::unwrap_used)]

use std::collections::BTreeSet;

use hal_sim::faults::FaultKind;
use hal_sim::plant::Stand;
use stand_tests::bench::{checked, with_stand};

/// Pseudo-random value between 1 and 30: values of successive `n` differ in most digits, so that a damaged one hardly equals another one.
fn value(n: u32) -> String {
    format!("{:.6}", 1.0 + f64::from(n.wrapping_mul(2_654_435_761) % 29_000_000) * 1e-6)
}

#[test]
fn no_damaged_command_is_obeyed() {
    for (what, fraction) in [(FaultKind::LineFlips, 0.02), (FaultKind::LineLoses, 0.02), (FaultKind::LineInserts, 0.02)] {
        with_stand(&Stand::default(), async |host| {
            // After a command with checksum, the stand accepts only commands with checksum.
            host.send(checked("*IDN?").as_bytes());
            assert!(host.line(1.0).await.unwrap().starts_with("Rotary Stand"));
            let (mut sent, mut in_force, mut refused) = (BTreeSet::from(["0".to_owned()]), BTreeSet::new(), 0);
            for round in 0..2000 {
                host.inject_fault(what, f64::INFINITY, Some(fraction));
                for n in 0..5 {
                    let value = value(round * 5 + n);
                    host.send(checked(&format!("SOUR:RATE {value}")).as_bytes());
                    sent.insert(value);
                }
                host.wait_s(0.02).await;
                host.clear_fault(what);
                // Terminates a partial line.
                host.send(b"\n");
                host.wait_s(0.002).await;
                host.received();
                host.send(checked("SOUR:RATE?").as_bytes());
                let answer = host.line(1.0).await.unwrap();
                let number: f64 = answer.split(' ').next().unwrap().parse().unwrap();
                assert!(sent.iter().any(|sent| (sent.parse::<f64>().unwrap() - number).abs() < 1e-9), "{what:?}: {answer} was never sent");
                in_force.insert(answer);
                host.send(checked("SYST:ERR:COUN?").as_bytes());
                refused += host.line(1.0).await.unwrap().parse::<u32>().unwrap();
                host.send(checked("*CLS").as_bytes());
            }
            println!("{what:?}: {} of {} values were in force when asked, {refused} lines refused", in_force.len(), sent.len());
            // In most groups of five at least one command arrives, and damaged lines are detected and refused.
            assert!(in_force.len() > 1500 && refused > 1500, "{what:?}: {} values in force, {refused} lines refused", in_force.len());
        });
    }
}

/// A checksum of decimal digits only: without its `~` it would extend the number before it.
#[test]
fn lost_checksum_mark_and_cut_line_are_refused() {
    let command = |n: u32| format!("SOUR:RATE 1.{n}");
    let digits_only = (0..).find(|n| checked(&command(*n)).trim_end().rsplit('~').next().unwrap().bytes().all(|b| b.is_ascii_digit()));
    let line = checked(&command(digits_only.unwrap()));
    with_stand(&Stand::default(), async |host| {
        host.send(checked("*IDN?").as_bytes());
        host.line(1.0).await.unwrap();
        let cut = line.replace("1.", "1\n.");
        for damaged in [line.replace('~', ""), cut] {
            host.send(damaged.as_bytes());
            host.wait_s(0.01).await;
            host.send(checked("SOUR:RATE?").as_bytes());
            assert!(host.line(1.0).await.as_deref() == Some("0"), "{damaged:?}");
        }
        // Without checksums for longer than the time-out, a line without checksum is accepted again.
        host.wait_s(60.0).await;
        host.command("*CLS").await;
        host.command("SOUR:RATE 1.5").await;
    });
}

#[test]
fn byte_0x18_stops_the_platform_on_a_damaged_line() {
    with_stand(&Stand::default(), async |host| {
        host.command("SOUR:RATE 10;:SOUR:MODE RATE").await;
        host.wait_s(1.0).await;
        host.inject_fault(FaultKind::LineFlips, f64::INFINITY, Some(0.05));
        host.send(b"SOUR:RA\x18");
        // With 5 % of the bytes damaged, one of the four is practically certain to arrive.
        host.send(&[0x18; 3]);
        host.wait_s(0.01).await;
        host.clear_fault(FaultKind::LineFlips);
        host.send(b"\n");
        host.wait_s(0.01).await;
        host.received();
        let fault = host.query("FAULT?").await;
        assert!(fault.contains("emergency stop"), "{fault}");
        host.send(b"*CLS\n");
        assert!(host.refusal("SOUR:MODE RATE").await.starts_with("-221"), "the fault stays latched after *CLS");
        host.wait_s(4.0).await;
        assert!(host.true_rate_rad_s().abs() < 0.1);
        host.command("*CLS").await;
        host.command("FAULT:CLEAR").await;
        host.wait_s(0.01).await;
        host.command("SOUR:RATE 5;:SOUR:MODE RATE").await;
        host.wait_s(0.5).await;
        assert!((host.true_rate_rad_s() - 5.0).abs() < 0.2, "the platform turns again: {}", host.true_rate_rad_s());
    });
}
