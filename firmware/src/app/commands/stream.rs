//! `STReam`: rows in frames, which channels, how often; refused where the line does not carry it.

use super::{Act, Done, Entry, List, entry};
use crate::app::state::{State, Stream};
use crate::board::ROW_HZ;
use crate::console::errors::{Code, ErrorEntry};
use crate::console::parse::{Parameters, Range};
use crate::console::quantity::Quantity;
use crate::console::text::{Text, Writer};
use crate::telemetry::channel::Coding;
use crate::telemetry::frame::PROTOCOL;
use crate::telemetry::{Body, CHANNELS, Channels, Hello};
use crate::words::words;

/// What of the line rows may take; the rest is for replies.
const SHARE: f64 = 0.8;

pub(super) const ENTRIES: &[Entry] = &[
    entry!(
        "STReam",
        Act::Switch {
            read: |state| state.out.is_streaming(),
            write: |state, on| {
                if on {
                    fits(state, state.stream.get())?;
                    zero(state);
                }
                state.out.set_streaming(on);
                hello(state);
                Ok(())
            },
        },
        "frames from now on, or text; 0x18, a break and *RST end it, too",
    ),
    entry!(
        "STReam:CHANnels",
        Act::TakeAndSay(
            words!("<name>{,<name>} or ALL or DEFault"),
            |state, parameters| {
                let mut chosen = Channels::default();
                chosen = chosen.and(one(parameters)?);
                let mut more = *parameters;
                while more.next_text().is_some() {
                    chosen = chosen.and(one(parameters)?);
                    more = *parameters;
                }
                choose(state, Stream { channels: chosen, ..state.stream.get() })
            },
            |state, out| {
                for (n, channel) in state.stream.get().channels.iter().enumerate() {
                    out.text(if n > 0 { "," } else { "" }).text(channel.name);
                }
                Ok(())
            },
        ),
        "what a row carries",
    ),
    entry!("STReam:CHANnels:LIST", Act::List(List::Channels), "all channels"),
    entry!(
        "STReam:DECimation",
        Act::Number {
            range: const { &Range::new(Quantity::PLAIN, 1.0, 1000.0, 1.0) },
            read: |state| f64::from(state.stream.get().decimation),
            write: |state, every| choose(
                state,
                Stream { decimation: crate::maths::to_u32(crate::maths::round(every)), ..state.stream.get() }
            ),
        },
        "rows of 1 kHz in one of the line",
    ),
    entry!("STReam:LOAD", Act::Ask("PCT", |state| Ok(100.0 * load(state, state.stream.get()))), "what the choice takes of the line"),
];

fn one(parameters: &mut Parameters<'_>) -> Result<Channels, ErrorEntry> {
    let name = parameters.text()?;
    if name.eq_ignore_ascii_case(b"ALL") {
        return Ok(Channels::ALL);
    }
    if name.eq_ignore_ascii_case(b"DEF") || name.eq_ignore_ascii_case(b"DEFAULT") {
        return Ok(Channels::USUAL);
    }
    core::str::from_utf8(name).ok().and_then(Channels::named).ok_or_else(|| {
        let mut wrong = ErrorEntry::about(Code::ILLEGAL_VALUE, name);
        wrong.detail.writer().words(words!(": STReam:CHANnels:LIST? has the names"));
        wrong
    })
}

/// The share of the line that a choice takes; a byte is ten bits.
fn load(state: &State<'_>, stream: Stream) -> f64 {
    let bytes_s = f64::from(stream.channels.frame_bytes()) * ROW_HZ as f64 / f64::from(stream.decimation.max(1));
    bytes_s / (f64::from(state.identity.baud) * 0.1)
}

fn fits(state: &State<'_>, stream: Stream) -> Done {
    let load = load(state, stream);
    if load <= SHARE {
        return Ok(());
    }
    let mut wrong = ErrorEntry::new(Code::LINE_TOO_SLOW);
    let mut out = wrong.detail.writer();
    out.fixed(100.0 * load, 1)
        .text(" % of ")
        .whole(u64::from(state.identity.baud), 1)
        .words(words!(" baud, 80 % is the most: fewer channels or more decimation"));
    Err(wrong)
}

fn choose(state: &State<'_>, stream: Stream) -> Done {
    fits(state, stream)?;
    state.stream.set(stream);
    hello(state);
    Ok(())
}

/// The stream's angles are from the index if it was seen; within a stream their zero does not move.
fn zero(state: &State<'_>) {
    let row = state.row.get();
    let half_count_rad = 0.5 * state.hardware.rad_per_count();
    state.to_index_rad.set(row.from_index_rad.map(|from_index_rad| from_index_rad - half_count_rad - row.theta_rad));
}

/// Tells a receiver what the rows are from now on.
fn hello(state: &State<'_>) {
    if !state.out.is_streaming() {
        return;
    }
    let mut identity = Text::<100>::default();
    super::common::identity(state, &mut identity.writer());
    let stream = state.stream.get();
    state.out.frame(&Body::Hello(Hello {
        protocol: PROTOCOL,
        identity: identity.as_str(),
        counts_per_turn: state.hardware.counts_per_turn,
        row_Hz: ROW_HZ as u16,
        decimation: stream.decimation as u16,
        channels: stream.channels.0,
        zero_is_index: state.to_index_rad.get().is_some(),
    }));
}

/// A channel: name, how it is sent.
pub(super) fn channel_line(line: usize, out: &mut Writer<'_>) -> Option<()> {
    let channel = CHANNELS.get(line)?;
    let coding = match channel.coding {
        Coding::Single => "single precision",
        Coding::Nano => "whole numbers of 1E-9",
        Coding::Whole => "whole numbers",
    };
    out.text(channel.name).text(": ").text(coding);
    Some(())
}
