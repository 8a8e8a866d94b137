//! Doors to the tick, the parser and the framing, so that what each can reach shows in one call graph.
//!
//! In the chip's image the compiler melts parser and framing into the tasks, and the walk from a vector does not see where they begin. Here each
//! is a function with a name that the linker keeps (`reach_…`); scripts/callgraph.py walks from them. Nothing is run.
#![no_std]
#![no_main]

use core::hint::black_box;
use cortex_m_rt::entry;
use panic_semihosting as _;
use stand_firmware::board::{Drive, EncoderCount, Sensed, TickIo};
use stand_firmware::console::{Guard, StopLine};
use stand_firmware::measurement_loop::Row;
use stand_firmware::speed_loop::Interrupt;
use stand_firmware::telemetry::frame::MOST_FRAME;
use stand_firmware::telemetry::{Body, Channels, Deframer, RowFrame, encode};

/// A bridge and an encoder of which the compiler knows nothing.
struct Io;

impl TickIo for Io {
    fn sense(&mut self) -> Sensed {
        black_box(Sensed::default())
    }
    fn index(&mut self) -> Option<EncoderCount> {
        black_box(None)
    }
    fn drive(&mut self, out: Drive) {
        black_box(out);
    }
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_tick(interrupt: &mut Interrupt<'static>) {
    interrupt.run(&mut Io);
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_guard(guard: &mut Guard<'static>, byte: u8) {
    guard.byte(byte);
    guard.line_break();
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_framing_encode(row: &Row, seq: u16, out: &mut [u8; MOST_FRAME]) -> usize {
    let channels = Channels(black_box(u32::MAX));
    let frame = RowFrame::new(row, channels);
    encode(&black_box(Body::Row(frame)), seq, out).map_or(0, <[u8]>::len)
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_framing_decode(deframer: &mut Deframer, byte: u8) {
    black_box(deframer.push(byte));
}

static LINE: StopLine = StopLine::new();

#[entry]
fn main() -> ! {
    let (row, seq) = black_box((Row::default(), 0));
    let mut out = [0; MOST_FRAME];
    reach_framing_encode(&row, seq, &mut out);
    reach_framing_decode(&mut Deframer::default(), black_box(0));
    reach_guard(&mut Guard::new(&LINE), black_box(0));
    tick();
    loop {
        cortex_m::asm::nop();
    }
}

/// The tick needs what is made by much else; it is only to be linked.
fn tick() {
    if let Some(interrupt) = black_box(None::<&mut Interrupt<'static>>) {
        reach_tick(interrupt);
    }
}
