//! Reception on the serial line at all phases of its bytes: no byte is lost and no stop is missed.
#![allow(clippy::unwrap_used)]

use crate::common;
use chip_sim::time::{PER_US, Time};
use common::Chip;

/// A time of 1 byte at the line's rate: 10 bits.
const BYTE: Time = 10 * 1_000_000 * PER_US / common::BAUD;

#[test]
#[ignore = "needs the image: scripts/build-firmware.sh"]
fn bytes_with_gaps_of_every_length_arrive() {
    let mut chip = Chip::booted();
    let mut state = 1_u32;
    for line in 0..400 {
        let number = line % 90 + 10;
        for byte in format!("SETTings:slip_rad 0.{number};slip_rad?\n").bytes() {
            chip.machine.send(&[byte], common::BAUD);
            // From no gap to three idle bytes: the receiver's flags rise at every phase of its interrupt.
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            chip.run_until(chip.machine.now() + BYTE + Time::from(state >> 16) * 3 * BYTE / 65_536);
        }
        chip.run_ms(3);
        let reply = String::from_utf8(chip.take_received()).unwrap();
        assert!(reply.starts_with(&format!("0.{number}").trim_end_matches('0').to_owned()), "line {line}: {reply:?}");
    }
    assert_eq!(chip.ask("SYSTem:ERRor:COUNt?"), "0");
}
