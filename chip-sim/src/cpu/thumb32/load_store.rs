//! Loads and stores of 32-bit instructions (A5.3.5 to A5.3.10).
use super::super::alu::{bit, sign_extend};
use super::super::{Bus, Core, Outcome, REFILL_CYCLES, Width};
use super::{bad_register, undefined};

impl Core {
    /// LDM, STM, LDMDB, STMDB, PUSH.W, POP.W (A5.3.5).
    pub(super) fn load_store_multiple<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        let (n, load, list, count) = (first & 15, bit(first, 4), second, second.count_ones());
        let writes_back = bit(first, 5);
        let base = self.r[n as usize];
        if n == 15 || count < 2 || bit(list, 13) || writes_back && bit(list, n) || !load && bit(list, 15) || list >> 14 == 3 {
            return undefined(first, second);
        }
        let (mut address, end) = match first >> 7 & 3 {
            1 => (base, base.wrapping_add(4 * count)),
            2 => (base.wrapping_sub(4 * count), base.wrapping_sub(4 * count)),
            _ => return undefined(first, second),
        };
        let mut target = None;
        for k in 0..16 {
            if bit(list, k) {
                if !load {
                    bus.write(address, Width::Word, self.r[k as usize]);
                } else if k == 15 {
                    target = Some(bus.read(address, Width::Word));
                } else {
                    self.r[k as usize] = bus.read(address, Width::Word);
                }
                address = address.wrapping_add(4);
            }
        }
        if writes_back {
            self.set_register(n, end);
        }
        match target {
            Some(target) => self.branch_exchange(target).map(|_| 1 + count + REFILL_CYCLES),
            None => Ok(1 + count),
        }
    }

    /// LDRD and STRD (A7.7.50, A7.7.166).
    pub(super) fn load_store_dual<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        let (n, t, t2, load) = (first & 15, second >> 12, second >> 8 & 15, bit(first, 4));
        let writes_back = bit(first, 5);
        if bad_register(t) || bad_register(t2) || load && t == t2 || writes_back && (n == 15 || n == t || n == t2) || n == 15 && !load {
            return undefined(first, second);
        }
        let (base, offset) = (self.base(n), (second & 0xff) * 4);
        let moved = if bit(first, 7) { base.wrapping_add(offset) } else { base.wrapping_sub(offset) };
        let address = if bit(first, 8) { moved } else { base };
        if load {
            let low = bus.read(address, Width::Word);
            self.r[t2 as usize] = bus.read(address.wrapping_add(4), Width::Word);
            self.r[t as usize] = low;
        } else {
            bus.write(address, Width::Word, self.r[t as usize]);
            bus.write(address.wrapping_add(4), Width::Word, self.r[t2 as usize]);
        }
        if writes_back {
            self.set_register(n, moved);
        }
        Ok(3)
    }

    /// LDREX, STREX and their byte and halfword forms; TBB and TBH (A5.3.6).
    pub(super) fn exclusive_and_table_branch<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        let (n, t, load) = (first & 15, second >> 12, bit(first, 4));
        if !bit(first, 7) {
            let address = self.register(n).wrapping_add((second & 0xff) * 4);
            let d = second >> 8 & 15;
            if n == 15 || bad_register(t) || if load { d != 15 } else { bad_register(d) || d == n || d == t } {
                return undefined(first, second);
            }
            return Ok(self.exclusive_access(bus, address, Width::Word, load, t, d));
        }
        match second >> 4 & 15 {
            kind @ (0 | 1) if load => {
                // TBB and TBH, A7.7.185
                let m = second & 15;
                if n == 13 || bad_register(m) {
                    return undefined(first, second);
                }
                let index = self.r[m as usize];
                let offset = if kind == 0 {
                    bus.read(self.register(n).wrapping_add(index), Width::Byte)
                } else {
                    bus.read(self.register(n).wrapping_add(index << 1), Width::Half)
                };
                self.branch_to(self.pc().wrapping_add(offset << 1)).map(|_| 2 + REFILL_CYCLES)
            }
            kind @ (4 | 5) => {
                let (d, width) = (second & 15, if kind == 4 { Width::Byte } else { Width::Half });
                if n == 15 || bad_register(t) || if load { d != 15 } else { bad_register(d) || d == n || d == t } {
                    return undefined(first, second);
                }
                Ok(self.exclusive_access(bus, self.r[n as usize], width, load, t, d))
            }
            _ => undefined(first, second),
        }
    }

    /// Load that sets the local monitor, or store that succeeds (status 0 in `d`) only while the monitor holds the address (A3.4.1).
    fn exclusive_access<B: Bus>(&mut self, bus: &mut B, address: u32, width: Width, load: bool, t: u32, d: u32) -> u32 {
        if load {
            self.exclusive = Some(address);
            self.r[(t & 15) as usize] = bus.read(address, width);
            return 2;
        }
        let held = self.exclusive == Some(address);
        if held {
            bus.write(address, width, self.r[(t & 15) as usize] & mask(width));
        }
        self.exclusive = None;
        self.r[(d & 15) as usize] = u32::from(!held);
        2
    }

    /// Loads, stores and preload hints of one register (A5.3.7 to A5.3.10).
    pub(super) fn load_store_single<B: Bus>(&mut self, bus: &mut B, first: u32, second: u32) -> Outcome {
        let (n, t) = (first & 15, second >> 12);
        let (load, signed) = (bit(first, 4), bit(first, 8));
        let width = match first >> 5 & 3 {
            0 => Width::Byte,
            1 => Width::Half,
            2 => Width::Word,
            _ => return undefined(first, second),
        };
        if signed && (!load || width == Width::Word) || n == 15 && !load {
            return undefined(first, second);
        }
        let base = self.base(n);
        let mut write_back = None;
        let mut register_offset = false;
        let address = if n == 15 {
            if bit(first, 7) { base.wrapping_add(second & 0xfff) } else { base.wrapping_sub(second & 0xfff) }
        } else if bit(first, 7) {
            base.wrapping_add(second & 0xfff)
        } else if !bit(second, 11) {
            if second & 0x7c0 != 0 || bad_register(second & 15) {
                return undefined(first, second);
            }
            register_offset = true;
            base.wrapping_add(self.r[(second & 15) as usize] << (second >> 4 & 3))
        } else {
            let moved = if bit(second, 9) { base.wrapping_add(second & 0xff) } else { base.wrapping_sub(second & 0xff) };
            let (pre_indexed, writes_back) = (bit(second, 10), bit(second, 8));
            if !pre_indexed && !writes_back || writes_back && n == t {
                return undefined(first, second);
            }
            if writes_back {
                write_back = Some(moved);
            }
            if pre_indexed { moved } else { base }
        };
        // Byte and halfword loads to R15 are PLD, PLI and unallocated hints (A5.3.8, A5.3.9).
        if load && t == 15 && width != Width::Word {
            return if write_back.is_some() { undefined(first, second) } else { Ok(1) };
        }
        if t == 15 && !load || t == 13 && width != Width::Word {
            return undefined(first, second);
        }
        if !load {
            bus.write(address, width, self.r[t as usize] & mask(width));
        }
        let value = if load { bus.read(address, width) } else { 0 };
        if let Some(moved) = write_back {
            self.set_register(n, moved);
        }
        if !load {
            return Ok(if register_offset { 2 } else { 1 });
        }
        if t == 15 {
            return self.branch_exchange(value).map(|_| 2 + REFILL_CYCLES);
        }
        self.set_register(t, if signed { sign_extend(value, 8 * width.bytes()) } else { value });
        Ok(2)
    }
}

/// The bits of a value that a store of `width` writes.
#[inline(always)]
fn mask(width: Width) -> u32 {
    match width {
        Width::Byte => 0xff,
        Width::Half => 0xffff,
        Width::Word => u32::MAX,
    }
}
