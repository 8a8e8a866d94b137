//! Consistent overhead byte stuffing (COBS): bytes without zeros, and back.
//!
//! Uses the byte-wise state machines of the `cobs` crate. Its functions on slices are not used, because the compiler cannot prove them free
//! of panics (scripts/callgraph.py).

use cobs::{DecodeResult, DecoderState, EncoderState, PushResult};

/// Writes `raw` without zeros to the beginning of `out`; the length. `None` if it does not fit, or if 254 or more bytes without a zero
/// follow each other, which no frame has.
pub fn stuff(raw: &[u8], out: &mut [u8]) -> Option<usize> {
    let mut state = EncoderState::default();
    // The first byte is the distance to the first zero.
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

/// Restores a piece between two zeros in place; its length. `None` if it is invalid.
pub fn unstuff(piece: &mut [u8]) -> Option<usize> {
    let mut state = DecoderState::default();
    let mut length = 0;
    for n in 0..=piece.len() {
        // The zero behind the piece is not part of it.
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
    fn encoding_equals_that_of_the_crate_and_decodes() {
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
    fn invalid_pieces_are_refused_as_by_the_crate() {
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
    fn data_without_room_are_refused() {
        assert_eq!(stuff(&[1; 10], &mut [0; 10]), None);
        assert_eq!(stuff(&[1; 10], &mut [0; 11]), Some(11));
        assert_eq!(stuff(&[1; 254], &mut [0; 300]), None);
    }
}
