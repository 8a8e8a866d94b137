//! COBS around a frame: bytes without a zero in them, and back.
//!
//! The `cobs` crate's state machines, byte by byte. Its functions on slices index them, and what indexes can panic as far as the compiler can
//! see (scripts/callgraph.py); here a place that is not there is an answer.

use cobs::{DecodeResult, DecoderState, EncoderState, PushResult};

/// Writes `raw` without zeros to the beginning of `out`; how many bytes. `None` if they do not fit, or if 254 and more without a zero
/// follow each other: a frame is shorter.
pub fn stuff(raw: &[u8], out: &mut [u8]) -> Option<usize> {
    let mut state = EncoderState::default();
    // The first place is for the distance to the first zero.
    let mut length = 1;
    for byte in raw {
        let (at, value) = match state.push(*byte) {
            PushResult::AddSingle(value) => (length, value),
            PushResult::ModifyFromStartAndSkip((at, distance)) => (at, distance),
            PushResult::ModifyFromStartAndPushAndSkip(_) => return None,
        };
        *out.get_mut(at)? = value;
        length += 1;
    }
    let (at, distance) = state.finalize();
    *out.get_mut(at)? = distance;
    (length <= out.len()).then_some(length)
}

/// Brings a piece between two zeros back in its place; how many bytes it has then. `None` if it is not such a piece.
pub fn unstuff(piece: &mut [u8]) -> Option<usize> {
    let mut state = DecoderState::default();
    let mut length = 0;
    for n in 0..=piece.len() {
        // The zero behind the piece is not in it.
        match state.feed(piece.get(n).copied().unwrap_or(0)).ok()? {
            DecodeResult::DataContinue(byte) => {
                *piece.get_mut(length)? = byte;
                length += 1;
            }
            DecodeResult::DataComplete => return (n == piece.len()).then_some(length),
            DecodeResult::NoData | DecodeResult::DataStart => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    #[test]
    fn it_is_what_the_crate_makes_of_it_and_comes_back() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        for n in 0..20_000_usize {
            let length = n % 248;
            let raw: Vec<u8> =
                (0..length).map(|_| (random.next_u32() as u8).saturating_mul(u8::from(random.next_u32() % 7 != 0))).collect();
            let mut out = [0; 260];
            let stuffed = stuff(&raw, &mut out).unwrap();
            let mut theirs = [0; 260];
            let their_length = cobs::encode(&raw, &mut theirs);
            assert_eq!(out[..stuffed], theirs[..their_length], "{raw:?}");
            let mut piece = out[..stuffed].to_vec();
            let back = unstuff(&mut piece).unwrap();
            assert_eq!(piece[..back], raw);
        }
    }

    #[test]
    fn what_is_no_such_piece_is_refused_as_by_the_crate() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
        let mut refused = 0;
        for _ in 0..50_000 {
            let mut piece: Vec<u8> = (0..random.next_u32() % 12).map(|_| (random.next_u32() % 9) as u8).collect();
            let mut theirs = piece.clone();
            theirs.push(0);
            let length = theirs.iter().position(|byte| *byte == 0).unwrap();
            piece.truncate(length);
            theirs.truncate(length + 1);
            let mut space = [0; 32];
            let theirs = if length == 0 { None } else { cobs::decode(&theirs, &mut space).ok() };
            let theirs = theirs.map(|report| space[..report.frame_size().min(32)].to_vec());
            let ours = unstuff(&mut piece).map(|n| piece[..n].to_vec());
            assert_eq!(ours, theirs);
            refused += usize::from(ours.is_none());
        }
        assert!(refused > 10_000, "{refused}");
    }

    #[test]
    fn what_does_not_fit_is_refused() {
        assert_eq!(stuff(&[1; 10], &mut [0; 10]), None);
        assert_eq!(stuff(&[1; 10], &mut [0; 11]), Some(11));
        assert_eq!(stuff(&[1; 254], &mut [0; 300]), None);
    }
}
