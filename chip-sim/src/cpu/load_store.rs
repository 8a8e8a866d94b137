//! Loads and stores with 32-bit encodings (A5.3.5 to A5.3.10).

use super::alu::{bit, sign_extend};
use super::thumb32::undefined;
use super::{Bus, Core, Step, Width};

impl Core {
    /// LDM, STM, PUSH, POP.
    pub(super) fn load_store_multiple<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        let n = h & 15;
        let (load, write_back) = (bit(h, 4), bit(h, 5));
        let size = 4 * l.count_ones();
        let base = self.r[n as usize];
        let (mut address, end) = match h >> 7 & 3 {
            1 => (base, base.wrapping_add(size)),
            2 => (base.wrapping_sub(size), base.wrapping_sub(size)),
            _ => return Err(undefined(h, l)),
        };
        let mut target = None;
        for k in (0..16).filter(|k| bit(l, *k)) {
            if !load {
                bus.write(address, Width::Word, self.r[k as usize]);
            } else if k == 15 {
                target = Some(bus.read(address, Width::Word));
            } else {
                self.r[k as usize] = bus.read(address, Width::Word);
            }
            address = address.wrapping_add(4);
            self.extra_cycles += 1;
        }
        if write_back && !(load && bit(l, n)) {
            self.r[n as usize] = end;
        }
        target.map_or(Ok(()), |target| self.branch_exchange(target))
    }

    /// LDRD, STRD, exclusive accesses, table branches.
    pub(super) fn load_store_dual_exclusive<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        if h & 0x120 == 0 {
            return if bit(h, 7) { self.exclusive_or_table(bus, h, l) } else { self.exclusive_word(bus, h, l) };
        }
        let n = h & 15;
        let (t, t2) = ((l >> 12) as usize, (l >> 8 & 15) as usize);
        let base = if n == 15 { self.literal_base() } else { self.r[n as usize] };
        let offset = (l & 0xFF) * 4;
        let moved = if bit(h, 7) { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        let address = if bit(h, 8) { moved } else { base };
        self.extra_cycles = 2;
        if bit(h, 4) {
            let (first, second) = (bus.read(address, Width::Word), bus.read(address.wrapping_add(4), Width::Word));
            self.r[t] = first;
            self.r[t2] = second;
        } else {
            bus.write(address, Width::Word, self.r[t]);
            bus.write(address.wrapping_add(4), Width::Word, self.r[t2]);
        }
        if bit(h, 5) {
            self.r[n as usize] = moved;
        }
        Ok(())
    }

    /// LDREX, STREX.
    fn exclusive_word<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        let address = self.r[(h & 15) as usize].wrapping_add((l & 0xFF) * 4);
        self.exclusive_access(bus, bit(h, 4), address, Width::Word, (l >> 12) as usize, (l >> 8 & 15) as usize);
        Ok(())
    }

    /// TBB, TBH, exclusive accesses of bytes and halfwords.
    fn exclusive_or_table<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        let base = self.register(h & 15);
        let load = bit(h, 4);
        match l >> 4 & 15 {
            wide @ (0 | 1) if load => {
                let index = self.r[(l & 15) as usize];
                let offset = if wide == 1 {
                    bus.read(base.wrapping_add(index << 1), Width::Half)
                } else {
                    bus.read(base.wrapping_add(index), Width::Byte)
                };
                self.extra_cycles = 1;
                self.next_pc = self.pc_operand().wrapping_add(offset << 1);
            }
            4 => self.exclusive_access(bus, load, base, Width::Byte, (l >> 12) as usize, (l & 15) as usize),
            5 => self.exclusive_access(bus, load, base, Width::Half, (l >> 12) as usize, (l & 15) as usize),
            _ => return Err(undefined(h, l)),
        }
        Ok(())
    }

    fn exclusive_access<B: Bus>(&mut self, bus: &mut B, load: bool, address: u32, width: Width, t: usize, d: usize) {
        self.extra_cycles = 1;
        if load {
            self.exclusive = Some(address);
            self.r[t] = bus.read(address, width);
        } else {
            let held = self.exclusive.take() == Some(address);
            if held {
                bus.write(address, width, self.r[t]);
            }
            self.r[d] = u32::from(!held);
        }
    }

    /// Loads and stores of one byte, halfword or word.
    #[inline]
    pub(super) fn load_store_single<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        let (n, t) = (h & 15, l >> 12);
        let (load, signed) = (bit(h, 4), bit(h, 8));
        let width = match h >> 5 & 3 {
            0 => Width::Byte,
            1 => Width::Half,
            2 => Width::Word,
            _ => return Err(undefined(h, l)),
        };
        if load && t == 15 && width != Width::Word {
            // PLD, PLI and the reserved hints beside them.
            return Ok(());
        }
        let mut write_back = None;
        let address = if n == 15 {
            let base = self.literal_base();
            if bit(h, 7) { base.wrapping_add(l & 0xFFF) } else { base.wrapping_sub(l & 0xFFF) }
        } else {
            let base = self.r[n as usize];
            if bit(h, 7) {
                base.wrapping_add(l & 0xFFF)
            } else if !bit(l, 11) {
                base.wrapping_add(self.r[(l & 15) as usize] << (l >> 4 & 3))
            } else {
                let moved = if bit(l, 9) { base.wrapping_add(l & 0xFF) } else { base.wrapping_sub(l & 0xFF) };
                write_back = bit(l, 8).then_some(moved);
                if bit(l, 10) { moved } else { base }
            }
        };
        self.extra_cycles = 1;
        if !load {
            bus.write(address, width, self.r[t as usize]);
        }
        let value = if load { bus.read(address, width) } else { 0 };
        if let Some(moved) = write_back {
            self.r[n as usize] = moved;
        }
        if !load {
            return Ok(());
        }
        self.write_loaded(t, if signed { sign_extend(value, 8 * width.bytes()) } else { value })
    }
}
