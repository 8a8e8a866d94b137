//! `STReam`: rows in frames; which channels, how often. A selection that needs more than 85 % of the line is refused.

use super::{Action, Done, Entry, List, entry};
use crate::app::state::{State, Stream};
use crate::board::ROW_HZ;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::telemetry::channel::Coding;
use crate::telemetry::message::PROTOCOL;
use crate::telemetry::{Body, CHANNELS, Channels, Hello};
use crate::text::{Ascii, Fixed, write_list};
use core::fmt::{self, Write};
use heapless::String;

/// Greatest part of the line that rows may take; the rest is for replies.
const MAX_LINE_LOAD: f64 = 0.85;
/// Start bit, eight data bits, stop bit.
const BITS_PER_BYTE: f64 = 10.0;

pub(super) const ENTRIES: &[Entry] = &[
    entry(
        "STReam",
        Action::Switch {
            read: |state| state.out.is_streaming(),
            write: |state, on| {
                if on {
                    require_capacity(state, state.stream.selection.get())?;
                    set_zero(state);
                }
                state.out.set_streaming(on);
                send_hello(state);
                Ok(())
            },
        },
        "frames or text; 0x18, a break and *RST also return to text",
    ),
    entry("STReam:CHANnels", Action::CommandAndQuery("<name>{,<name>} or ALL or DEFault", set_channels, channels), "channels of a row"),
    entry("STReam:CHANnels:LIST", Action::ListQuery(List::Channels), "all channels"),
    entry(
        "STReam:DECimation",
        Action::Number {
            range: const { &Range::new(Quantity::PLAIN, 1.0, 1000.0, 1.0) },
            read: |state| f64::from(state.stream.selection.get().decimation),
            write: |state, decimation| {
                let decimation = libm::round(decimation) as u32;
                select(state, Stream { decimation, ..state.stream.selection.get() })
            },
        },
        "number of 1 kHz rows per transmitted row",
    ),
    entry(
        "STReam:LOAD",
        Action::NumberQuery("PCT", |state| Ok(100.0 * line_load(state, state.stream.selection.get()))),
        "part of the line that the selection takes",
    ),
];

fn set_channels(state: &State<'_>, parameters: &mut Parameters<'_>) -> Done {
    let mut channels = channel(parameters.text()?)?;
    let mut rest = *parameters;
    while rest.next_text().is_some() {
        channels = channels.and(channel(parameters.text()?)?);
        rest = *parameters;
    }
    select(state, Stream { channels, ..state.stream.selection.get() })
}

/// The channel of a name, or a set of channels.
fn channel(name: &[u8]) -> Result<Channels, ErrorEntry> {
    if name.eq_ignore_ascii_case(b"ALL") {
        return Ok(Channels::ALL);
    }
    if name.eq_ignore_ascii_case(b"DEF") || name.eq_ignore_ascii_case(b"DEFAULT") {
        return Ok(Channels::DEFAULT);
    }
    core::str::from_utf8(name).ok().and_then(Channels::named).ok_or_else(|| {
        ErrorEntry::with(Code::ILLEGAL_VALUE, format_args!("there is no channel {}: STReam:CHANnels:LIST? lists all", Ascii(name)))
    })
}

fn channels(state: &State<'_>, out: &mut dyn Write) -> Done {
    let channels = state.stream.selection.get().channels;
    if channels == Channels::ALL {
        // The list of all names is longer than a line.
        return Ok(out.write_str("ALL")?);
    }
    Ok(write_list(out, channels.iter().map(|channel| channel.name))?)
}

/// The part of the line that a selection takes.
fn line_load(state: &State<'_>, stream: Stream) -> f64 {
    let bytes_s = f64::from(stream.channels.frame_bytes()) * ROW_HZ as f64 / f64::from(stream.decimation.max(1));
    bytes_s * BITS_PER_BYTE / f64::from(state.identity.baud)
}

fn require_capacity(state: &State<'_>, stream: Stream) -> Done {
    let load = line_load(state, stream);
    if load <= MAX_LINE_LOAD {
        return Ok(());
    }
    let (percent, limit) = (Fixed(100.0 * load, 1), Fixed(100.0 * MAX_LINE_LOAD, 0));
    let baud = state.identity.baud;
    let detail = format_args!("the rows need {percent} % of {baud} baud, the limit is {limit} %: select fewer channels or rows");
    Err(ErrorEntry::with(Code::LINE_TOO_SLOW, detail))
}

fn select(state: &State<'_>, stream: Stream) -> Done {
    require_capacity(state, stream)?;
    state.stream.selection.set(stream);
    send_hello(state);
    Ok(())
}

/// Refers the angles of the stream to the index if it was seen; the zero does not move during a stream.
fn set_zero(state: &State<'_>) {
    let row = state.measured.row.get();
    let half_count_rad = 0.5 * state.hardware.rad_per_count();
    state.stream.to_index_rad.set(row.from_index_rad.map(|from_index_rad| from_index_rad - half_count_rad - row.theta_rad));
}

/// Sends the description of the rows that follow.
fn send_hello(state: &State<'_>) {
    if !state.out.is_streaming() {
        return;
    }
    let mut identity = String::<100>::new();
    // Model and serial number are short.
    _ = super::common::write_identity(state, &mut identity);
    let stream = state.stream.selection.get();
    state.out.frame(&Body::Hello(Hello {
        protocol: PROTOCOL,
        identity: &identity,
        counts_per_turn: state.hardware.counts_per_turn,
        row_Hz: ROW_HZ as u16,
        decimation: stream.decimation as u16,
        channels: stream.channels.bits(),
        zero_is_index: state.stream.to_index_rad.get().is_some(),
    }));
}

/// A channel: name, transmitted format.
pub(super) fn channel_line(line: usize, out: &mut dyn Write) -> Result<bool, fmt::Error> {
    let Some(channel) = CHANNELS.get(line) else { return Ok(false) };
    let coding = match channel.coding {
        Coding::Single => "single precision",
        Coding::Nano => "integer in units of 1E-9",
        Coding::Whole => "unsigned integer",
    };
    write!(out, "{}: {coding}", channel.name)?;
    Ok(true)
}
