//! The 32-bit encodings (A5.3): data processing, branches and control.

use super::alu::{ASR, LSL, bit, expand_immediate, shift, shift_immediate, sign_extend};
use super::thumb16::hint;
use super::{Bus, CONTROL_SPSEL, Core, Event, LR, SP, Step};

impl Core {
    /// Executes a 32-bit instruction: `h` is its first halfword, `l` its second.
    #[inline]
    pub(super) fn thumb32<B: Bus>(&mut self, bus: &mut B, h: u32, l: u32) -> Step {
        match h >> 9 & 15 {
            4 if !bit(h, 6) => self.load_store_multiple(bus, h, l),
            4 => self.load_store_dual_exclusive(bus, h, l),
            5 => self.shifted_register(h, l),
            6 | 7 => self.floating_point(bus, h, l),
            8..=11 if bit(l, 15) => self.branch_control(h, l),
            8..=11 if bit(h, 9) => self.plain_immediate(h, l),
            8..=11 => self.modified_immediate(h, l),
            12 => self.load_store_single(bus, h, l),
            13 => self.register_group(h, l),
            _ => Err(undefined(h, l)),
        }
    }

    /// Data processing with a shifted register (A5.3.11).
    #[inline]
    fn shifted_register(&mut self, h: u32, l: u32) -> Step {
        let amount = l >> 10 & 0x1C | l >> 6 & 3;
        let m = self.r[(l & 15) as usize];
        let (operand, carry) = shift_immediate(m, l >> 4 & 3, amount, self.carry);
        if h >> 5 & 15 == 6 {
            // PKHBT, PKHTB
            let a = self.r[(h & 15) as usize];
            self.r[(l >> 8 & 15) as usize] =
                if bit(l, 5) { a & 0xFFFF_0000 | operand & 0xFFFF } else { a & 0xFFFF | operand & 0xFFFF_0000 };
            return Ok(());
        }
        self.data_processing(h, l, operand, carry)
    }

    /// Data processing with a modified immediate (A5.3.1).
    #[inline]
    fn modified_immediate(&mut self, h: u32, l: u32) -> Step {
        let (operand, carry) = expand_immediate(immediate12(h, l), self.carry);
        self.data_processing(h, l, operand, carry)
    }

    /// The operations that both groups share.
    #[inline]
    fn data_processing(&mut self, h: u32, l: u32, b: u32, carry: bool) -> Step {
        let (n, d) = (h & 15, l >> 8 & 15);
        let flags = bit(h, 4);
        let a = self.r[n as usize];
        let sum = match h >> 5 & 15 {
            8 => Some(self.add(a, b, false, flags)),
            10 => Some(self.add(a, b, self.carry, flags)),
            11 => Some(self.add(a, !b, self.carry, flags)),
            13 => Some(self.add(a, !b, true, flags)),
            14 => Some(self.add(!a, b, true, flags)),
            _ => None,
        };
        if let Some(sum) = sum {
            // CMN and CMP have no destination.
            return if d == 15 && flags { Ok(()) } else { self.write_result(d, sum, h, l) };
        }
        let logical = match h >> 5 & 15 {
            0 => a & b,
            1 => a & !b,
            2 if n == 15 => b,
            2 => a | b,
            3 if n == 15 => !b,
            3 => a | !b,
            4 => a ^ b,
            _ => return Err(undefined(h, l)),
        };
        if flags {
            self.set_nz(logical);
            self.carry = carry;
            // TST and TEQ have no destination.
            if d == 15 {
                return Ok(());
            }
        }
        self.write_result(d, logical, h, l)
    }

    fn write_result(&mut self, d: u32, value: u32, h: u32, l: u32) -> Step {
        if d == 15 { Err(undefined(h, l)) } else { self.write_register(d, value) }
    }

    /// Data processing with a plain immediate (A5.3.3): ADDW, SUBW, MOVW, MOVT, saturation, bit fields.
    fn plain_immediate(&mut self, h: u32, l: u32) -> Step {
        let (n, d) = (h & 15, (l >> 8 & 15) as usize);
        let immediate = immediate12(h, l);
        let base = if n == 15 { self.literal_base() } else { self.r[n as usize] };
        let (least, most) = (l >> 10 & 0x1C | l >> 6 & 3, l & 31);
        match h >> 4 & 31 {
            0 => return self.write_register(d as u32, base.wrapping_add(immediate)),
            10 => return self.write_register(d as u32, base.wrapping_sub(immediate)),
            4 => self.r[d] = n << 12 | immediate,
            12 => self.r[d] = self.r[d] & 0xFFFF | (n << 12 | immediate) << 16,
            operation @ (16 | 18 | 24 | 26) => {
                // SSAT, USAT; with the shift ASR #0 the encoding is SSAT16, USAT16.
                let arithmetic = operation & 2 != 0;
                if arithmetic && least == 0 {
                    self.r[d] = self.saturate_halves(n, l & 15, operation >= 24);
                    return Ok(());
                }
                let (shifted, _) = shift_immediate(self.r[n as usize], if arithmetic { ASR } else { LSL }, least, self.carry);
                self.r[d] = self.saturate(i64::from(shifted as i32), most, operation >= 24);
            }
            operation @ (20 | 28) => {
                // SBFX, UBFX
                let width = most + 1;
                let value = self.r[n as usize] >> least;
                self.r[d] = match (operation, width) {
                    (_, 32) => value,
                    (20, _) => sign_extend(value & ((1 << width) - 1), width),
                    _ => value & ((1 << width) - 1),
                };
            }
            22 if most >= least => {
                // BFI, BFC
                let mask = (((1_u64 << (most + 1 - least)) - 1) << least) as u32;
                let value = if n == 15 { 0 } else { self.r[n as usize] };
                self.r[d] = self.r[d] & !mask | value << least & mask;
            }
            _ => return Err(undefined(h, l)),
        }
        Ok(())
    }

    /// Saturates to `bits` + 1 signed or `bits` unsigned bits.
    fn saturate(&mut self, value: i64, bits: u32, unsigned: bool) -> u32 {
        let (low, high) = if unsigned { (0, (1_i64 << bits) - 1) } else { (-(1_i64 << bits), (1_i64 << bits) - 1) };
        let limited = value.clamp(low, high);
        self.saturated |= limited != value;
        limited as u32
    }

    fn saturate_halves(&mut self, n: u32, bits: u32, unsigned: bool) -> u32 {
        let value = self.r[n as usize];
        let low = self.saturate(i64::from(value as i16), bits, unsigned);
        let high = self.saturate(i64::from((value >> 16) as i16), bits, unsigned);
        low & 0xFFFF | high << 16
    }

    /// Data processing (register), multiplication (A5.3.12 to A5.3.17).
    #[inline]
    fn register_group(&mut self, h: u32, l: u32) -> Step {
        let d = (l >> 8 & 15) as usize;
        let m = self.r[(l & 15) as usize];
        let n = h & 15;
        match h >> 7 & 3 {
            0 if !bit(l, 7) => {
                let (value, carry) = shift(self.r[n as usize], h >> 5 & 3, m & 0xFF, self.carry);
                if bit(h, 4) {
                    self.set_nz(value);
                    self.carry = carry;
                }
                self.r[d] = value;
                Ok(())
            }
            0 => self.extend(h, l),
            1 if !bit(l, 7) => self.parallel_add_subtract(h, l),
            1 => self.bit_operations(h, l),
            2 => self.multiply(h, l),
            _ => self.multiply_long(h, l),
        }
    }

    /// SXTAH, UXTAH, SXTB16 … (A5.3.12)
    fn extend(&mut self, h: u32, l: u32) -> Step {
        let n = h & 15;
        let base = if n == 15 { 0 } else { self.r[n as usize] };
        let rotated = self.r[(l & 15) as usize].rotate_right(8 * (l >> 4 & 3));
        self.r[(l >> 8 & 15) as usize] = match h >> 4 & 7 {
            0 => base.wrapping_add(sign_extend(rotated & 0xFFFF, 16)),
            1 => base.wrapping_add(rotated & 0xFFFF),
            4 => base.wrapping_add(sign_extend(rotated & 0xFF, 8)),
            5 => base.wrapping_add(rotated & 0xFF),
            kind @ (2 | 3) => {
                let part = |x: u32| if kind == 2 { sign_extend(x & 0xFF, 8) } else { x & 0xFF };
                base.wrapping_add(part(rotated)) & 0xFFFF | (base >> 16).wrapping_add(part(rotated >> 16)) << 16
            }
            _ => return Err(undefined(h, l)),
        };
        Ok(())
    }

    /// Branches and miscellaneous control (A5.3.4).
    #[inline]
    fn branch_control(&mut self, h: u32, l: u32) -> Step {
        let sign = h >> 10 & 1;
        let (j1, j2) = (l >> 13 & 1, l >> 11 & 1);
        if bit(l, 12) {
            // B (T4), BL
            let offset = sign << 24 | (j1 ^ sign ^ 1) << 23 | (j2 ^ sign ^ 1) << 22 | (h & 0x3FF) << 12 | (l & 0x7FF) << 1;
            if bit(l, 14) {
                self.r[LR] = self.next_pc | 1;
            }
            self.next_pc = self.pc_operand().wrapping_add(sign_extend(offset, 25));
            return Ok(());
        }
        if bit(l, 14) {
            return Err(undefined(h, l));
        }
        if h >> 7 & 7 != 7 {
            // B (T3)
            if self.condition(h >> 6 & 15) {
                let offset = sign << 20 | j2 << 19 | j1 << 18 | (h & 0x3F) << 12 | (l & 0x7FF) << 1;
                self.next_pc = self.pc_operand().wrapping_add(sign_extend(offset, 21));
            }
            return Ok(());
        }
        match h >> 4 & 0x7F {
            0x38 | 0x39 => {
                self.extra_cycles = 1;
                let value = self.r[(h & 15) as usize];
                self.move_to_special(l, value);
                Ok(())
            }
            0x3A => hint(l & 0xFF),
            0x3B => {
                // CLREX; barriers do nothing here: accesses are in order.
                if l >> 4 & 15 == 2 {
                    self.exclusive = None;
                }
                Ok(())
            }
            0x3E | 0x3F => {
                self.extra_cycles = 1;
                self.r[(l >> 8 & 15) as usize] = self.special(l & 0xFF);
                Ok(())
            }
            _ => Err(undefined(h, l)),
        }
    }

    /// MSR (B5.2.3).
    fn move_to_special(&mut self, l: u32, value: u32) {
        match l & 0xFF {
            0..=3 if bit(l, 11) => {
                let kept = self.greater_equal;
                self.set_apsr(value);
                if !bit(l, 10) {
                    self.greater_equal = kept;
                }
            }
            8 if self.uses_process_stack() => self.other_sp = value & !3,
            8 => self.r[SP] = value & !3,
            9 if self.uses_process_stack() => self.r[SP] = value & !3,
            9 => self.other_sp = value & !3,
            16 => self.primask = value & 1 != 0,
            17 => self.basepri = value as u8 & 0xF0,
            18 => {
                // BASEPRI_MAX raises the priority only.
                let priority = value as u8 & 0xF0;
                if priority != 0 && (self.basepri == 0 || priority < self.basepri) {
                    self.basepri = priority;
                }
            }
            19 => self.faultmask = value & 1 != 0,
            20 => {
                let before = self.uses_process_stack();
                // SPSEL is written in thread mode only.
                let kept = if self.ipsr == 0 { 0 } else { CONTROL_SPSEL };
                self.control = self.control & kept | value & 7 & !kept;
                if before != self.uses_process_stack() {
                    std::mem::swap(&mut self.other_sp, &mut self.r[SP]);
                }
            }
            _ => {}
        }
    }

    /// MRS (B5.2.2).
    fn special(&self, number: u32) -> u32 {
        let [main, process] = if self.uses_process_stack() { [self.other_sp, self.r[SP]] } else { [self.r[SP], self.other_sp] };
        match number {
            0..=7 => (if number & 4 == 0 { self.apsr() } else { 0 }) | if number & 1 != 0 { self.ipsr } else { 0 },
            8 => main,
            9 => process,
            16 => u32::from(self.primask),
            17 | 18 => u32::from(self.basepri),
            19 => u32::from(self.faultmask),
            20 => self.control,
            _ => 0,
        }
    }
}

/// The event of an undefined 32-bit encoding.
pub(super) fn undefined(h: u32, l: u32) -> Event {
    Event::Undefined(h << 16 | l)
}

/// i:imm3:imm8.
fn immediate12(h: u32, l: u32) -> u32 {
    (h >> 10 & 1) << 11 | (l >> 12 & 7) << 8 | l & 0xFF
}
