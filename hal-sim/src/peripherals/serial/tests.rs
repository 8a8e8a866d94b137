//! The line alone: transfer times, sequence, lost bytes and their report.

use super::*;
use crate::clock::{self, SimClock};
use embassy_futures::join::join;
use stand_firmware::board::Clock;

/// 10 bits at 921 600 baud, in steps of 0.1 µs.
const BYTE_STEPS: f64 = 10.0 / 921_600.0 * 1e7;

/// Runs the futures of device and host, with delivery at each tick; returns the bytes of the receive interrupt.
fn run<D: Future<Output = ()>, H: Future<Output = ()>>(clock: &VirtualClock, line: &SerialLine<'_>, device: D, host: H) -> Vec<u8> {
    let mut had = Vec::new();
    let mut tick = Ticks(0);
    clock::run(clock, join(device, host), |to| {
        while tick <= to {
            line.deliver(tick, |byte| had.extend(byte));
            tick = tick + TICKS_PER_CONTROL;
        }
        line.deliver(to, |byte| had.extend(byte));
    })
    .unwrap();
    had
}

#[test]
fn bytes_need_their_transfer_time_in_both_directions() {
    let clock = VirtualClock::default();
    let line = SerialLine::new(&clock, USUAL_BAUD, 1);
    let (mut receive, mut transmit) = line.device();
    let device = async {
        let mut got = Vec::new();
        let mut some = [0; 64];
        while got.len() < 200 {
            let count = receive.read(&mut some).await.unwrap();
            got.extend_from_slice(&some[..count]);
        }
        let arrived = SimClock(&clock).now().0 as f64;
        assert!((200.0 * BYTE_STEPS..200.0 * BYTE_STEPS + 1e3).contains(&arrived), "within a tick of the last bit: {arrived}");
        assert_eq!(got, (0..200).collect::<Vec<u8>>());
        transmit.write_all(&got).await.unwrap();
        transmit.write_all(&[7; 1000]).await.unwrap();
        transmit.flush().await.unwrap();
        let sent = SimClock(&clock).now().0 as f64 - arrived;
        assert!((1200.0 * BYTE_STEPS..1200.0 * BYTE_STEPS + 1e3).contains(&sent), "no gap between two writes: {sent}");
    };
    let host = async {
        let bytes: Vec<u8> = (0..200).collect();
        line.send(&bytes);
        SimClock(&clock).until(Ticks(200_000)).await;
        let mut back = Vec::new();
        line.receive(&mut back);
        assert_eq!(back[..200], bytes);
        assert_eq!(back[200..], [7; 1000]);
    };
    let had = run(&clock, &line, device, host);
    assert_eq!(had, (0..200).collect::<Vec<u8>>(), "each byte passed the interrupt once");
    assert_eq!(line.counts(), LineCounts { sent: 1200, received: 200, ..LineCounts::default() });
}

#[test]
fn the_interrupt_gets_each_byte_without_a_reader_and_a_full_buffer_reports_an_overrun() {
    /// In 20 ms 1800 bytes come.
    const SENT: usize = 1500;
    let clock = VirtualClock::default();
    let line = SerialLine::new(&clock, USUAL_BAUD, 1);
    let (mut receive, _) = line.device();
    let device = async {
        SimClock(&clock).until(Ticks(200_000)).await;
        let mut some = [0; 2 * RECEIVE_BYTES];
        assert_eq!(receive.read(&mut some).await, Ok(RECEIVE_BYTES - 1), "the first bytes are kept");
        assert_eq!(receive.read(&mut some).await, Err(LineError::Overrun));
    };
    let host = async { line.send(&[b'x'; SENT]) };
    let had = run(&clock, &line, device, host);
    assert_eq!(had.len(), SENT);
    assert_eq!(line.counts().overrun, (SENT - RECEIVE_BYTES) as u64);
}

#[test]
fn a_break_is_read_in_sequence_and_an_unplugged_line_is_silent() {
    let clock = VirtualClock::default();
    let line = SerialLine::new(&clock, 9600, 1);
    let (mut receive, mut transmit) = line.device();
    let device = async {
        let mut some = [0; 16];
        assert_eq!(receive.read(&mut some).await, Ok(1));
        SimClock(&clock).until(Ticks(100_000)).await;
        assert_eq!(receive.read(&mut some).await, Ok(1));
        assert_eq!(receive.read(&mut some).await, Err(LineError::Break));
        assert_eq!(receive.read(&mut some).await, Ok(1));
        assert_eq!(some[0], b'd', "bytes on the unplugged wire are lost");
        transmit.write_all(b"back").await.unwrap();
        transmit.flush().await.unwrap();
    };
    let host = async {
        line.send(b"ab");
        line.send_break();
        SimClock(&clock).until(Ticks(150_000)).await;
        line.plug(false);
        line.send(b"c");
        SimClock(&clock).until(Ticks(250_000)).await;
        line.plug(true);
        line.send(b"d");
        let mut back = Vec::new();
        // A byte at 9600 baud lasts 1.04 ms.
        SimClock(&clock).until(Ticks(320_000)).await;
        line.receive(&mut back);
        SimClock(&clock).until(Ticks(500_000)).await;
        line.receive(&mut back);
        assert_eq!(back, b"back");
    };
    run(&clock, &line, device, host);
}

#[test]
fn damage_depends_on_the_seed_and_ends_at_rate_zero() {
    let damaged = |seed| {
        let clock = VirtualClock::default();
        let line = SerialLine::new(&clock, USUAL_BAUD, seed);
        line.damage(DamageRates::NONE, DamageRates { flip: 0.01, lose: 0.01, insert: 0.01 });
        let (_, mut transmit) = line.device();
        let mut back = Vec::new();
        let device = async {
            transmit.write_all(&[0x55; 10_000]).await.unwrap();
            transmit.flush().await.unwrap();
            line.damage(DamageRates::NONE, DamageRates::NONE);
            transmit.write_all(&[0xAA; 1000]).await.unwrap();
            transmit.flush().await.unwrap();
        };
        run(&clock, &line, device, async {});
        line.receive(&mut back);
        (back, line.counts().damaged)
    };
    let (back, count) = damaged(1);
    assert!((200..400).contains(&count), "3 % of 10 000: {count}");
    assert_eq!(back[back.len() - 1000..], [0xAA; 1000], "no damage afterwards");
    assert!(back[..back.len() - 1000].iter().any(|byte| *byte != 0x55));
    assert_eq!(damaged(1).0, back, "the same seed, the same damage");
    assert_ne!(damaged(2).0, back);
}
