//! Telemetry of the complete controller: one minute of rows at 1 kHz. For one hour: `cargo bench -p hal-sim --bench hour_of_telemetry`.
#![allow(clippy::unwrap_used)]

use hal_sim::faults::FaultKind;
use hal_sim::plant::Stand;
use stand_tests::bench::with_stand;
use stand_tests::streaming::record;

#[test]
fn minute_at_1_kilohertz_loses_no_frame() {
    with_stand(&Stand::default(), async |host| {
        host.command("SOUR:RATE 10;:SOUR:MODE RATE").await;
        let counts = record(host, 60, |_, _| ()).await;
        println!("{counts:?}");
        assert!((59_990..=60_000).contains(&counts.rows), "{counts:?}");
        assert_eq!((counts.missing, counts.out_of_step, counts.damaged, counts.lost), (0, 0, 0, 0));
        host.send(b"\x18");
        host.wait_s(0.1).await;
        host.received();
        assert!(host.query("*IDN?").await.starts_with("Rotary Stand"), "0x18 returns to text mode");
    });
}

#[test]
fn frames_damaged_by_the_line_are_counted_and_dropped() {
    with_stand(&Stand::default(), async |host| {
        host.wait_s(0.1).await;
        host.inject_fault(FaultKind::LineFlips, f64::INFINITY, Some(1e-4));
        let counts = record(host, 20, |_, _| ()).await;
        println!("{counts:?}");
        // About 60 bytes per row: one row in 170 is damaged, and a gap in the frame numbers shows it. Two frames become one if the 00
        // between them is damaged.
        assert!(counts.damaged > 50 && counts.missing > 50 && counts.rows > 19_000, "{counts:?}");
        assert!(counts.rows + counts.missing >= 19_950, "{counts:?}");
    });
}
