//! What leaves the stand while it runs: rows of chosen channels, in frames that a damaged byte cannot pass for.
//!
//! [`frame`] is the wire: what a frame is, how it is made, and how a receiver finds it again (the host uses the same code). [`channel`] is
//! the list of what a row can carry, and what a choice of it costs on the line.

pub mod channel;
pub mod frame;

#[cfg(test)]
mod tests;

pub use channel::{CHANNELS, Channels};
pub use frame::{Beat, Body, Deframer, Frame, Hello, RowFrame, encode};

/// CRC-32/ISO-HDLC (zlib's) of some bytes: of frames, of command lines, of records in flash.
pub fn crc32(bytes: &[u8]) -> u32 {
    CRC.checksum(bytes)
}

const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
