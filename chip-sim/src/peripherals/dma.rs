//! DMA1 and DMA2 (RM0390 §9): streams in direct mode, circular mode, half and complete flags.

/// Streams of a controller.
pub const STREAMS: usize = 8;
/// Positions of a stream's flags in its half of LISR and HISR.
const SHIFTS: [u32; 4] = [0, 6, 16, 22];
const CR_EN: u32 = 1;
const CR_CIRC: u32 = 1 << 8;
const FLAG_TCIF: u32 = 1 << 5;
const FLAG_HTIF: u32 = 1 << 4;

/// One stream.
#[derive(Clone, Copy, Default)]
struct Stream {
    cr: u32,
    ndtr: u32,
    par: u32,
    memory: [u32; 2],
    fcr: u32,
    /// Items of the whole transfer, and items done.
    length: u32,
    done: u32,
}

/// A transfer that a request starts: one item between a register and memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Item {
    /// The peripheral's register.
    pub register: u32,
    /// Address in memory.
    pub memory: u32,
    /// Bytes.
    pub bytes: u32,
    /// From memory to the register.
    pub to_peripheral: bool,
}

/// One controller.
#[derive(Default)]
pub struct Dma {
    isr: [u32; 2],
    streams: [Stream; STREAMS],
    /// Items moved by each stream.
    pub items: [u64; STREAMS],
}

impl Dma {
    /// Registers as after a reset.
    pub fn reset(&mut self) {
        *self = Self { items: self.items, ..Self::default() };
    }

    /// Channel, direction (true: to the peripheral) and register of an enabled stream.
    #[inline]
    pub fn request(&self, stream: usize) -> Option<(u32, bool, u32)> {
        let s = &self.streams[stream];
        (s.cr & CR_EN != 0 && s.ndtr != 0).then_some((s.cr >> 25 & 7, s.cr >> 6 & 3 == 1, s.par))
    }

    /// The next item of a stream, which then counts as moved.
    pub fn take(&mut self, stream: usize) -> Item {
        let s = &mut self.streams[stream];
        let bytes = 1 << (s.cr >> 13 & 3);
        let increments = s.cr >> 10 & 1;
        let item = Item {
            register: s.par,
            memory: s.memory[0].wrapping_add(s.done * increments * bytes),
            bytes,
            to_peripheral: s.cr >> 6 & 3 == 1,
        };
        s.ndtr -= 1;
        s.done += 1;
        let mut flags = 0;
        if s.ndtr == s.length / 2 {
            flags |= FLAG_HTIF;
        }
        if s.ndtr == 0 {
            flags |= FLAG_TCIF;
            if s.cr & CR_CIRC != 0 {
                s.ndtr = s.length;
                s.done = 0;
            } else {
                s.cr &= !CR_EN;
            }
        }
        self.isr[stream / 4] |= flags << SHIFTS[stream % 4];
        self.items[stream] += 1;
        item
    }

    /// Whether any flag of the controller is set.
    #[inline]
    pub fn has_flags(&self) -> bool {
        self.isr != [0; 2]
    }

    /// The interrupt line of a stream.
    pub fn is_pending(&self, stream: usize) -> bool {
        let flags = self.isr[stream / 4] >> SHIFTS[stream % 4];
        let cr = self.streams[stream].cr;
        // TCIE, HTIE, TEIE, DMEIE are bits 4 to 1; their flags bits 5, 4, 3, 2.
        (flags >> 1) & cr & 0x1E != 0
    }

    /// A register; `None`: not modelled.
    pub fn read(&self, offset: u32) -> Option<u32> {
        if let 0x00 | 0x04 = offset {
            return Some(self.isr[offset as usize / 4]);
        }
        if let 0x08 | 0x0C = offset {
            return Some(0);
        }
        let at = offset.checked_sub(0x10)?;
        let s = self.streams.get(at as usize / 0x18)?;
        Some(match at % 0x18 {
            0x00 => s.cr,
            0x04 => s.ndtr,
            0x08 => s.par,
            0x0C => s.memory[0],
            0x10 => s.memory[1],
            _ => s.fcr,
        })
    }

    /// Writes a register; `None`: not modelled (memory to memory, double buffers, bursts and unequal widths included).
    pub fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        if let 0x08 | 0x0C = offset {
            self.isr[(offset as usize - 8) / 4] &= !value;
            return Some(());
        }
        let at = offset.checked_sub(0x10)?;
        let s = self.streams.get_mut(at as usize / 0x18)?;
        let enabled = s.cr & CR_EN != 0;
        match at % 0x18 {
            0x00 => {
                let widths_differ = value >> 11 & 3 != value >> 13 & 3;
                let unusual = value >> 6 & 3 == 2 || value & 1 << 18 != 0 || value >> 21 & 15 != 0 || widths_differ;
                if value & CR_EN != 0 && unusual {
                    return None;
                }
                if value & !s.cr & CR_EN != 0 {
                    s.length = s.ndtr;
                    s.done = 0;
                }
                s.cr = value & 0x0FEF_FFFF;
            }
            // Length and addresses are fixed while the stream is enabled (RM0390 §9.5.6).
            0x04 if !enabled => s.ndtr = value & 0xFFFF,
            0x08 if !enabled => s.par = value,
            0x0C if !enabled => s.memory[0] = value,
            0x10 => s.memory[1] = value,
            0x14 => s.fcr = value & 0xFF,
            _ => {}
        }
        Some(())
    }
}
