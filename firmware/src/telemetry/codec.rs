//! Encoding of a message in postcard's wire format 1.0, and decoding of rows.
//!
//! Fields in their order; integers of more than a byte as varints, signed ones in zigzag form; floats little-endian; text with its length.
//! The serialiser of the `postcard` crate is not used here, because the compiler cannot prove it free of panics (scripts/callgraph.py). The
//! receiver decodes with that crate.

use super::channel::{CHANNELS, Channels, Coding};
use super::message::{Beat, Body, Hello, RowFrame};
use core::fmt;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// Writes a message to the beginning of `space`; its length, or `None` if it does not fit.
pub fn write(body: &Body<'_>, space: &mut [u8]) -> Option<usize> {
    let mut out = Out { space, length: 0 };
    match body {
        Body::Hello(hello) => out.hello(hello)?,
        Body::Row(row) => out.row(row)?,
        Body::Text(text) => out.text(text)?,
        Body::Beat(beat) => out.beat(beat)?,
    }
    Some(out.length)
}

struct Out<'a> {
    space: &'a mut [u8],
    length: usize,
}

impl Out<'_> {
    fn hello(&mut self, hello: &Hello<'_>) -> Option<()> {
        self.byte(hello.protocol)?;
        self.text(hello.identity)?;
        self.bytes(&hello.counts_per_turn.to_le_bytes())?;
        self.whole(hello.row_Hz.into())?;
        self.whole(hello.decimation.into())?;
        self.whole(hello.channels.into())?;
        self.byte(hello.zero_is_index.into())
    }

    fn row(&mut self, row: &RowFrame) -> Option<()> {
        self.whole(row.sequence.into())?;
        self.whole(row.at)?;
        self.whole(row.channels.bits().into())?;
        for (channel, value) in row.iter() {
            match channel.coding {
                Coding::Single => self.bytes(&(value as f32).to_le_bytes())?,
                Coding::Nano if value.is_nan() => self.signed(i64::MIN)?,
                // The conversion saturates.
                Coding::Nano => self.signed(libm::round(value * 1e9) as i64)?,
                Coding::Whole => self.whole((value as u32).into())?,
            }
        }
        Some(())
    }

    fn beat(&mut self, beat: &Beat) -> Option<()> {
        self.whole(beat.at)?;
        self.whole(beat.lost.into())?;
        self.byte(beat.fault)
    }

    fn text(&mut self, text: &str) -> Option<()> {
        self.whole(text.len() as u64)?;
        self.bytes(text.as_bytes())
    }

    fn signed(&mut self, value: i64) -> Option<()> {
        self.whole((value << 1 ^ value >> 63) as u64)
    }

    fn whole(&mut self, mut value: u64) -> Option<()> {
        while value > 0x7f {
            self.byte(value as u8 | 0x80)?;
            value >>= 7;
        }
        self.byte(value as u8)
    }

    fn bytes(&mut self, bytes: &[u8]) -> Option<()> {
        bytes.iter().try_for_each(|byte| self.byte(*byte))
    }

    fn byte(&mut self, byte: u8) -> Option<()> {
        *self.space.get_mut(self.length)? = byte;
        self.length += 1;
        Some(())
    }
}

impl<'de> Deserialize<'de> for RowFrame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(3 + CHANNELS.len(), RowVisitor)
    }
}

struct RowVisitor;

impl<'de> Visitor<'de> for RowVisitor {
    type Value = RowFrame;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("number, time, channels and their values of a row")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<RowFrame, A::Error> {
        let short = || A::Error::custom("the row is incomplete");
        let sequence = parts.next_element()?.ok_or_else(short)?;
        let at = parts.next_element()?.ok_or_else(short)?;
        let channels = Channels::from_bits(parts.next_element()?.ok_or_else(short)?);
        let channels = channels.ok_or_else(|| A::Error::custom("the row has an unknown channel"))?;
        let mut values = [f64::NAN; CHANNELS.len()];
        for (index, channel) in channels.indexed() {
            let decoded = match channel.coding {
                Coding::Single => f64::from(parts.next_element::<f32>()?.ok_or_else(short)?),
                Coding::Nano => match parts.next_element::<i64>()?.ok_or_else(short)? {
                    i64::MIN => f64::NAN,
                    nano => nano as f64 / 1e9,
                },
                Coding::Whole => f64::from(parts.next_element::<u32>()?.ok_or_else(short)?),
            };
            if let Some(value) = values.get_mut(index) {
                *value = decoded;
            }
        }
        Ok(RowFrame { sequence, at, channels, values })
    }
}
