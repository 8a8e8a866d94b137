//! The log channel in the chip's memory (SEGGER RTT): a ring that the firmware writes and a debugger reads.

use crate::soc::RAM;

/// Offset of the first up-channel in the control block, and of the fields in it.
const CHANNEL: usize = 24;
const BUFFER: usize = CHANNEL + 4;
const SIZE: usize = CHANNEL + 8;
const WRITE: usize = CHANNEL + 12;
const READ: usize = CHANNEL + 16;

/// Reads what the firmware has written since the last call. `control_block`: address of `_SEGGER_RTT`; damaged pointers give nothing.
pub fn drain(ram: &mut [u8], control_block: u32, log: &mut Vec<u8>) {
    let base = control_block.wrapping_sub(RAM) as usize;
    let word = |ram: &[u8], offset: usize| {
        ram.get(base + offset..base + offset + 4).map_or(0, |bytes| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte)))
    };
    let (buffer, size) = (word(ram, BUFFER).wrapping_sub(RAM) as usize, word(ram, SIZE) as usize);
    let (write, mut read) = (word(ram, WRITE) as usize, word(ram, READ) as usize);
    if size == 0 || write >= size || read >= size || buffer.saturating_add(size) > ram.len() {
        return;
    }
    while read != write {
        log.push(ram[buffer + read]);
        read = (read + 1) % size;
    }
    if let Some(place) = ram.get_mut(base + READ..base + READ + 4) {
        place.copy_from_slice(&(read as u32).to_le_bytes());
    }
}
