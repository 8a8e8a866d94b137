//! 16-bit instructions (A5.2). `set_flags` is false inside an IT block.
use super::alu::{bit, shift, shift_immediate, sign_extend};
use super::{Bus, Core, Event, Outcome, REFILL_CYCLES, Width};

impl Core {
    #[inline]
    pub(super) fn thumb16<B: Bus>(&mut self, bus: &mut B, h: u32, set_flags: bool) -> Outcome {
        match h >> 12 {
            0 | 1 => Ok(self.shift_add_subtract(h, set_flags)),
            2 | 3 => Ok(self.immediate_8(h, set_flags)),
            4 if bit(h, 11) => {
                // LDR (literal), A7.7.44
                self.r[(h >> 8 & 7) as usize] = bus.read(self.base(15).wrapping_add((h & 0xff) * 4), Width::Word);
                Ok(2)
            }
            4 if bit(h, 10) => self.high_registers(h),
            4 => Ok(self.data_processing_16(h, set_flags)),
            5 => Ok(self.load_store_register(bus, h)),
            6..=8 => Ok(self.load_store_immediate(bus, h)),
            9 => {
                // STR and LDR (immediate) relative to SP, A7.7.161 and A7.7.43
                let (t, address) = ((h >> 8 & 7) as usize, self.r[13].wrapping_add((h & 0xff) * 4));
                if bit(h, 11) {
                    self.r[t] = bus.read(address, Width::Word);
                    return Ok(2);
                }
                bus.write(address, Width::Word, self.r[t]);
                Ok(1)
            }
            10 => {
                // ADR and ADD (SP plus immediate), A7.7.7 and A7.7.5
                let base = if bit(h, 11) { self.r[13] } else { self.base(15) };
                self.r[(h >> 8 & 7) as usize] = base.wrapping_add((h & 0xff) * 4);
                Ok(1)
            }
            11 => self.miscellaneous_16(bus, h),
            12 => self.load_store_multiple_16(bus, h),
            13 => match h >> 8 & 15 {
                14 => Err(Event::Undefined(h)),
                15 => Err(Event::SupervisorCall(h as u8)),
                condition if self.condition(condition) => self.branch_to(self.pc().wrapping_add(sign_extend(h & 0xff, 8) << 1)),
                _ => Ok(1),
            },
            // B, encoding T2, A7.7.12; 32-bit encodings do not come here.
            _ => self.branch_to(self.pc().wrapping_add(sign_extend(h & 0x7ff, 11) << 1)),
        }
    }

    /// Shift (immediate), ADD and SUB of register or three-bit immediate (A5.2.1).
    fn shift_add_subtract(&mut self, h: u32, set_flags: bool) -> u32 {
        let (d, operand) = ((h & 7) as usize, self.r[(h >> 3 & 7) as usize]);
        let kind = h >> 11 & 3;
        if kind == 3 {
            let field = h >> 6 & 7;
            let addend = if bit(h, 10) { field } else { self.r[field as usize] };
            self.r[d] = if bit(h, 9) { self.add(operand, !addend, true, set_flags) } else { self.add(operand, addend, false, set_flags) };
            return 1;
        }
        let (value, carry) = shift_immediate(operand, kind, h >> 6 & 31, self.carry);
        if set_flags {
            self.set_nz(value);
            self.carry = carry;
        }
        self.r[d] = value;
        1
    }

    /// MOV, CMP, ADD, SUB of an eight-bit immediate (A5.2.1).
    fn immediate_8(&mut self, h: u32, set_flags: bool) -> u32 {
        let (d, immediate) = ((h >> 8 & 7) as usize, h & 0xff);
        let operand = self.r[d];
        match h >> 11 & 3 {
            0 => {
                self.r[d] = immediate;
                if set_flags {
                    self.set_nz(immediate);
                }
            }
            1 => {
                self.add(operand, !immediate, true, true);
            }
            2 => self.r[d] = self.add(operand, immediate, false, set_flags),
            _ => self.r[d] = self.add(operand, !immediate, true, set_flags),
        }
        1
    }

    /// Data processing of low registers (A5.2.2).
    fn data_processing_16(&mut self, h: u32, set_flags: bool) -> u32 {
        let d = (h & 7) as usize;
        let (a, b) = (self.r[d], self.r[(h >> 3 & 7) as usize]);
        let value = match h >> 6 & 15 {
            0 => a & b,
            1 => a ^ b,
            opcode @ (2 | 3 | 4 | 7) => {
                let kind = if opcode == 7 { 3 } else { opcode - 2 };
                let (value, carry) = shift(a, kind, b & 0xff, self.carry);
                if set_flags {
                    self.carry = carry;
                }
                value
            }
            5 => {
                self.r[d] = self.add(a, b, self.carry, set_flags);
                return 1;
            }
            6 => {
                self.r[d] = self.add(a, !b, self.carry, set_flags);
                return 1;
            }
            8 => {
                self.set_nz(a & b);
                return 1;
            }
            9 => {
                self.r[d] = self.add(!b, 0, true, set_flags);
                return 1;
            }
            10 => {
                self.add(a, !b, true, true);
                return 1;
            }
            11 => {
                self.add(a, b, false, true);
                return 1;
            }
            12 => a | b,
            13 => a.wrapping_mul(b),
            14 => a & !b,
            _ => !b,
        };
        self.r[d] = value;
        if set_flags {
            self.set_nz(value);
        }
        1
    }

    /// ADD, CMP, MOV of all registers, BX, BLX (A5.2.3).
    fn high_registers(&mut self, h: u32) -> Outcome {
        let d = h & 7 | h >> 4 & 8;
        let operand = self.register(h >> 3 & 15);
        let result = match h >> 8 & 3 {
            0 => self.register(d).wrapping_add(operand),
            1 => {
                self.add(self.register(d), !operand, true, true);
                return Ok(1);
            }
            2 => operand,
            _ => {
                if h & 7 != 0 || h >> 3 & 15 == 15 {
                    return Err(Event::Undefined(h));
                }
                if bit(h, 7) {
                    self.r[14] = self.next_pc | 1;
                }
                return self.branch_exchange(operand);
            }
        };
        if d == 15 {
            return self.branch_to(result);
        }
        self.set_register(d, result);
        Ok(1)
    }

    /// Load and store with a register offset (A5.2.4, 0b0101).
    fn load_store_register<B: Bus>(&mut self, bus: &mut B, h: u32) -> u32 {
        let address = self.r[(h >> 3 & 7) as usize].wrapping_add(self.r[(h >> 6 & 7) as usize]);
        let t = (h & 7) as usize;
        match h >> 9 & 7 {
            0 => bus.write(address, Width::Word, self.r[t]),
            1 => bus.write(address, Width::Half, self.r[t] & 0xffff),
            2 => bus.write(address, Width::Byte, self.r[t] & 0xff),
            3 => self.r[t] = sign_extend(bus.read(address, Width::Byte), 8),
            4 => self.r[t] = bus.read(address, Width::Word),
            5 => self.r[t] = bus.read(address, Width::Half),
            6 => self.r[t] = bus.read(address, Width::Byte),
            _ => self.r[t] = sign_extend(bus.read(address, Width::Half), 16),
        }
        2
    }

    /// Load and store with an immediate offset (A5.2.4, 0b0110 to 0b1000).
    fn load_store_immediate<B: Bus>(&mut self, bus: &mut B, h: u32) -> u32 {
        let (width, mask) = match h >> 12 {
            6 => (Width::Word, u32::MAX),
            7 => (Width::Byte, 0xff),
            _ => (Width::Half, 0xffff),
        };
        let address = self.r[(h >> 3 & 7) as usize].wrapping_add((h >> 6 & 31) * width.bytes());
        let t = (h & 7) as usize;
        if bit(h, 11) {
            self.r[t] = bus.read(address, width);
            return 2;
        }
        // DDI 0439B section 3.3.2: a store with an immediate offset takes one cycle, its write is buffered.
        bus.write(address, width, self.r[t] & mask);
        1
    }

    /// Miscellaneous instructions (A5.2.5).
    fn miscellaneous_16<B: Bus>(&mut self, bus: &mut B, h: u32) -> Outcome {
        let (d, operand) = ((h & 7) as usize, self.r[(h >> 3 & 7) as usize]);
        match h >> 8 & 15 {
            0 => {
                let offset = (h & 0x7f) * 4;
                let stack = self.r[13];
                self.set_register(13, if bit(h, 7) { stack.wrapping_sub(offset) } else { stack.wrapping_add(offset) });
            }
            1 | 3 | 9 | 11 => {
                // CBZ and CBNZ, A7.7.21
                if (self.r[d] != 0) == bit(h, 11) {
                    return self.branch_to(self.pc().wrapping_add((h >> 3 & 31 | h >> 4 & 32) << 1));
                }
            }
            2 => {
                self.r[d] = match h >> 6 & 3 {
                    0 => sign_extend(operand & 0xffff, 16),
                    1 => sign_extend(operand & 0xff, 8),
                    2 => operand & 0xffff,
                    _ => operand & 0xff,
                };
            }
            4 | 5 => return self.push(bus, h),
            12 | 13 => return self.pop(bus, h),
            6 if h & 0xec == 0x60 => {
                // CPS, B5.2.1
                let masked = bit(h, 4);
                if bit(h, 1) {
                    self.primask = masked;
                }
                if bit(h, 0) {
                    self.faultmask = masked;
                }
            }
            10 => {
                self.r[d] = match h >> 6 & 3 {
                    0 => operand.swap_bytes(),
                    1 => operand.swap_bytes().rotate_right(16),
                    3 => sign_extend(operand.swap_bytes() >> 16, 16),
                    _ => return Err(Event::Undefined(h)),
                };
            }
            14 => return Err(Event::Breakpoint(h as u8)),
            15 if h & 15 != 0 => self.it_state = h as u8,
            15 => return self.hint(h >> 4 & 15),
            _ => return Err(Event::Undefined(h)),
        }
        Ok(1)
    }

    /// Hints NOP, YIELD, WFE, WFI, SEV (A5.2.5).
    pub(super) fn hint(&mut self, number: u32) -> Outcome {
        match number {
            2 => Err(Event::WaitForEvent),
            3 => Err(Event::WaitForInterrupt),
            4 => Err(Event::SendEvent),
            _ => Ok(1),
        }
    }

    /// PUSH, encoding T1 (A7.7.101).
    fn push<B: Bus>(&mut self, bus: &mut B, h: u32) -> Outcome {
        let list = h & 0xff | (h & 0x100) << 6;
        let count = list.count_ones();
        let mut address = self.r[13].wrapping_sub(4 * count);
        self.r[13] = address;
        for k in 0..15 {
            if bit(list, k) {
                bus.write(address, Width::Word, self.r[k as usize]);
                address = address.wrapping_add(4);
            }
        }
        if count == 0 { Err(Event::Undefined(h)) } else { Ok(1 + count) }
    }

    /// POP, encoding T1 (A7.7.99).
    fn pop<B: Bus>(&mut self, bus: &mut B, h: u32) -> Outcome {
        let count = (h & 0x1ff).count_ones();
        let mut address = self.r[13];
        for k in 0..8 {
            if bit(h, k) {
                self.r[k as usize] = bus.read(address, Width::Word);
                address = address.wrapping_add(4);
            }
        }
        if bit(h, 8) {
            let target = bus.read(address, Width::Word);
            self.r[13] = address.wrapping_add(4);
            return self.branch_exchange(target).map(|_| 1 + count + REFILL_CYCLES);
        }
        self.r[13] = address;
        if count == 0 { Err(Event::Undefined(h)) } else { Ok(1 + count) }
    }

    /// STM and LDM, encoding T1 (A7.7.159, A7.7.41).
    fn load_store_multiple_16<B: Bus>(&mut self, bus: &mut B, h: u32) -> Outcome {
        let (n, load) = (h >> 8 & 7, bit(h, 11));
        let mut address = self.r[n as usize];
        for k in 0..8 {
            if bit(h, k) {
                if load {
                    self.r[k as usize] = bus.read(address, Width::Word);
                } else {
                    bus.write(address, Width::Word, self.r[k as usize]);
                }
                address = address.wrapping_add(4);
            }
        }
        // A base in the list of a load keeps the loaded value.
        if !(load && bit(h, n)) {
            self.r[n as usize] = address;
        }
        let count = (h & 0xff).count_ones();
        if count == 0 { Err(Event::Undefined(h)) } else { Ok(1 + count) }
    }
}
