//! Telemetry: rows of selected channels and text, in frames with a check sum.
//!
//! [`channel`] is the table of all channels; [`message`] has the contents of frames; [`frame`] puts a message into a frame and finds frames
//! in a received stream. The host uses the same code.

pub mod channel;
mod codec;
pub mod frame;
pub mod message;
mod stuffing;

#[cfg(test)]
mod tests;

pub use channel::{CHANNELS, Channel, Channels};
pub use frame::{Deframer, Frame, encode};
pub use message::{Beat, Body, Hello, RowFrame};

/// CRC-32/ISO-HDLC (as in zlib) of frames, command lines, and records in flash.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

/// The host uses a table of 1 KiB. The chip computes bit by bit: about 40 cycles per byte, an estimated 2 % of the core at a full line.
#[cfg(not(target_os = "none"))]
const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
#[cfg(target_os = "none")]
const CRC: crc::Crc<u32, crc::NoTable> = crc::Crc::<u32, crc::NoTable>::new(&crc::CRC_32_ISO_HDLC);
