//! Telemetry of the whole controller: a minute of rows at 1 kHz. The hour is `cargo bench -p hal-sim --bench hour_of_telemetry`.
#![allow(clippy::unwrap_used)]

use hal_sim::faults::FaultKind;
use hal_sim::plant::Stand;
use stand_tests::bench::at_the_bench;
use stand_tests::streaming::record;

#[test]
fn a_minute_at_1_kilohertz_while_it_turns_loses_no_frame() {
    at_the_bench(&Stand::default(), async |host| {
        host.tell("SOUR:RATE 10;:SOUR:MODE RATE").await;
        let is = record(host, 60, |_, _| ()).await;
        println!("{is:?}");
        assert!((59_990..=60_000).contains(&is.rows), "{is:?}");
        assert_eq!((is.missing, is.out_of_step, is.damaged, is.lost), (0, 0, 0, 0));
        host.send(b"\x18");
        host.wait_s(0.1).await;
        host.heard();
        assert!(host.ask("*IDN?").await.starts_with("Rotary Stand"), "0x18 leads back to text");
    });
}

#[test]
fn what_a_bad_line_damages_is_counted_and_nothing_else_is_shown() {
    at_the_bench(&Stand::default(), async |host| {
        host.wait_s(0.1).await;
        host.break_(FaultKind::LineFlips, f64::INFINITY, Some(1e-4));
        let is = record(host, 20, |_, _| ()).await;
        println!("{is:?}");
        // Some 60 bytes a row: one row in 170 is hit. Each is missed by its number, and its damage is seen; a hit 00 joins two frames.
        assert!(is.damaged > 50 && is.missing > 50 && is.rows > 19_000, "{is:?}");
        assert!(is.rows + is.missing >= 19_950, "{is:?}");
    });
}
