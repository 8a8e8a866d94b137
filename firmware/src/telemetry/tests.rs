//! Encoding and decoding of frames; refusal of damaged ones.

use super::channel::CHANNELS;
use super::frame::{MAX_FRAME, MAX_TEXT, Piece};
use super::message::PROTOCOL;
use super::*;
use crate::board::Ticks;
use crate::measurement_loop::Row;
use crate::speed_loop::Limits;
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

/// Damaged frames per test; fewer in a debug build.
const DAMAGED: u32 = if cfg!(debug_assertions) { 100_000 } else { 1_000_000 };

fn row() -> Row {
    Row {
        sequence: 3_600_000,
        at: Ticks(36_000_001_000),
        u_V: 0.25,
        i_A: Some(-0.125),
        theta_rad: 45_239.123_456_789,
        omega_rad_s: Some(12.5),
        limits: Limits(3),
        age: 5_000,
        ..Row::default()
    }
}

fn sent(body: &Body<'_>, seq: u16) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    encode(body, seq, &mut out).unwrap().to_vec()
}

/// Frames and damaged pieces in a stream.
fn received(bytes: &[u8], mut each: impl FnMut(Frame<'_>)) -> u64 {
    let mut deframer = Deframer::default();
    for byte in bytes {
        if let Some(Piece::Frame(frame)) = deframer.push(*byte) {
            each(frame);
        }
    }
    deframer.damaged()
}

#[test]
fn sent_messages_are_received() {
    let hello = Hello {
        protocol: PROTOCOL,
        identity: "maker,model,0,1",
        counts_per_turn: 20_000.0,
        row_Hz: 1000,
        decimation: 5,
        channels: Channels::DEFAULT.bits(),
        zero_is_index: true,
    };
    let long = "x".repeat(MAX_TEXT);
    let row = RowFrame::new(&row(), Channels::DEFAULT);
    let bodies =
        [Body::Hello(hello), Body::Text("12.5 DEG/S"), Body::Text(&long), Body::Beat(Beat { at: 7, lost: 1, fault: 2 }), Body::Text("")];
    for (seq, body) in (65_500_u16..).zip(bodies) {
        let mut count = 0;
        assert_eq!(received(&sent(&body, seq), |frame| (assert_eq!(frame, Frame { seq, body }), count += 1).1), 0);
        assert_eq!(count, 1);
    }
    received(&sent(&Body::Row(row), 9), |frame| {
        let Body::Row(back) = frame.body else { panic!("a row") };
        assert_eq!((back.sequence, back.at, back.channels), (3_600_000, 36_000_001_000, Channels::DEFAULT));
        let value = |name| back.named().find(|(n, _)| *n == name).map(|(_, value)| value);
        assert!((value("theta_rad").unwrap() - 45_239.123_456_789).abs() < 1e-9, "to a nanoradian");
        assert_eq!((value("i_A"), value("u_V"), value("limits")), (Some(-0.125), Some(0.25), Some(3.0)));
        assert!(value("supply_V").is_some_and(f64::is_nan), "a missing value is NaN");
        assert_eq!(value("from_index_rad"), None, "a channel that was not selected is absent");
    });
    assert!(encode(&Body::Text(&"x".repeat(MAX_TEXT + 1)), 0, &mut [0; MAX_FRAME]).is_none());
}

#[test]
fn no_row_is_longer_than_its_estimate() {
    for channels in [Channels::ALL, Channels::DEFAULT, Channels::named("u_V").unwrap(), Channels::default()] {
        let row = Row {
            sequence: u32::MAX,
            at: Ticks(40_000_000_000_000),
            theta_rad: -3e6,
            theta_cmd_rad: Some(3e6),
            from_index_rad: Some(4e6),
            age: u64::from(u32::MAX),
            ..row()
        };
        let bytes = sent(&Body::Row(RowFrame::new(&row, channels)), 1).len();
        assert!(bytes <= channels.frame_bytes() as usize, "{bytes} of {}", channels.frame_bytes());
    }
}

#[test]
fn every_channel_has_a_unique_name() {
    for (bit, channel) in CHANNELS.iter().enumerate() {
        assert_eq!(Channels::named(&channel.name.to_uppercase()).map(Channels::bits), Some(1 << bit));
    }
}

/// Flips, loses or inserts one to four bytes, or cuts a piece out.
fn damage(bytes: &mut Vec<u8>, random: &mut Xoshiro256PlusPlus) {
    for _ in 0..=random.next_u32() % 4 {
        let place = random.next_u32() as usize % bytes.len();
        match random.next_u32() % 6 {
            0 => bytes[place] ^= 1 << (random.next_u32() % 8),
            1 => bytes[place] = random.next_u32() as u8,
            2 => drop(bytes.remove(place)),
            3 => bytes.insert(place, random.next_u32() as u8),
            4 => bytes.insert(place, 0),
            _ => drop(bytes.drain(place..(place + random.next_u32() as usize % 12).min(bytes.len() - 1).max(place))),
        }
    }
}

#[test]
fn no_damaged_frame_is_accepted() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(4);
    let (mut through, mut counted) = (0_u32, 0_u64);
    for n in 0..DAMAGED {
        let random_row =
            Row { sequence: n, theta_rad: f64::from(random.next_u32() >> 12), i_A: Some(f64::from(random.next_u32())), ..row() };
        let row = Body::Row(RowFrame::new(&random_row, Channels::from_bits(random.next_u32() & Channels::ALL.bits()).unwrap()));
        let body = if n % 4 == 0 { Body::Text("SOURce:RATE 12.5 RAD/S") } else { row };
        let whole = sent(&body, n as u16);
        let mut bytes = whole.clone();
        damage(&mut bytes, &mut random);
        // The end of one frame may run into the next; the next must be found all the same where its own zeros are whole.
        bytes.extend(sent(&Body::Beat(Beat { at: u64::from(n), ..Beat::default() }), !(n as u16)));
        let mut beats = 0;
        counted += received(&bytes, |frame| match frame.body {
            Body::Beat(beat) => beats += u32::from(beat.at == u64::from(n)),
            // Damage may leave the frame itself whole (a zero more before it); what is accepted is to the last bit what was sent.
            _ if sent(&frame.body, frame.seq) == whole => through += 1,
            other => panic!("accepted {other:?} for {body:?}"),
        });
        assert_eq!(beats, 1, "the frame behind the damage is found");
    }
    assert!(through < DAMAGED / 5 && counted > u64::from(DAMAGED) / 2, "the damage was damage: {through} whole, {counted} counted");
}

#[test]
fn noise_is_not_a_frame() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut bytes = vec![0; 16 * DAMAGED as usize];
    random.fill_bytes(&mut bytes);
    assert!(received(&bytes, |frame| panic!("accepted {frame:?}")) > 0);
}

#[test]
fn names_end_with_their_units_and_the_default_selection_is_stable() {
    for channel in &CHANNELS {
        let unit = channel.unit.replace('²', "2").replace('°', "").replace(['/', ' '], "_");
        let expected = if unit.is_empty() { String::new() } else { format!("_{unit}") };
        assert!(channel.name.ends_with(&expected), "{} in {}", channel.name, channel.unit);
    }
    // The default of the protocol's first version.
    assert_eq!(Channels::DEFAULT.bits(), 0b110_1111_1111 | 1 << 26);
}
