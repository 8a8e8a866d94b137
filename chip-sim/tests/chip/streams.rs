//! Telemetry of the flashed image: no row is lost while the platform turns.

use crate::common;
use common::{Chip, Rows};

/// Streams the default channels at 30 rad/s for `seconds`; in each second the lines of `queries` are sent, evenly spaced.
fn stream(seconds: u64, queries: &[&str]) -> Rows {
    let mut chip = Chip::booted();
    chip.say("STReam:CHANnels DEFault;:SOURce:RATE 30;MODE RATE;:STReam ON");
    let mut received = Rows::default();
    for _ in 0..seconds {
        for step in 0..10 {
            if let Some(query) = queries.get(step) {
                chip.say(query);
            }
            chip.run_ms(100);
            received.take(&chip.take_received(), |_| {});
        }
    }
    received
}

fn assert_complete(received: &Rows, seconds: u64) {
    println!("{} rows, {} missing rows, {} damaged frames", received.rows, received.missing_rows, received.damaged);
    assert_eq!((received.missing_rows, received.missing_frames), (0, 0), "of {} rows", received.rows);
    assert!(received.rows + 500 > 1000 * seconds, "{} rows", received.rows);
    assert!(received.damaged <= 1, "{} damaged frames", received.damaged);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn telemetry_loses_no_row() {
    // scripts/full-benches.sh runs ten minutes.
    let seconds = std::env::var("STAND_TELEMETRY_S").map_or(20, |text| text.parse().expect("STAND_TELEMETRY_S is a number of seconds"));
    assert_complete(&stream(seconds, &[]), seconds);
}

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn queries_beside_telemetry_lose_no_row() {
    let queries = ["MEASure:DRIVe?", "MEASure:STABility?", "MEASure:TURN?", "FAULt?", "SETTings?", "SYSTem:HELP?"];
    assert_complete(&stream(10, &queries), 10);
}
