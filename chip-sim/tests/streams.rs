//! Telemetry of the flashed image: no row is lost while the platform turns.

mod common;

use common::{Chip, Rows};

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn a_minute_of_telemetry_loses_no_row() {
    let mut chip = Chip::booted();
    chip.say("STReam:CHANnels DEFault;:SOURce:RATE 30;MODE RATE;:STReam ON");
    let mut received = Rows::default();
    let mut text = Vec::new();
    for _ in 0..600 {
        chip.run_ms(100);
        let bytes = chip.take_received();
        if text.len() < 100 {
            text.extend_from_slice(&bytes);
        }
        received.take(&bytes, |_| {});
    }
    assert!(received.rows > 59_500, "{} rows; {}", received.rows, String::from_utf8_lossy(&text));
    assert_eq!((received.missing_rows, received.missing_frames), (0, 0), "of {} rows", received.rows);
    assert!(received.damaged <= 1, "{} damaged frames", received.damaged);
}
