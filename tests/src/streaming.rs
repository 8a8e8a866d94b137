//! A program that records from the whole simulated controller: what came of its stream.

use stand_firmware::telemetry::{Body, Deframer, frame::Piece};

use crate::bench::Host;

/// What came, and what is missing.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Streamed {
    /// Whole frames of all kinds.
    pub frames: u64,
    /// Rows among them.
    pub rows: u64,
    /// Frames that the numbers say are missing.
    pub missing: u64,
    /// Rows whose own number or time is not the next.
    pub out_of_step: u64,
    /// Pieces that are no frames.
    pub damaged: u64,
    /// What the stand itself says it had no room for.
    pub lost: u64,
}

/// Records for so long at 1 kHz; `each_second` is told how it goes. The stand goes on streaming.
pub async fn record(host: &Host<'_, '_>, seconds: u32, mut each_second: impl FnMut(u32, &Streamed)) -> Streamed {
    let mut is = Streamed::default();
    let mut deframer = Deframer::default();
    let (mut seq, mut row, mut at) = (None::<u16>, None::<u32>, None::<u64>);
    host.send(b"STReam ON\n");
    for second in 0..seconds {
        for _ in 0..50 {
            host.wait_s(0.02).await;
            for byte in host.heard() {
                let Some(Piece::Frame(frame)) = deframer.push(byte) else { continue };
                is.frames += 1;
                is.missing += seq.map_or(0, |last| u64::from(frame.seq.wrapping_sub(last).wrapping_sub(1)));
                seq = Some(frame.seq);
                match frame.body {
                    Body::Row(next) => {
                        is.rows += 1;
                        let in_step = row.is_none_or(|row| next.sequence == row + 1) && at.is_none_or(|at| next.at == at + 10_000);
                        is.out_of_step += u64::from(!in_step);
                        (row, at) = (Some(next.sequence), Some(next.at));
                    }
                    Body::Beat(beat) => is.lost = u64::from(beat.lost),
                    _ => {}
                }
            }
        }
        is.damaged = deframer.damaged();
        each_second(second + 1, &is);
    }
    is
}
