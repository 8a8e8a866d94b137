//! Records the stream of the simulated controller and counts losses.

use stand_firmware::telemetry::{Body, Deframer, frame::Piece};

use crate::bench::Host;

/// Counts of received and missing data.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Streamed {
    /// Complete frames of all kinds.
    pub frames: u64,
    /// Rows among them.
    pub rows: u64,
    /// Frames missing by sequence number.
    pub missing: u64,
    /// Rows whose number or time is not consecutive.
    pub out_of_step: u64,
    /// Undecodable pieces.
    pub damaged: u64,
    /// Frames that the stand reports as dropped for lack of buffer.
    pub lost: u64,
}

/// Records for `seconds` at 1 kHz; `each_second` receives the progress. The stand keeps streaming.
pub async fn record(host: &Host<'_, '_>, seconds: u32, mut each_second: impl FnMut(u32, &Streamed)) -> Streamed {
    let mut counts = Streamed::default();
    let mut deframer = Deframer::default();
    let (mut seq, mut row, mut at) = (None::<u16>, None::<u32>, None::<u64>);
    host.send(b"STReam ON\n");
    for second in 0..seconds {
        for _ in 0..50 {
            host.wait_s(0.02).await;
            for byte in host.received() {
                let Some(Piece::Frame(frame)) = deframer.push(byte) else { continue };
                counts.frames += 1;
                counts.missing += seq.map_or(0, |last| u64::from(frame.seq.wrapping_sub(last).wrapping_sub(1)));
                seq = Some(frame.seq);
                match frame.body {
                    Body::Row(next) => {
                        counts.rows += 1;
                        let in_step = row.is_none_or(|row| next.sequence == row + 1) && at.is_none_or(|at| next.at == at + 10_000);
                        counts.out_of_step += u64::from(!in_step);
                        (row, at) = (Some(next.sequence), Some(next.at));
                    }
                    Body::Beat(beat) => counts.lost = u64::from(beat.lost),
                    _ => {}
                }
            }
        }
        counts.damaged = deframer.damaged();
        each_second(second + 1, &counts);
    }
    counts
}
