//! The 16-bit encodings (A5.2).

use super::alu::{bit, shift, shift_immediate, sign_extend};
use super::{Bus, Core, Event, LR, SP, Step, Width};

impl Core {
    /// Executes a 16-bit instruction; `flags`: outside an IT block, where most instructions set the flags.
    #[inline]
    pub(super) fn thumb16<B: Bus>(&mut self, bus: &mut B, code: u32, flags: bool) -> Step {
        match code >> 12 {
            0 | 1 => self.shift_add_subtract(code, flags),
            2 | 3 => self.immediate8(code, flags),
            4 => return self.group4(bus, code, flags),
            5 => self.load_store_register(bus, code),
            6..=9 => self.load_store_immediate(bus, code),
            10 => {
                // ADR, ADD (SP plus immediate)
                let base = if bit(code, 11) { self.r[SP] } else { self.literal_base() };
                self.r[(code >> 8 & 7) as usize] = base.wrapping_add((code & 0xFF) * 4);
            }
            11 => return self.miscellaneous16(bus, code),
            12 => self.load_store_multiple16(bus, code),
            13 => return self.conditional_branch16(code),
            14 => self.next_pc = self.pc_operand().wrapping_add(sign_extend(code & 0x7FF, 11) << 1),
            _ => return Err(Event::Undefined(code)),
        }
        Ok(())
    }

    /// Shift (immediate), add, subtract (A5.2.1).
    #[inline]
    fn shift_add_subtract(&mut self, code: u32, flags: bool) {
        let (d, n) = ((code & 7) as usize, (code >> 3 & 7) as usize);
        let field = code >> 6 & 7;
        match code >> 11 & 3 {
            3 => {
                let operand = if bit(code, 10) { field } else { self.r[field as usize] };
                let a = self.r[n];
                self.r[d] = if bit(code, 9) { self.add(a, !operand, true, flags) } else { self.add(a, operand, false, flags) };
            }
            kind => {
                let (value, carry) = shift_immediate(self.r[n], kind, code >> 6 & 31, self.carry);
                if flags {
                    self.set_nz(value);
                    self.carry = carry;
                }
                self.r[d] = value;
            }
        }
    }

    /// MOV, CMP, ADD, SUB with an immediate of 8 bits.
    #[inline]
    fn immediate8(&mut self, code: u32, flags: bool) {
        let d = (code >> 8 & 7) as usize;
        let immediate = code & 0xFF;
        let a = self.r[d];
        match code >> 11 & 3 {
            0 => {
                self.r[d] = immediate;
                if flags {
                    self.set_nz(immediate);
                }
            }
            1 => _ = self.add(a, !immediate, true, true),
            2 => self.r[d] = self.add(a, immediate, false, flags),
            _ => self.r[d] = self.add(a, !immediate, true, flags),
        }
    }

    /// Literal loads, high registers and BX, data processing.
    #[inline]
    fn group4<B: Bus>(&mut self, bus: &mut B, code: u32, flags: bool) -> Step {
        if bit(code, 11) {
            self.extra_cycles = 1;
            self.r[(code >> 8 & 7) as usize] = bus.read(self.literal_base().wrapping_add((code & 0xFF) * 4), Width::Word);
            return Ok(());
        }
        if bit(code, 10) { self.high_registers(code) } else { self.data_processing16(code, flags) }
    }

    /// Special data instructions and branch and exchange (A5.2.3).
    #[inline]
    fn high_registers(&mut self, code: u32) -> Step {
        let d = code & 7 | code >> 4 & 8;
        let m = code >> 3 & 15;
        let value = self.register(m);
        match code >> 8 & 3 {
            0 => {
                let sum = self.register(d).wrapping_add(value);
                self.write_register(d, sum)
            }
            1 => {
                let a = self.register(d);
                self.add(a, !value, true, true);
                Ok(())
            }
            2 => self.write_register(d, value),
            _ => {
                if bit(code, 7) {
                    self.r[LR] = self.next_pc | 1;
                }
                self.branch_exchange(value)
            }
        }
    }

    /// Data processing (A5.2.2).
    #[inline]
    fn data_processing16(&mut self, code: u32, flags: bool) -> Step {
        let d = (code & 7) as usize;
        let (a, b) = (self.r[d], self.r[(code >> 3 & 7) as usize]);
        let logical = match code >> 6 & 15 {
            0 => a & b,
            1 => a ^ b,
            kind @ (2..=4 | 7) => {
                let (value, carry) = shift(a, if kind == 7 { 3 } else { kind - 2 }, b & 0xFF, self.carry);
                if flags {
                    self.carry = carry;
                }
                value
            }
            5 => {
                self.r[d] = self.add(a, b, self.carry, flags);
                return Ok(());
            }
            6 => {
                self.r[d] = self.add(a, !b, self.carry, flags);
                return Ok(());
            }
            8 => {
                self.set_nz(a & b); // TST
                return Ok(());
            }
            9 => {
                self.r[d] = self.add(!b, 0, true, flags); // RSB #0
                return Ok(());
            }
            10 => {
                self.add(a, !b, true, true); // CMP
                return Ok(());
            }
            11 => {
                self.add(a, b, false, true); // CMN
                return Ok(());
            }
            12 => a | b,
            13 => a.wrapping_mul(b),
            14 => a & !b,
            _ => !b,
        };
        if flags {
            self.set_nz(logical);
        }
        self.r[d] = logical;
        Ok(())
    }

    /// Loads and stores with a register offset.
    #[inline]
    fn load_store_register<B: Bus>(&mut self, bus: &mut B, code: u32) {
        let address = self.r[(code >> 3 & 7) as usize].wrapping_add(self.r[(code >> 6 & 7) as usize]);
        let t = (code & 7) as usize;
        self.extra_cycles = 1;
        match code >> 9 & 7 {
            0 => bus.write(address, Width::Word, self.r[t]),
            1 => bus.write(address, Width::Half, self.r[t]),
            2 => bus.write(address, Width::Byte, self.r[t]),
            3 => self.r[t] = sign_extend(bus.read(address, Width::Byte), 8),
            4 => self.r[t] = bus.read(address, Width::Word),
            5 => self.r[t] = bus.read(address, Width::Half),
            6 => self.r[t] = bus.read(address, Width::Byte),
            _ => self.r[t] = sign_extend(bus.read(address, Width::Half), 16),
        }
    }

    /// Loads and stores with an immediate offset, from a register or the stack pointer.
    #[inline]
    fn load_store_immediate<B: Bus>(&mut self, bus: &mut B, code: u32) {
        let (width, t, address) = match code >> 12 {
            9 => (Width::Word, code >> 8 & 7, self.r[SP].wrapping_add((code & 0xFF) * 4)),
            group => {
                let width = match group {
                    6 => Width::Word,
                    7 => Width::Byte,
                    _ => Width::Half,
                };
                (width, code & 7, self.r[(code >> 3 & 7) as usize].wrapping_add((code >> 6 & 31) * width.bytes()))
            }
        };
        self.extra_cycles = 1;
        if bit(code, 11) {
            self.r[t as usize] = bus.read(address, width);
        } else {
            bus.write(address, width, self.r[t as usize]);
        }
    }

    /// LDM and STM.
    fn load_store_multiple16<B: Bus>(&mut self, bus: &mut B, code: u32) {
        let n = code >> 8 & 7;
        let mut address = self.r[n as usize];
        let load = bit(code, 11);
        for k in (0..8).filter(|k| bit(code, *k)) {
            if load {
                self.r[k as usize] = bus.read(address, Width::Word);
            } else {
                bus.write(address, Width::Word, self.r[k as usize]);
            }
            address = address.wrapping_add(4);
            self.extra_cycles += 1;
        }
        // A loaded base is not written back.
        if !(load && bit(code, n)) {
            self.r[n as usize] = address;
        }
    }

    /// B with a condition, SVC.
    #[inline]
    fn conditional_branch16(&mut self, code: u32) -> Step {
        match code >> 8 & 15 {
            14 => return Err(Event::Undefined(code)),
            15 => return Err(Event::SupervisorCall(code as u8)),
            condition => {
                if self.condition(condition) {
                    self.next_pc = self.pc_operand().wrapping_add(sign_extend(code & 0xFF, 8) << 1);
                }
            }
        }
        Ok(())
    }

    /// Miscellaneous (A5.2.5).
    #[inline]
    fn miscellaneous16<B: Bus>(&mut self, bus: &mut B, code: u32) -> Step {
        let (d, n) = ((code & 7) as usize, (code >> 3 & 7) as usize);
        match code >> 8 & 15 {
            0 => {
                let offset = (code & 0x7F) * 4;
                self.r[SP] = if bit(code, 7) { self.r[SP].wrapping_sub(offset) } else { self.r[SP].wrapping_add(offset) };
            }
            1 | 3 | 9 | 11 => {
                // CBZ, CBNZ
                if (self.r[d] != 0) == bit(code, 11) {
                    self.next_pc = self.pc_operand().wrapping_add((code >> 3 & 31 | code >> 4 & 32) << 1);
                }
            }
            2 => {
                let value = self.r[n];
                self.r[d] = match code >> 6 & 3 {
                    0 => sign_extend(value & 0xFFFF, 16),
                    1 => sign_extend(value & 0xFF, 8),
                    2 => value & 0xFFFF,
                    _ => value & 0xFF,
                };
            }
            4 | 5 => self.push16(bus, code),
            12 | 13 => return self.pop16(bus, code),
            6 if code & 0xE8 == 0x60 => {
                // CPS
                let masked = bit(code, 4);
                if bit(code, 1) {
                    self.primask = masked;
                }
                if bit(code, 0) {
                    self.faultmask = masked;
                }
            }
            10 => {
                let value = self.r[n];
                self.r[d] = match code >> 6 & 3 {
                    0 => value.swap_bytes(),
                    1 => value.swap_bytes().rotate_right(16),
                    3 => sign_extend(value.swap_bytes() >> 16, 16),
                    _ => return Err(Event::Undefined(code)),
                };
            }
            14 => return Err(Event::Breakpoint(code as u8)),
            15 if code & 15 != 0 => self.it_state = code as u8,
            15 => return hint(code >> 4 & 15),
            _ => return Err(Event::Undefined(code)),
        }
        Ok(())
    }

    fn push16<B: Bus>(&mut self, bus: &mut B, code: u32) {
        let list = code & 0xFF | (code & 0x100) << 6;
        let mut address = self.r[SP].wrapping_sub(4 * list.count_ones());
        self.r[SP] = address;
        for k in (0..15).filter(|k| bit(list, *k)) {
            bus.write(address, Width::Word, self.r[k as usize]);
            address = address.wrapping_add(4);
            self.extra_cycles += 1;
        }
    }

    fn pop16<B: Bus>(&mut self, bus: &mut B, code: u32) -> Step {
        let mut address = self.r[SP];
        for k in (0..8).filter(|k| bit(code, *k)) {
            self.r[k as usize] = bus.read(address, Width::Word);
            address = address.wrapping_add(4);
            self.extra_cycles += 1;
        }
        if !bit(code, 8) {
            self.r[SP] = address;
            return Ok(());
        }
        let target = bus.read(address, Width::Word);
        self.extra_cycles += 1;
        self.r[SP] = address.wrapping_add(4);
        self.branch_exchange(target)
    }
}

/// NOP, YIELD, WFE, WFI, SEV.
pub(super) fn hint(number: u32) -> Step {
    match number {
        2 => Err(Event::WaitForEvent),
        3 => Err(Event::WaitForInterrupt),
        4 => Err(Event::SendEvent),
        _ => Ok(()),
    }
}
