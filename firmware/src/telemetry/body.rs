//! The body of a frame in postcard's format (the wire format 1.0 of the `postcard` crate), which the receiver's side reads with that crate.
//!
//! Fields in their order; whole numbers of more than a byte as varints, signed ones zigzagged before; floats as they are, low byte first; text with
//! its length. Written here because the crate's serialiser indexes its buffers, and what indexes can panic as far as the compiler can see
//! (scripts/callgraph.py).

use super::channel::{CHANNELS, Coding};
use super::frame::{Beat, Body, Hello, RowFrame};

/// Writes a body to the beginning of `space`; how many bytes. `None` if they do not fit.
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
        self.whole(row.channels.0.into())?;
        for (bit, (channel, value)) in CHANNELS.iter().zip(row.values).enumerate() {
            if row.channels.0 >> bit & 1 == 0 {
                continue;
            }
            match channel.coding {
                Coding::Single => self.bytes(&(value as f32).to_le_bytes())?,
                Coding::Nano if value.is_nan() => self.signed(i64::MIN)?,
                // A cast saturates: no angle of a stand gets there.
                Coding::Nano => self.signed(crate::maths::to_i64(crate::maths::round(value * 1e9)))?,
                Coding::Whole => self.whole(crate::maths::to_u32(value).into())?,
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
