//! Entry points of tick, parser and framing for the call-graph check.
//!
//! In the chip's image, the compiler inlines parser and framing into the tasks. Here each has an exported function (`reach_…`) from which
//! scripts/callgraph.py follows the calls. The program is never run.
#![no_std]
#![no_main]

use core::fmt::Write;
use core::hint::black_box;
use core::panic::PanicInfo;
use cortex_m_rt::entry;
use stand_firmware::board::{Drive, EncoderCount, Sensed, TickIo};
use stand_firmware::console::line::{Line, Lines};
use stand_firmware::console::parse::{Commands, Range, is_name};
use stand_firmware::console::quantity::Quantity;
use stand_firmware::console::{Guard, StopLine};
use stand_firmware::measurement_loop::Row;
use stand_firmware::speed_loop::Interrupt;
use stand_firmware::telemetry::frame::MAX_FRAME;
use stand_firmware::telemetry::{Body, Channels, Deframer, RowFrame, encode};
use stand_firmware::text::{Significant, Truncated};

/// A bridge and an encoder that are opaque to the compiler.
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
extern "C" fn reach_framing_encode(row: &Row, seq: u16, out: &mut [u8; MAX_FRAME]) -> usize {
    let channels = Channels::from_bits(black_box(u32::MAX)).unwrap_or(Channels::ALL);
    let frame = RowFrame::new(row, channels);
    encode(&black_box(Body::Row(frame)), seq, out).map_or(0, <[u8]>::len)
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_framing_decode(deframer: &mut Deframer, byte: u8) {
    black_box(deframer.push(byte));
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn reach_parser(lines: &mut Lines, byte: u8, reply: &mut Truncated<200>) {
    let Some(Line { text: Ok(text), .. }) = lines.push(byte) else { return };
    for command in Commands::new(text) {
        black_box(is_name(command.header(), black_box("dwell_s")));
        black_box((command.is(black_box("SOURce:RATE")), command.last_below(black_box("SETTings")), command.header()));
        let mut parameters = command.parameters();
        let range = Range::new(Quantity::RATE, black_box(-1.0), black_box(1.0), 0.0);
        if let Ok(number) = parameters.number(&range) {
            _ = write!(reply, "{}", Significant(number, 9));
        }
        black_box((parameters.text().is_ok(), parameters.on_off().is_ok(), parameters.choice(&["ONE", "TWO"]).is_ok()));
        if let Err(error) = parameters.end() {
            _ = write!(reply, "{error}");
        }
    }
}

/// The program is never run.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    loop {
        cortex_m::asm::nop();
    }
}

static LINE: StopLine = StopLine::new();

#[entry]
fn main() -> ! {
    let (row, seq) = black_box((Row::default(), 0));
    let mut out = [0; MAX_FRAME];
    reach_framing_encode(&row, seq, &mut out);
    reach_framing_decode(&mut Deframer::default(), black_box(0));
    reach_guard(&mut Guard::new(&LINE), black_box(0));
    reach_parser(&mut Lines::default(), black_box(0), &mut Truncated::default());
    tick();
    loop {
        cortex_m::asm::nop();
    }
}

/// Links the tick; the call is never executed.
fn tick() {
    if let Some(interrupt) = black_box(None::<&mut Interrupt<'static>>) {
        reach_tick(interrupt);
    }
}
